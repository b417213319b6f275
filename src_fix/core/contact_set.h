// The constraints of one time step, as a structure of arrays.
//
// Constraint c keeps two particles, or a particle and a wall, apart during one time step:
//
//   gap_c + h n_c . (v_first - v_second) + C_c lambda_c >= 0                             [length]
//
//   n_c    is a unit normal. It points from the second side to the first (from the wall to the
//          particle).
//   gap_c  is the distance between the two surfaces; it is negative when they overlap. Where the
//          motion of a wall is prescribed, what it is during the step is already in the gap, and
//          the wall has no velocity here.
//   h      is the time step.
//   C_c    is the compliance of the contact, 0 for a rigid one: under its impulse the gap may be
//          smaller by C_c lambda_c.
//
// Each constraint carries one impulse lambda_c [mass length / time]: +lambda_c n_c acts on the
// first particle and -lambda_c n_c on the second. Which impulses it may be is its admissible set
// (admissible_set.h): those of at least l_c <= 0.
//
// Solvers resolve each constraint to a target of its own (contact_targets.h), which the refinement
// makes smaller.

#pragma once

#include "admissible_set.h"

#include <cstddef>
#include <vector>

namespace inelastic {

struct ContactSet {
  std::vector<int> first;            // a particle, by its slot (unknowns.h)
  std::vector<int> second;           // the slot of a particle or of a wall
  std::vector<double> normal;        // 3 per constraint
  std::vector<double> gap;           // [length]
  std::vector<double> impulse;       // [mass length / time]
  std::vector<double> compliance;    // [time / mass]
  std::vector<HalfLine<double>> set;
  std::vector<double> refinement;    // > 0, at most 1

  std::size_t size() const { return gap.size(); }
  void clear();
  void add(int first_particle, int second_slot, const double *unit_normal, double gap_value,
           double impulse_guess, double compliance_value = 0.0, double least_impulse = 0.0,
           double refinement_value = 1.0);
};

}    // namespace inelastic
