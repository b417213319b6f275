// The projection problem of one time step (Maury, Numer. Math. 102 (2006) 649).
//
// The problem asks for the velocities V that are nearest to the predicted velocities V* in the norm
// of the kinetic energy and keep every constraint of contact_set.h:
//
//   minimise over V:   1/2 (V - V*)^T M (V - V*)  -  (1/h) sum of l_c (gap_c + h G_c . V)
//   subject to         gap_c + h G_c . V >= 0      for every rigid constraint c
//
// M is the mass matrix, h the time step, and G_c . V = n_c . (v_first - v_second). l_c <= 0 is the
// least impulse of the constraint: where it is 0 the contact only pushes, elsewhere it takes that
// much energy a length to open it. The dual problem has one impulse lambda_c per constraint; the
// optimality conditions are
//
//   V = V* + M^-1 G^T lambda,   lambda >= l,  w >= 0,  (lambda - l) . w = 0,
//   w(lambda) = gap + h G V + C lambda
//
// C is diagonal and has the compliances. A rigid constraint has none; one with a compliance is a
// spring, which costs 1 / (2 h) C_c lambda_c^2 beside the energy that is minimised. w_c is a
// length: for a rigid constraint the gap at the end of the step as the linearised constraint sees
// it. The vector w is the gradient of the dual function 1/2 lambda^T A lambda + (gap + h G V*)^T
// lambda, where A = h G M^-1 G^T + C [time / mass].
//
// Every array per particle has one more entry than there are particles: a dummy particle that never
// moves stands for all walls.

#pragma once

#include "contact_set.h"
#include "rigid_bodies.h"

#include <vector>

namespace inelastic {

struct ContactProblem {
  double timestep = 0.0;    // h [time]
  // Counts the particles that this rank owns and its ghosts (host.h), owned ones
  // first.
  int particles = 0;
  std::vector<double> predicted_velocity;    // 3 per particle and 3 zeros [length / time]
  // One number per particle and a zero [1 / mass]. Zero freezes a particle; the numbers of
  // particles in bodies are not read.
  std::vector<double> inverse_mass;
  RigidBodies bodies;    // empty in a scene of free particles
  ContactSet contacts;

  // Sets the number of particles and the zeros of the dummy particle. The bodies stay as they are.
  void resize(int number_of_particles);

  // Returns n . M^-1 n [1 / mass]: the velocity along a unit vector n that a unit impulse along n
  // gives to a particle. It is zero for frozen particles and for the dummy particle.
  double mobility(int particle, const double *direction) const
  {
    return bodies.empty() || particle == particles || bodies.body[particle] < 0
        ? inverse_mass[particle]
        : bodies.mobility(particle, direction);
  }

  // Tells whether impulses move a particle; not the dummy particle.
  bool is_mobile(int particle) const
  {
    return bodies.empty() || particle == particles || bodies.body[particle] < 0
        ? inverse_mass[particle] > 0.0
        : bodies.inverse_mass[bodies.body[particle]] > 0.0;
  }

  // Returns the diagonal entry of A for constraint c [time / mass]: what a unit impulse of the
  // constraint adds to its own w.
  double diagonal(std::size_t c) const
  {
    return mobility_of_pair(contacts.first[c], contacts.second[c], &contacts.normal[3 * c]) +
        contacts.compliance[c];
  }

  // Returns the length by which a unit impulse along n between two particles moves them apart in
  // the step [time / mass].
  double mobility_of_pair(int one, int other, const double *n) const
  { return timestep * (mobility(one, n) + mobility(other, n)); }
};

}    // namespace inelastic
