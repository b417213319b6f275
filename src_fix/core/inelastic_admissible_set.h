// What the impulse of a contact may be. Solvers, kernels and residuals know it by the functions of
// its class alone, and are written for any class that has them, in single or double precision.
//
// HalfLine: one number lambda >= l, along the normal of the contact. With l = 0 a contact only
// pushes; with l < 0 it may also pull, by up to -l, and opens only where it pulls by as much. With
// w the gap at the end of the step, a solution has (inelastic_contact_problem.h)
//
//   lambda >= l,   w >= 0,   (lambda - l) w = 0                   [mass length / time], [length]

#pragma once

#include <algorithm>
#include <array>
#include <limits>

namespace inelastic {

// The impulse of a contact on its first side.
struct Impulse {
  double normal = 0.0;                   // lambda [mass length / time]
  std::array<double, 3> tangential{};    // across n [mass length / time]; 0 for a half line

  Impulse &operator+=(const Impulse &other)
  {
    normal += other.normal;
    for (int d = 0; d < 3; ++d) tangential[d] += other.tangential[d];
    return *this;
  }
};

// How far a contact, or the worst one of many, is from a solution (inelastic_solver.h).
struct Residual {
  double feasibility = 0.0;        // [length], >= 0
  double complementarity = 0.0;    // [length], >= 0

  double largest() const { return std::max(feasibility, complementarity); }
};

// The residual of impulses that cannot be judged, because a number is not finite.
constexpr Residual UNSOLVED = {std::numeric_limits<double>::infinity(),
                               std::numeric_limits<double>::infinity()};

template <typename Real> struct HalfLine {
  Real least = 0;    // l <= 0

  // Returns the admissible impulse that is nearest to `free`.
  Real project(Real free) const { return free > least ? free : least; }

  // Tells whether an impulse is one under which the gap must be closed at the end of the step.
  bool is_loaded(Real impulse) const { return impulse > least; }

  // Tells whether a contact may pull.
  bool may_pull() const { return least < 0; }

  // idle() returns the impulse of a contact whose gap is open, load() by how much an impulse is
  // more than that.
  Real idle() const { return least; }
  Real load(Real impulse) const { return impulse - least; }

  // Returns the residual of a contact: the length that its gap lacks at the end of the step, and by
  // how much the gap is open under a force. A contact that may pull, and does not open, has its gap
  // closed: an open one is not feasible, either.
  Residual residual(double gap_at_end, double impulse) const
  {
    const double open = is_loaded(static_cast<Real>(impulse)) ? std::max(0.0, gap_at_end) : 0.0;
    const double lacking = std::max(0.0, -gap_at_end);
    return {may_pull() ? std::max(lacking, open) : lacking, open};
  }

  // Returns the set of what may be added to an impulse.
  HalfLine changes_of(Real impulse) const { return {least - impulse}; }

  // Returns the set of the same impulses in another unit and precision.
  template <typename Other> HalfLine<Other> in_units(double unit) const
  { return {static_cast<Other>(least / unit)}; }
};

}    // namespace inelastic
