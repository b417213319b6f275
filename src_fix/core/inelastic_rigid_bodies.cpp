#include "inelastic_rigid_bodies.h"

#include "inelastic_vector3.h"
#include "inelastic_vectorise.h"

#include <algorithm>

namespace inelastic {

void RigidBodies::clear(int number_of_particles)
{
  start.assign(1, 0);
  originals.clear();
  inverse_mass.clear();
  inverse_inertia.clear();
  member.clear();
  arm.clear();
  place.assign(number_of_particles, -1);
  body.assign(number_of_particles, -1);
}

void RigidBodies::add(const int *members, const double *arms, int count, int number_of_originals,
                      double inverse_mass_value, const double *inverse_inertia_values)
{
  for (int k = 0; k < count; ++k) {
    place[members[k]] = start.back() + k;
    body[members[k]] = static_cast<int>(size());
  }
  member.insert(member.end(), members, members + count);
  arm.insert(arm.end(), arms, arms + 3 * static_cast<std::size_t>(count));
  start.push_back(start.back() + count);
  originals.push_back(number_of_originals);
  inverse_mass.push_back(inverse_mass_value);
  inverse_inertia.insert(inverse_inertia.end(), inverse_inertia_values, inverse_inertia_values + 6);
}

INELASTIC_CLONES void RigidBodies::velocity_change(double *per_particle) const
{
  const int *const particle = member.data();
  const double *const arms = arm.data();
  const std::size_t bodies = size();
  for (std::size_t b = 0; b < bodies; ++b) {
    const int first = start[b], end = start[b + 1], last_original = first + originals[b];
    double sum[3] = {0.0, 0.0, 0.0}, moment[3] = {0.0, 0.0, 0.0};
    for (int k = first; k < last_original; ++k) {
      const double *const r = arms + 3 * static_cast<std::size_t>(k);
      const double *const s = per_particle + 3 * static_cast<std::size_t>(particle[k]);
      sum[0] += s[0];
      sum[1] += s[1];
      sum[2] += s[2];
      double moment_of_one[3];
      cross(r, s, moment_of_one);
      for (int d = 0; d < 3; ++d) moment[d] += moment_of_one[d];
    }
    const double w = inverse_mass[b];
    double turn[3];
    multiply(&inverse_inertia[6 * b], moment, turn);
    for (int k = first; k < end; ++k) {
      const double *const r = arms + 3 * static_cast<std::size_t>(k);
      // dv and dw x r are not added by cross(): another order of the sums would change the last
      // bits.
      double *const dv = per_particle + 3 * static_cast<std::size_t>(particle[k]);
      dv[0] = w * sum[0] + turn[1] * r[2] - turn[2] * r[1];
      dv[1] = w * sum[1] + turn[2] * r[0] - turn[0] * r[2];
      dv[2] = w * sum[2] + turn[0] * r[1] - turn[1] * r[0];
    }
  }
}

double RigidBodies::mobility(int particle, const double *n) const
{
  const std::size_t b = static_cast<std::size_t>(body[particle]);
  const double *const r = &arm[3 * static_cast<std::size_t>(place[particle])];
  double moment[3], turn[3];
  cross(r, n, moment);
  multiply(&inverse_inertia[6 * b], moment, turn);
  // The sum is not written with dot(): another order of the sums would change the last bits.
  return inverse_mass[b] + moment[0] * turn[0] + moment[1] * turn[1] + moment[2] * turn[2];
}

}    // namespace inelastic
