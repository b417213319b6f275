// Rotations as LAMMPS makes them: quaternions w x y z.

#ifndef INELASTIC_ROTATION_H
#define INELASTIC_ROTATION_H

#include "inelastic_rigid_bodies.h"
#include "inelastic_vector3.h"

#include <cmath>

namespace LAMMPS_NS::Inelastic_NS {

inline void normalise(double *q)
{
  const double scale = 1.0 / std::sqrt(q[0] * q[0] + inelastic::dot(q + 1, q + 1));
  for (int k = 0; k < 4; ++k) q[k] *= scale;
}

// (1 + s w) q, normalised.
inline void turn_by(const double *q, double s, const double *w, double *turned)
{
  double across[3];
  inelastic::cross(w, q + 1, across);
  turned[0] = q[0] - s * inelastic::dot(w, q + 1);
  for (int d = 0; d < 3; ++d) turned[1 + d] = q[1 + d] + s * (q[0] * w[d] + across[d]);
  normalise(turned);
}

// By how much a rotation (sign 1.0) or its inverse (-1.0) displaces x; exact to round-off for small
// rotations too.
inline void displacement(const double *q, double sign, const double *x, double *displaced)
{
  const double axis[3] = {sign * q[1], sign * q[2], sign * q[3]};
  double once[3], twice[3];
  inelastic::cross(axis, x, once);
  inelastic::cross(axis, once, twice);
  for (int d = 0; d < 3; ++d) displaced[d] = 2.0 * (q[0] * once[d] + twice[d]);
}

inline void rotate(const double *q, double sign, const double *x, double *rotated)
{
  double displaced[3];
  displacement(q, sign, x, displaced);
  for (int d = 0; d < 3; ++d) rotated[d] = x[d] + displaced[d];
}

// The angular velocity for an angular momentum after a turn from the orientation that the inverse
// inertia belongs to.
inline void angular_velocity_turned(const double *q, const double *inverse_inertia,
                                    const double *momentum, double *angular_velocity)
{
  double before[3], slow[3];
  rotate(q, -1.0, momentum, before);
  inelastic::multiply(inverse_inertia, before, slow);
  rotate(q, 1.0, slow, angular_velocity);
}

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
