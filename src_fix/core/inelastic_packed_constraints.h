// The constraints of inelastic_packed_iterations.h, as a structure of arrays in packed units
// (inelastic_packed_kernels.h).

#pragma once

#include "inelastic_packed_kernels.h"
#include "inelastic_packed_targets.h"
#include "inelastic_start.h"

#include <cstddef>
#include <vector>

namespace inelastic {

template <typename Real> struct PackedConstraints {
  std::vector<std::size_t> source;    // the place in the problem
  std::vector<packed::Ends> ends;
  std::vector<packed::Vector<Real>> normal;    // the fourth number: the gap at the start
  std::vector<Real> diagonal, compliance;
  std::vector<AdmissibleSet<Real>> set;                    // of the changes since the start
  std::vector<Real> least_target, part, inverse_target;    // inelastic_packed_targets.h

  std::size_t size() const { return source.size(); }
  void resize(std::size_t count);

  // Packs the constraints of a problem that are at these places.
  void pack(const Start &start, const std::vector<std::size_t> &places);
  // Adds 1 / D of each.
  void add_inverse_diagonals(double &sum) const;
  // Copies constraint k of `other` to place `to`.
  void copy(const PackedConstraints &other, std::size_t k, std::size_t to);

  void set_targets(const PackedTargets<Real> &targets);
  // The slots of a constraint's sides.
  std::size_t first(std::size_t k) const { return packed::index<Real>(ends[k].first); }
  std::size_t second(std::size_t k) const { return packed::index<Real>(ends[k].second); }
};

}    // namespace inelastic
