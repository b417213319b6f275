// The projection problem of one time step (Maury, Numer. Math. 102 (2006) 649).
//
// The problem asks for the velocities V that are nearest to the predicted velocities V* in the norm
// of the kinetic energy and keep every constraint of inelastic_contact_set.h:
//
//   minimise over V:   1/2 (V - V*)^T M (V - V*)  -  (1/h) sum of l_c (gap_c + h G_c . V)
//   subject to         gap_c + h G_c . V >= 0      for every rigid constraint c
//
// M is the mass matrix, h the time step, and G_c . V = n_c . (v_first - v_second). l_c <= 0 is the
// least impulse of the constraint: where it is 0 the contact only pushes; where it is below 0,
// opening the contact costs an energy of -l_c / h a length. The dual problem has one impulse
// lambda_c per constraint; the optimality conditions are
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
// What V consists of, and M, is in inelastic_unknowns.h.

#pragma once

#include "inelastic_contact_set.h"
#include "inelastic_unknowns.h"

namespace inelastic {

struct ContactProblem : Unknowns {
  double timestep = 0.0;    // h [time]
  ContactSet contacts;

  // Returns the diagonal entry of A for constraint c [time / mass]: what a unit impulse of the
  // constraint adds to its own w.
  double diagonal(std::size_t c) const { return contacts.diagonal(c, *this, timestep); }

  // Returns the length by which a unit impulse along n between two slots moves them apart in the
  // step [time / mass].
  double mobility_of_pair(int one, int other, const double *n) const
  { return timestep * (mobility(one, n) + mobility(other, n)); }
};

}    // namespace inelastic
