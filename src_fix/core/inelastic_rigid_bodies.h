// The inverse mass operator of rigid bodies, each made of any number of particles.
//
// Impulses s_k on the particles of a body, at arms r_k from its centre of mass, change its velocity
// v, its angular velocity w and the velocities v_k of its particles by
//
//   dv = (1/M) sum_k s_k,    dw = I^-1 sum_k r_k x s_k,    dv_k = dv + dw x r_k
//
// M is the body's mass and I its inertia about the centre of mass in the space frame (the equations
// of Newton and Euler for impulses). Point masses on a line have no inertia about that line; I^-1
// is then the pseudo-inverse, since no impulse on the particles turns the body about the line.
//
// A particle may be a member several times: once as the original, then as its copies, further
// images of it on the same rank, which move with the body. Impulses are read from the originals
// alone: those of a copy are the same.

#pragma once

#include <cstddef>
#include <vector>

namespace inelastic {

// y = A x for a symmetric matrix A, given as xx yy zz xy xz yz.
inline void multiply(const double *a, const double *x, double *y)
{
  y[0] = a[0] * x[0] + a[3] * x[1] + a[4] * x[2];
  y[1] = a[3] * x[0] + a[1] * x[1] + a[5] * x[2];
  y[2] = a[4] * x[0] + a[5] * x[1] + a[2] * x[2];
}

struct RigidBodies {
  std::vector<double> inverse_mass;       // per body [1 / mass]; zero for a frozen body
  std::vector<double> inverse_inertia;    // 6 per body: xx yy zz xy xz yz [1 / (mass length^2)]
  // Body b has the members start[b] ... start[b + 1] - 1, of which the first originals[b] are
  // originals.
  std::vector<int> start;    // bodies + 1 numbers
  std::vector<int> originals;
  std::vector<int> member;    // per member: the index of its particle
  // 3 per member: from the body's centre of mass to the particle [length]
  std::vector<double> arm;
  std::vector<int> place;    // per particle: its index in `member`; -1 if it is in no body
  std::vector<int> body;     // per particle: the index of its body; -1 if it is in no body

  bool empty() const { return inverse_mass.empty(); }
  std::size_t size() const { return inverse_mass.size(); }

  // Removes all bodies; from now on there are so many particles.
  void clear(int number_of_particles);

  // Adds a body of `count` members, of which the first `number_of_originals` are originals.
  void add(const int *members, const double *arms, int count, int number_of_originals,
           double inverse_mass_value, const double *inverse_inertia_values);

  // Replaces the impulses on the particles in bodies (3 per particle) by their changes of velocity.
  void velocity_change(double *per_particle) const;

  // Returns the velocity along a unit vector that a unit impulse along it gives to a particle of a
  // body [1 / mass].
  double mobility(int particle, const double *direction) const;
};

}    // namespace inelastic
