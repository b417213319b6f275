// What the impulse of a contact may be. Solvers, kernels and residuals know it by the functions of
// its class alone, in single or double precision, and of vectors of numbers.
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

template <typename Real> class HalfLine {
 public:
  HalfLine() = default;    // pushes alone
  // The set of a contact that may pull by up to `up_to` >= 0.
  static HalfLine pulls(Real up_to) { return HalfLine(-up_to); }
  // The set whose idle impulse is this one.
  static HalfLine above(Real idle) { return HalfLine(idle); }

  // Returns the admissible impulse that is nearest to `free`.
  Real project(Real free) const { return free > least_ ? free : least_; }

  // Tells whether an impulse is one under which the gap must be closed at the end of the step.
  bool is_loaded(Real impulse) const { return impulse > least_; }

  // Tells whether a contact may pull.
  bool may_pull() const { return least_ < 0; }

  // idle() returns the impulse of a contact whose gap is open, load() by how much an impulse is
  // more than that.
  Real idle() const { return least_; }
  Real load(Real impulse) const { return impulse - least_; }

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
  HalfLine changes_of(Real impulse) const { return HalfLine(least_ - impulse); }
  // Returns the set of a contact that has pulled by so much of what it may; of changes, the set
  // that holds no change, too.
  HalfLine after(Real pulled) const { return HalfLine(std::min(Real(0), least_ + pulled)); }

  // Returns the set of the same impulses in another unit and precision.
  template <typename Other> HalfLine<Other> in_units(double unit) const
  { return HalfLine<Other>::above(static_cast<Other>(least_ / unit)); }

  // The same for vectors of numbers, of which `idle` has the idle impulses: these write the nearest
  // admissible impulses, and by how much gaps are open where contacts are loaded (-gap elsewhere).
  template <typename Vector>
  static inline __attribute__((always_inline)) void project(const Vector &free, const Vector &idle,
                                                            Vector &nearest)
  { nearest = free > idle ? free : idle; }
  template <typename Vector>
  static inline __attribute__((always_inline)) void
  find_open(const Vector &impulse, const Vector &idle, const Vector &gap, Vector &open)
  { open = impulse > idle ? gap : -gap; }

 private:
  explicit HalfLine(Real least) : least_(least) {}

  Real least_ = 0;    // l <= 0
};

// The set of today's contacts: solvers, kernels, laws and rules name this alone.
template <typename Real> using AdmissibleSet = HalfLine<Real>;

}    // namespace inelastic
