#include "projection.h"

namespace inelastic {

ProjectionResult project(ContactProblem &problem, ConstraintSource &source, Solver &solver,
                         const SolverLimits &limits, int max_rounds, Host &host,
                         std::vector<double> &velocity)
{
  ProjectionResult result;
  GapOperator gap_operator;
  velocity.resize(3 * static_cast<std::size_t>(problem.particles));
  while (true) {
    const SolverLimits remaining = {limits.tolerance, limits.max_iterations - result.iterations};
    const SolverResult solved = solver.solve(problem, remaining, host);
    ++result.rounds;
    result.iterations += solved.iterations;
    result.residual = solved.residual;
    result.converged = solved.converged;

    gap_operator.prepare(problem);
    gap_operator.velocity(problem, problem.contacts.impulse.data(), velocity.data(), host);
    double changed = static_cast<double>(source.refine(velocity, problem));
    host.reduce(&changed, 1, nullptr, 0);
    if (changed == 0.0) {
      result.complete = true;
      return result;
    }
    if (!solved.converged || result.rounds >= max_rounds) {
      // Nothing will be done about what was added, but the residual must tell of it.
      std::vector<double> gap_at_end(problem.contacts.size());
      gap_operator.prepare(problem);
      gap_operator.apply(problem, problem.contacts.impulse.data(), gap_at_end.data(), host);
      result.residual =
          residual(gap_at_end.data(), problem.contacts.impulse.data(), gap_at_end.size());
      double maxima[2] = {result.residual.feasibility, result.residual.complementarity};
      host.reduce(nullptr, 0, maxima, 2);
      result.residual = {maxima[0], maxima[1]};
      return result;
    }
  }
}

}    // namespace inelastic
