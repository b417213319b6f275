// The iterations of inelastic_gradient_search.h on packed arrays (inelastic_packed_kernels.h):
// this class packs a problem, runs the passes in the order that the exchange between ranks needs,
// and unpacks impulses.
//
// The unknown is the change of the impulses since the start of the search, not the impulses, and
// the gaps are those at the start plus what the change makes of them. Round-off is then in
// proportion to the change, and single precision can find what a heavy bed still lacks.
//
// Constraints that have no more than their least impulse and whose gaps are far from closed are
// idle: iterations leave them out until they are looked at and found to be near. The others are
// working. Each rank chooses for itself; nothing is communicated for it.
//
// Everything has units in which the largest length is near 1, so that single precision can hold it.

#pragma once

#include "inelastic_momentum.h"
#include "inelastic_packed_constraints.h"
#include "inelastic_packed_velocities.h"
#include "inelastic_search.h"

#include <array>
#include <vector>

namespace inelastic {

template <typename Real> class PackedIterations {
 public:
  // Packs a problem, whose impulses are the start. Constraints without an impulse whose gap is
  // above `idle_gap` [length] are idle.
  void prepare(const Start &start, double idle_gap);

  // Changes of velocity, and with them the targets, move most in the first iterations of a search.
  static bool sets_targets(long iteration)
  {
    return iteration == 2 || iteration == 4 || iteration == 8 || iteration == 14 ||
        iteration % TARGETS_EVERY == 0;
  }

  // Sets the targets by the present changes of velocity (inelastic_contact_targets.h). Call it
  // between finish and advance.
  void set_targets();

  // Keeps the present changes of velocity; the last two that were kept can be compared with.
  void keep_velocities();

  // Returns by how much velocities have changed since those that were kept last but one: the
  // largest change on either side of the working constraints with an impulse, in units of the
  // target divided by `accuracy`, which is above 0. Before two were kept the change is that since
  // the start of the search. A change that may be round-off does not count. Call it after finish
  // and set_targets.
  double moved_since_kept(double accuracy);

  // Begins an iteration with a step of 1 / L: the next impulses become the present ones. Returns
  // sums and maxima over this rank's constraints; those of gaps and changes are of the impulses
  // before. Residuals below `blur`, in packed units, may be round-off.
  packed::Passed advance(const Weights &weights, double step, double blur);

  // Ends an iteration: computes the changes of velocity of the present impulses. Collective. The
  // host must know which ghosts are in constraints (Host::choose_ghosts).
  void finish(Host &host) { velocities_.move(host); }

  // Makes the idle constraints working whose gaps are not above `idle_gap`, in packed units. Makes
  // the working ones idle that have no impulse and gaps above it, where they are more than a few.
  // Call it between finish and advance.
  void look(double idle_gap);

  // Makes the idle constraints working whose gaps are not above `idle_gap` by these gaps, one per
  // constraint of the problem [length].
  void join(const std::vector<double> &gap, const Scales &scales);

  // Writes the present impulses, in the order of the problem's constraints.
  void impulses(const Scales &scales, std::vector<double> &impulse) const
  { unpack(unbound_, scales, impulse); }
  // Writes the impulses that the last iteration started from: the sums and maxima that advance
  // returned are those of these impulses.
  void impulses_before(const Scales &scales, std::vector<double> &impulse) const
  { unpack(change_before_, scales, impulse); }

 private:
  static constexpr long TARGETS_EVERY = 20;

  using Vector = packed::Vector<Real>;
  void wake(const std::vector<std::size_t> &near, const Real *gap);
  void set_idle();
  void unpack(const std::vector<Real> &change, const Scales &scales,
              std::vector<double> &impulse) const;
  // Returns the arrays of numbers that iterations change, one for each working constraint.
  std::array<std::vector<Real> *, 3> states() { return {&unbound_, &change_before_, &gap_before_}; }

  PackedConstraints<Real> working_, idle_;
  PackedVelocities<Real> velocities_;
  PackedTargets<Real> targets_;
  // As in packed::Pass
  std::vector<Real> unbound_, change_before_, gap_before_;
  std::vector<double> start_;    // impulses, in the order of the problem
  std::vector<AdmissibleSet<double>>
      of_impulses_;                   // which impulses are admissible, in that order
  double step_before_ = 0.0;          // 1 / L of the last iteration
  double inverse_diagonals_ = 0.0;    // their sum over all constraints
  std::vector<Vector> looked_;        // gaps of the idle ones, four in each
  int looks_ = 0;                     // since the start of the search
  Real idle_gap_ = 0;                 // above it a constraint without an impulse is idle
};

}    // namespace inelastic
