// The constraints of one time step, as a structure of arrays.
//
// Constraint c keeps two particles, or a particle and a wall, apart during one time step:
//
//   gap_c + h n_c . (v_first - v_second) + C_c lambda_c >= 0                             [length]
//
//   n_c    is a unit normal. It points from the second side to the first (from the wall to the
//          particle).
//   gap_c  is the distance between the two surfaces; it is negative when they overlap. If the wall
//          moves, its motion during the step is already in the gap, so that a wall has no velocity
//          here.
//   h      is the time step.
//   C_c    is the compliance of the contact, 0 for a rigid one: under its impulse the gap may be
//          smaller by C_c lambda_c.
//
// Each constraint carries one impulse lambda_c [mass length / time]: +lambda_c n_c acts on the
// first particle and -lambda_c n_c on the second. It is at least l_c <= 0: where l_c is 0 a contact
// only pushes; elsewhere it may also pull, by up to -l_c, and opens only where it pulls by as much.
//
// Solvers resolve each constraint to a target of its own (contact_targets.h), which the refinement
// makes smaller.

#pragma once

#include <cstddef>
#include <vector>

namespace inelastic {

struct ContactSet {
  std::vector<int> first;         // index of a particle
  std::vector<int> second;        // index of a particle; the number of particles stands for a wall
  std::vector<double> normal;     // 3 per constraint
  std::vector<double> gap;        // [length]
  std::vector<double> impulse;    // [mass length / time]
  std::vector<double> compliance;    // [time / mass]
  std::vector<double> least;         // l [mass length / time], <= 0
  std::vector<double> refinement;    // > 0, at most 1

  std::size_t size() const { return gap.size(); }
  void clear();
  void add(int first_particle, int second_particle, const double *unit_normal, double gap_value,
           double impulse_guess, double compliance_value = 0.0, double least_impulse = 0.0,
           double refinement_value = 1.0);
};

}    // namespace inelastic
