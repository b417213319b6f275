#include "contact_problem.h"

#include <algorithm>

namespace inelastic {

void ContactProblem::resize(int number_of_particles)
{
  particles = number_of_particles;
  const std::size_t slots = static_cast<std::size_t>(number_of_particles) + 1;
  predicted_velocity.resize(3 * slots);
  inverse_mass.resize(slots);
  std::fill_n(predicted_velocity.end() - 3, 3, 0.0);
  inverse_mass.back() = 0.0;
}

}    // namespace inelastic
