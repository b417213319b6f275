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
  double farthest = 0.0;
  const double lacking = problem.contacts.lacking(impulse.data(), gap_operator.free_gap().data(),
                                                  limits.tolerance, farthest);
  for (int i = 0; i < problem.slots(); ++i) {
    const double *const v = &problem.predicted_velocity[3 * static_cast<std::size_t>(i)];
    farthest = std::max(farthest, problem.timestep * std::hypot(v[0], v[1], v[2]));
  }
  const GapOperator::ImpulseNorm norm = gap_operator.impulse_norm(problem, impulse.data(), host);
  double sums[3] = {lacking, norm.squared, norm.mass};
  host.reduce(sums, 3, &farthest, 1);
  return sums[0] > std::max(limits.reach, FAR * farthest) * std::sqrt(sums[1] * sums[2]);
}

}    // namespace inelastic
