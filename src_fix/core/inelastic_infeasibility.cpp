#include "inelastic_infeasibility.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace inelastic {

bool is_infeasible(const ContactProblem &problem, GapOperator &gap_operator,
                   const SolverLimits &limits, Host &host)
{
  constexpr double FAR = 10.0;
  // Any impulses that push give a bound. Contacts that pull let go where there is no room.
  const std::vector<double> impulse = problem.contacts.pushing();
  double longest = 0.0;
  const double lacking = problem.contacts.lacking(impulse.data(), gap_operator.free_gap().data(),
                                                  limits.tolerance, longest);
  for (int i = 0; i < problem.slots(); ++i) {
    const double *const v = &problem.predicted_velocity[3 * static_cast<std::size_t>(i)];
    longest = std::max(longest, problem.timestep * std::hypot(v[0], v[1], v[2]));
  }
  const GapOperator::ImpulseNorm norm = gap_operator.impulse_norm(problem, impulse.data(), host);
  double sums[3] = {lacking, norm.squared, norm.mass};
  host.reduce(sums, 3, &longest, 1);
  return sums[0] > std::max(limits.longest_move, FAR * longest) * std::sqrt(sums[1] * sums[2]);
}

}    // namespace inelastic
