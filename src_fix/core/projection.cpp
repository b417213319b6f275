#include "projection.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace inelastic {

namespace {

  // Where no velocities are admissible the gaps under forces tell nothing.
  void find_worst(const std::vector<double> &gap_at_end, const std::vector<double> &impulse,
                  std::size_t count, ProjectionResult &result)
  {
    double most = 0.0;
    for (std::size_t c = 0; c < count; ++c) {
      const bool matters = gap_at_end[c] < 0.0 || (impulse[c] > 0.0 && !result.infeasible);
      if (!matters || !(std::abs(gap_at_end[c]) > most)) continue;
      most = std::abs(gap_at_end[c]);
      result.worst = c;
      result.worst_gap = gap_at_end[c];
    }
  }

}    // namespace

ProjectionResult project(ContactProblem &problem, ConstraintSource &source, Solver &solver,
                         const SolverLimits &limits, int max_rounds, Host &host,
                         std::vector<double> &velocity)
{
  ProjectionResult result;
  GapOperator &gap_operator = solver.gap_operator();
  velocity.resize(3 * static_cast<std::size_t>(problem.particles));
  while (true) {
    const SolverLimits remaining = {limits.tolerance, limits.max_iterations - result.iterations,
                                    limits.reach};
    const SolverResult solved = solver.solve(problem, remaining, host);
    ++result.rounds;
    result.iterations += solved.iterations;
    result.residual = solved.residual;
    result.converged = solved.converged;
    result.infeasible = solved.infeasible;
    result.round_off = solved.round_off;
    result.trend = solved.trend;

    const std::size_t solved_for = problem.contacts.size();
    if (solved.converged)
      gap_operator.velocity_applied(problem, velocity.data());
    else
      gap_operator.velocity(problem, problem.contacts.impulse.data(), velocity.data(), host);
    double changed = static_cast<double>(source.refine(velocity, problem));
    host.reduce(&changed, 1, nullptr, 0);
    result.complete = changed == 0.0;
    if (result.complete && result.converged) return result;
    if (result.complete || !solved.converged || result.rounds >= max_rounds) {
      // Nothing will be done about what was added, but the residual must tell of it.
      std::vector<double> &impulse = problem.contacts.impulse;
      // What was added with a first guess has pushed nobody.
      std::fill(impulse.begin() + static_cast<std::ptrdiff_t>(solved_for), impulse.end(), 0.0);
      std::vector<double> gap_at_end(problem.contacts.size());
      gap_operator.prepare(problem);
      gap_operator.apply(problem, impulse.data(), gap_at_end.data(), host);
      result.residual = residual(gap_at_end.data(), impulse.data(), gap_at_end.size());
      double maxima[2] = {result.residual.feasibility, result.residual.complementarity};
      host.reduce(nullptr, 0, maxima, 2);
      result.residual = {maxima[0], maxima[1]};
      find_worst(gap_at_end, impulse, solved.converged ? gap_at_end.size() : solved_for, result);
      return result;
    }
  }
}

}    // namespace inelastic
