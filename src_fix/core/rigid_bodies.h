// The inverse mass operator of rigid bodies, each of any number of particles.
//
// Impulses s_k on the particles of a body, at r_k from its centre of mass, change its velocities by
//
//   dv = (1/M) sum_k s_k,    dw = I^-1 sum_k r_k x s_k,    dv_k = dv + dw x r_k
//
// with M the body's mass and I its inertia about the centre of mass, both in the space frame.
// Particles on a line have no moment about it when they are point masses; there I^-1 is the
// pseudo-inverse: no impulse on the particles turns the body about that line.
//
// A particle may be there several times: once as the original, then as copies (a host's images of
// it, see host.h), which move with the body and have the impulses of their original.

#pragma once

#include <cstddef>
#include <vector>

namespace inelastic {

// y = A x for a symmetric A in the order xx yy zz xy xz yz.
inline void multiply(const double *a, const double *x, double *y)
{
  y[0] = a[0] * x[0] + a[3] * x[1] + a[4] * x[2];
  y[1] = a[3] * x[0] + a[1] * x[1] + a[5] * x[2];
  y[2] = a[4] * x[0] + a[5] * x[1] + a[2] * x[2];
}

struct RigidBodies {
  std::vector<int> start;    // of each body's members, then the number of all: bodies + 1 numbers
  std::vector<int> originals;    // per body: how many of its members, the first, are originals
  std::vector<double> inverse_mass;       // per body [1 / mass]
  std::vector<double> inverse_inertia;    // 6 per body: xx yy zz xy xz yz [1 / (mass length^2)]
  std::vector<int> member;                // particle index
  std::vector<double> arm;    // 3 per member: from the body's centre of mass to the particle
  std::vector<int> place;     // per particle: where it is in `member`, -1 = in no body
  std::vector<int> body;      // per particle: its body, -1 = in none

  bool empty() const { return inverse_mass.empty(); }
  std::size_t size() const { return inverse_mass.size(); }

  void clear(int number_of_particles);

  // Adds a body of `count` members, of which the first `number_of_originals` are originals.
  void add(const int *members, const double *arms, int count, int number_of_originals,
           double inverse_mass_value, const double *inverse_inertia_values);

  // In place, for the particles in bodies: from impulses (3 per particle) to velocity changes.
  void velocity_change(double *per_particle) const;

  // Velocity along a unit vector that a unit impulse along it gives to a particle of a body.
  double mobility(int particle, const double *direction) const;
};

}    // namespace inelastic
