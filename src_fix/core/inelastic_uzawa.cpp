#include "inelastic_uzawa.h"

#include "inelastic_infeasibility.h"

#include <algorithm>
#include <cmath>

namespace inelastic {

SolverResult Uzawa::solve(ContactProblem &problem, const SolverLimits &limits, Host &host)
{
  ContactSet &contacts = problem.contacts;
  const std::size_t count = contacts.size();
  gap_operator_.prepare(problem);

  SolverResult result;
  judge_first_guess(problem, host);
  std::fill(contacts.impulse.begin(), contacts.impulse.end(), 0.0);
  const auto ended = [&](Status status) {
    result.status = status;
    settle_for_tolerance(limits, result.residual.feasibility, result);
    return result;
  };
  double step = 0.0;    // 1 / L; 0 = not yet known
  while (true) {
    gap_operator_.apply(problem, contacts.impulse.data(), gap_.data(), host);
    result.accurate = targets_.judge_feasibility(problem, limits, gap_operator_, gap_, host) <= 1.0;
    result.residual = targets_.residual();
    result.unresolved = targets_.unresolved();
    if (result.accurate) return ended(Status::CONVERGED);
    if (!std::isfinite(result.residual.feasibility)) return ended(Status::NOT_FINITE);
    if (result.iterations >= limits.max_iterations) return ended(Status::OUT_OF_ITERATIONS);
    if (result.iterations > 0) result.trend.see(result.iterations, result.residual.feasibility);
    if (result.iterations > 0 && result.iterations % CHECK_EVERY == 0 &&
        is_infeasible(problem, gap_operator_, limits, host))
      return ended(Status::INFEASIBLE);
    if (step == 0.0) step = 1.0 / largest_eigenvalue(problem, host);
    for (std::size_t c = 0; c < count; ++c)
      contacts.impulse[c] = contacts.set[c].project(contacts.impulse[c] - step * gap_[c]);
    ++result.iterations;
  }
}

}    // namespace inelastic
