// The constraints of one time step, as a structure of arrays.
//
// Constraint c keeps two particles, or a particle and a wall, apart during one time step:
//
//   gap_c + h n_c . (v_first - v_second) + C_c lambda_c >= 0                             [length]
//
//   n_c    is a unit normal. It points from the second side to the first (from the wall to the
//          particle).
//   gap_c  is the distance between the two surfaces; it is negative when they overlap. A
//          wall whose motion is prescribed has no velocity here: gap_c already has the length by
//          which it comes nearer during the step.
//   h      is the time step.
//   C_c    is the compliance of the contact, 0 for a rigid one: under its impulse the gap may be
//          smaller by C_c lambda_c.
//
// Each constraint carries one impulse lambda_c [mass length / time]: +lambda_c n_c acts on the
// first side and -lambda_c n_c on the second. The admissible set of a constraint
// (inelastic_admissible_set.h) holds the impulses that it may carry: those of at least l_c <= 0.
//
// G_c . V = n_c . (v_first - v_second) takes velocities to the speeds with which gaps open. How
// many numbers an impulse has, and how they meet velocities, is known here and in the packed passes
// (inelastic_packed_kernels.h) alone.
//
// Solvers resolve each constraint to a target of its own (inelastic_contact_targets.h), which the
// refinement makes smaller.

#pragma once

#include "inelastic_admissible_set.h"

#include <cmath>
#include <cstddef>
#include <vector>

namespace inelastic {

struct Unknowns;

struct ContactSet {
  std::vector<int> first;            // a particle, by its slot (inelastic_unknowns.h)
  std::vector<int> second;           // the slot of a particle or of a wall
  std::vector<double> normal;        // 3 per constraint
  std::vector<double> gap;           // [length]
  std::vector<double> impulse;       // [mass length / time]
  std::vector<double> compliance;    // [time / mass]
  std::vector<AdmissibleSet<double>> set;
  std::vector<double> refinement;    // > 0, at most 1

  std::size_t size() const { return gap.size(); }
  void clear();
  void add(int first_particle, int second_slot, const double *unit_normal, double gap_value,
           double impulse_guess, double compliance_value = 0.0,
           const AdmissibleSet<double> &admissible = {}, double refinement_value = 1.0);

  // Tells whether any contact has a compliance.
  bool has_springs() const;

  // Adds constraint c of another set as it is, but for its impulse, which is zero.
  void add_of(const ContactSet &other, std::size_t c);

  // Sets the impulses of all constraints from one on to zero.
  void forget_impulses(std::size_t from);

  // Takes, for each impulse, the admissible one that is nearest to it.
  void make_admissible();

  Impulse impulse_of(std::size_t c) const { return {impulse[c], {}}; }
  // Returns the size of the impulse of a contact [mass length / time].
  double magnitude(std::size_t c) const { return std::abs(impulse[c]); }
  // Tells whether a contact pushes with these impulses, which are in the order of `impulse`.
  bool pushes(std::size_t c, const double *impulses) const { return impulses[c] > 0.0; }
  // Returns the impulses of this set, without those that pull.
  std::vector<double> pushing() const;
  // Returns -lambda . (free_gap + C lambda + tolerance) [mass length^2 / time] for such impulses,
  // and raises `longest` to the largest overlap without impulses [length].
  double lacking(const double *impulses, const double *free_gap, double tolerance,
                 double &longest) const;
  // Tells whether the gap of a contact must be closed at the end of the step.
  bool is_loaded(std::size_t c) const { return set[c].is_loaded(impulse[c]); }

  // `gap_at_end` has the gaps at the end of the step, one number per constraint [length]. A number
  // that is not finite satisfies no constraint.
  Residual residual(std::size_t c, const double *gap_at_end) const
  {
    if (!std::isfinite(gap_at_end[c]) || !std::isfinite(impulse[c])) return UNSOLVED;
    return set[c].residual(gap_at_end[c], impulse[c]);
  }

  // Returns the diagonal entry of A for constraint c [time / mass] (inelastic_contact_problem.h):
  // what a unit impulse of the constraint adds to its own gap at the end of the step.
  double diagonal(std::size_t c, const Unknowns &unknowns, double timestep) const;

  // Returns gap + h G velocity of a constraint [length]; `velocity` has 3 per slot.
  double free_gap(std::size_t c, double timestep, const double *velocity) const;

  // Writes gap + h G velocity [length], one number per constraint; `velocity` has 3 per slot.
  void free_gaps(double timestep, const double *velocity, double *gap_at_end) const;

  // Writes free_gap + h G change + C impulses [length], one number per constraint; `change` has 3
  // per slot [length / time].
  void gaps_at_end(const double *free_gap, double timestep, const double *change,
                   const double *impulses, double *gap_at_end) const;

  // Adds G^T impulses to `sum`, 3 per slot [mass length / time].
  void add_impulses(const double *impulses, double *sum) const;
};

}    // namespace inelastic
