#include "inelastic_projection.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace inelastic {

namespace {

  // Gaps under forces are looked at only where no overlap, on any rank, is beyond the tolerance.
  // (Without admissible velocities they tell nothing.)
  void find_worst(const std::vector<double> &gap_at_end, const ContactSet &contacts,
                  std::size_t count, double tolerance, ProjectionResult &result)
  {
    const bool overlaps_only = result.status == Status::INFEASIBLE ||
        result.residual.feasibility > tolerance;
    double most = 0.0;
    for (std::size_t c = 0; c < count; ++c) {
      const bool matters = gap_at_end[c] < 0.0 || (contacts.is_loaded(c) && !overlaps_only);
      if (!matters || !(std::abs(gap_at_end[c]) > most)) continue;
      most = std::abs(gap_at_end[c]);
      result.worst = c;
      result.worst_gap = gap_at_end[c];
    }
  }

  // Judges the impulses of a projection that failed by all constraints, those included that were
  // added after the last solve and will not be solved for. Those that were added with a first guess
  // have moved no particle: their impulses become 0.
  void judge_failure(ContactProblem &problem, GapOperator &gap_operator, std::size_t solved_for,
                     double tolerance, Host &host, ProjectionResult &result)
  {
    problem.contacts.forget_impulses(solved_for);
    std::vector<double> gap_at_end(problem.contacts.size());
    gap_operator.prepare(problem);
    gap_operator.apply(problem, problem.contacts.impulse.data(), gap_at_end.data(), host);
    result.residual = residual_over_ranks(gap_at_end.data(), problem.contacts, host);
    const bool solved = result.status == Status::OUT_OF_ROUNDS;
    find_worst(gap_at_end, problem.contacts, solved ? gap_at_end.size() : solved_for, tolerance,
               result);
  }

}    // namespace

ProjectionResult project(ContactProblem &problem, ConstraintSource &source, Solver &solver,
                         const SolverLimits &limits, int max_rounds, Host &host,
                         std::vector<double> &velocity)
{
  ProjectionResult result;
  GapOperator &gap_operator = solver.gap_operator();
  velocity.resize(problem.predicted_velocity.size());
  bool coarse = limits.coarseness > 1.0;
  Refined refined;
  bool goes_on = false;    // whether the last solve, which converged, was of the same targets
  while (true) {
    SolverLimits remaining = limits;
    remaining.max_iterations -= result.iterations;
    if (!coarse) remaining.coarseness = 1.0;
    const SolverResult solved = goes_on ? solver.go_on(problem, refined, remaining, host)
                                        : solver.solve(problem, remaining, host);
    ++result.rounds;
    result.status = solved.status;
    result.iterations += solved.iterations;
    result.residual = solved.residual;
    result.round_off = solved.round_off;
    result.accurate = solved.accurate;
    result.unresolved = solved.unresolved;
    result.trend = solved.trend;

    const std::size_t solved_for = problem.contacts.size();
    const bool converged = solved.status == Status::CONVERGED;
    if (converged)
      gap_operator.velocity_applied(problem, velocity.data());
    else
      gap_operator.velocity(problem, problem.contacts.impulse.data(), velocity.data(), host);
    refined = source.refine(velocity, problem);
    double changed = static_cast<double>(refined.number);
    host.reduce(&changed, 1, nullptr, 0);
    if (converged && changed == 0.0) {
      if (!coarse) return result;
      coarse = goes_on = false;
      continue;
    }
    goes_on = converged;
    if (converged && result.rounds < max_rounds) continue;
    if (converged) result.status = Status::OUT_OF_ROUNDS;
    judge_failure(problem, gap_operator, solved_for, limits.tolerance, host, result);
    return result;
  }
}

}    // namespace inelastic
