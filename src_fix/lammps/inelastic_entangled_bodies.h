// Bodies that are deep in one another in a bad start. They overlap at several places, whose normals
// may ask for opposite motions. Such bodies are pushed along the line between their centres
// instead, which takes them apart whatever their shapes; the other constraints between them wait
// until they are less entangled. So are bodies that hang in one another
// (inelastic_locked_bodies.h).

#ifndef INELASTIC_ENTANGLED_BODIES_H
#define INELASTIC_ENTANGLED_BODIES_H

#include "inelastic_locked_bodies.h"
#include "inelastic_step.h"

#include "pointers.h"

#include <cstdint>
#include <unordered_set>

namespace LAMMPS_NS::Inelastic_NS {

class ContactRows;
class OverlapWatch;

class EntangledBodies : protected Pointers {
 public:
  EntangledBodies(class LAMMPS *lmp, Step &step, ContactRows &rows, OverlapWatch &overlaps);

  bool empty() const { return pairs_.empty(); }

  // At the start of a step: finds locked bodies. They make a start bad, and count as overlapping by
  // as much as a push may open.
  void begin_step();

  // Before a push, in its phase: finds the entangled bodies, among the constraints of the step and
  // those that are locked, and adds the constraints that take these apart.
  void find();

  // Tells whether particles i and j belong to two entangled bodies, in the phase in which these are
  // pushed.
  bool contains(int i, int j) const
  { return step_.phase == Phase::PUSH && !pairs_.empty() && pairs_.count(pair(i, j)); }

  // Sets the normals and gaps of the constraints between such bodies.
  void disentangle();

  void end_step() { is_start_ = is_start_ && step_.bad_start; }

 private:
  // The same number for all pairs of spheres of two bodies (or of a body and a free sphere).
  std::uint64_t pair(int i, int j) const;

  Step &step_;
  ContactRows &rows_;
  OverlapWatch &overlaps_;
  LockedBodies locked_;
  std::unordered_set<std::uint64_t> pairs_;
  bool is_start_ = true;    // all steps since the fix was defined have pushed a start apart
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
