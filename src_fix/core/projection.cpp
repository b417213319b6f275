#include "projection.h"

namespace inelastic {

ProjectionResult project(ContactProblem &problem, ConstraintSource &source, Solver &solver,
                         const SolverLimits &limits, int max_rounds, Host &host,
                         std::vector<double> &velocity)
{
  ProjectionResult result;
  GapOperator gap_operator;
  velocity.resize(3 * static_cast<std::size_t>(problem.particles));
  while (result.rounds < max_rounds) {
    const SolverLimits remaining = {limits.tolerance, limits.max_iterations - result.iterations};
    const SolverResult solved = solver.solve(problem, remaining, host);
    ++result.rounds;
    result.iterations += solved.iterations;
    result.residual = solved.residual;
    result.converged = solved.converged;

    gap_operator.prepare(problem);
    gap_operator.velocity(problem, problem.contacts.impulse.data(), velocity.data(), host);
    if (!solved.converged) return result;

    double changed = static_cast<double>(source.refine(velocity, problem));
    host.reduce(&changed, 1, nullptr, 0);
    if (changed == 0.0) {
      result.complete = true;
      return result;
    }
  }
  return result;
}

}    // namespace inelastic
