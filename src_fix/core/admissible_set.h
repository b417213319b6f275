// What the impulse of a contact may be. Solvers, kernels and residuals know it by the functions of
// its class alone, and are written for any class that has them, in single or double precision.
//
// HalfLine: one number lambda >= l, along the normal of the contact. With l = 0 a contact only
// pushes; with l < 0 it may also pull, by up to -l, and opens only where it pulls by as much. With
// w the gap at the end of the step, a solution has (contact_problem.h)
//
//   lambda >= l,   w >= 0,   (lambda - l) w = 0                   [mass length / time], [length]

#pragma once

namespace inelastic {

template <typename Real> struct HalfLine {
  Real least = 0;    // l <= 0

  // Returns the admissible impulse that is nearest to `free`.
  Real project(Real free) const { return free > least ? free : least; }

  // Tells whether an impulse is one under which the gap must be closed at the end of the step.
  bool is_loaded(Real impulse) const { return impulse > least; }

  // Tells whether a contact may pull.
  bool may_pull() const { return least < 0; }

  // Returns the impulse of a contact whose gap is open, and by how much another one is more.
  Real idle() const { return least; }
  Real load(Real impulse) const { return impulse - least; }

  // Returns the residual of a contact [length]: what is lacking of its gap, or what its gap is open
  // under a force.
  Real residual(Real gap_at_end, Real impulse) const
  { return is_loaded(impulse) && gap_at_end > 0 ? gap_at_end : gap_at_end < 0 ? -gap_at_end : 0; }

  // Returns the set of what may be added to an impulse.
  HalfLine changes_of(Real impulse) const { return {least - impulse}; }

  // Returns the set of the same impulses in another unit and precision.
  template <typename Other> HalfLine<Other> in_units(double unit) const
  { return {static_cast<Other>(least / unit)}; }
};

}    // namespace inelastic
