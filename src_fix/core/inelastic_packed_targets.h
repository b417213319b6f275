// The targets of packed constraints (inelastic_contact_targets.h), and how far velocities are from
// those they end with: what all iterations on packed arrays have in common.
//
// Velocities are changes of velocity by the impulses since the start of a search, one vector per
// slot (inelastic_unknowns.h), lengths are in the units of Scales, and constraints are told by
// their two slots.

#pragma once

#include "inelastic_packed_kernels.h"
#include "inelastic_start.h"
#include "inelastic_target_formula.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace inelastic {

template <typename Real> class PackedTargets {
 public:
  using Vector = packed::Vector<Real>;

  // Begins a search.
  void begin(const Start &start);
  // Goes on with it from the impulses of a new start, which have moved the slots by these
  // velocities since the last one.
  void recentre(const Start &start, const std::vector<Vector> &moved);

  // Takes the velocities of which targets are a part.
  void set(const std::vector<Vector> &velocity);

  // What target() takes of each slot, and the bound of all targets.
  const std::vector<Real> &changed() const { return changed_; }
  Real most() const { return most_; }

  // Returns the target of a constraint between two slots. `least` and `part` are those of
  // ContactTargets, in packed units.
  Real target(std::size_t first, std::size_t second, Real least, Real part) const
  {
    Real bounded;
    bound_target(free_target(first, second, least, part), most_, bounded);
    return bounded;
  }
  // Returns the same without the bound by the tolerance.
  Real free_target(std::size_t first, std::size_t second, Real least, Real part) const
  {
    Real free;
    find_free_target(part * std::min(changed_[first], changed_[second]), least, free);
    return free;
  }

  // Keeps velocities; the last two that were kept can be compared with.
  void keep(const std::vector<Vector> &velocity);

  // Compares velocities with those that were kept last but one; before two were kept with those at
  // the start of the search.
  void compare(const std::vector<Vector> &velocity);

  // Returns by how much the sides of a constraint have moved since, by the last comparison. A
  // change that may be round-off does not count.
  Real moved(std::size_t first, std::size_t second) const;

 private:
  // Per slot: the change of velocity by the impulses at the start of the search, in all and since
  // the first guess of the solve
  std::vector<Vector> at_start_, since_guess_;
  std::vector<char> mobile_;
  // Per slot that can move: the change of velocity of which targets are a part
  std::vector<Real> changed_;
  std::vector<Vector> kept_, kept_before_;
  std::vector<Real> moved_;
  Real most_ = 0;
};

}    // namespace inelastic
