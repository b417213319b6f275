// The constraints of one contact problem, as a structure of arrays.
//
// Constraint c keeps two particles (or a particle and a wall) apart during one time step:
//
//   gap_c + h n_c . (v_first - v_second) >= 0                                            [length]
//
//   n_c    unit normal, from the second side to the first (from the wall to the particle)
//   gap_c  distance between the two surfaces, negative when they overlap. For a moving wall the
//          wall's own motion during the step is already in it, so that a wall has no velocity here.
//   h      time step
//
// Each constraint carries one impulse lambda_c >= 0 [mass length / time]: +lambda n acts on the
// first particle, -lambda n on the second.

#pragma once

#include <cstddef>
#include <vector>

namespace inelastic {

struct ContactSet {
  std::vector<int> first;     // particle index
  std::vector<int> second;    // particle index; number of particles (the dummy particle) = a wall
  std::vector<double> normal;    // 3 per constraint
  std::vector<double> gap;
  std::vector<double> impulse;

  std::size_t size() const { return gap.size(); }
  void clear();
  void add(int first_particle, int second_particle, const double *unit_normal, double gap_value,
           double impulse_guess);
};

}    // namespace inelastic
