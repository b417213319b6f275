#include "inelastic_unknowns.h"

#include "inelastic_host.h"

#include <algorithm>

namespace inelastic {

void Unknowns::resize(int number_of_particles, int number_of_walls)
{
  particles = number_of_particles;
  walls = number_of_walls;
  predicted_velocity.resize(3 * static_cast<std::size_t>(slots()));
  inverse_mass.resize(slots());
  std::fill(predicted_velocity.begin() + 3 * static_cast<std::ptrdiff_t>(particles),
            predicted_velocity.end(), 0.0);
  std::fill(inverse_mass.begin() + particles, inverse_mass.end(), 0.0);
}

bool Unknowns::any_wall_moves() const
{
  return std::any_of(inverse_mass.begin() + particles, inverse_mass.end(), [](double inverse) {
    return inverse > 0.0;
  });
}

void Unknowns::velocity_change(double *per_slot, Host &host) const
{
  host.sum_over_ghosts(per_slot, 3);
  if (any_wall_moves())
    host.sum_over_ranks(per_slot + 3 * static_cast<std::size_t>(particles), 3 * walls);
  const auto divide_by_mass = [&](int slot) {
    double *const v = per_slot + 3 * static_cast<std::size_t>(slot);
    const double w = inverse_mass[slot];
    v[0] *= w;
    v[1] *= w;
    v[2] *= w;
  };
  if (bodies.empty()) {
    for (int slot = 0; slot < slots(); ++slot) divide_by_mass(slot);
    return;
  }
  for (int slot = 0; slot < slots(); ++slot)
    if (!is_member(slot)) divide_by_mass(slot);
  bodies.velocity_change(per_slot);
}

}    // namespace inelastic
