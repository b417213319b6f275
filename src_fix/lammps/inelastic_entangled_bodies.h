// Bodies that are deep in one another in a bad start. They overlap at several places, whose normals
// may ask for opposite motions. Such bodies are pushed along the line between their centres
// instead, which takes them apart whatever their shapes; the other constraints between them wait
// until they are less entangled. So are bodies that hang in one another
// (inelastic_locked_bodies.h).

#ifndef INELASTIC_ENTANGLED_BODIES_H
#define INELASTIC_ENTANGLED_BODIES_H

#include "inelastic_locked_bodies.h"
#include "inelastic_step.h"

#include <cstdint>
#include <unordered_set>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class EntangledBodies {
 public:
  explicit EntangledBodies(Step &step) : step_(step) {}

  void clear() { pairs_.clear(); }
  bool empty() const { return pairs_.empty(); }

  // Finds the entangled bodies: among the constraints of the step, and those that are locked.
  void find(const std::vector<LockedBodies::Pair> &locked);

  // Tells whether particles i and j belong to two entangled bodies, in the phase in which these are
  // pushed.
  bool contains(int i, int j) const
  { return step_.phase == Phase::PUSH && !pairs_.empty() && pairs_.count(pair(i, j)); }

  // Sets the normals and gaps of the constraints between such bodies.
  void disentangle(const Atom *atom, const class OverlapWatch &overlaps);

 private:
  // The same number for all pairs of spheres of two bodies (or of a body and a free sphere).
  std::uint64_t pair(int i, int j) const;

  Step &step_;
  std::unordered_set<std::uint64_t> pairs_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
