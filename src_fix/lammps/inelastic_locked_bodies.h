// Bodies of a random start that hang in one another: rings as the links of a chain, a grain in a
// cage. They need not overlap, and no push out of an overlap takes them apart.
//
// Two bodies are locked if there is no straight line along which one of them could leave the other
// for good without that any two of their spheres overlap, or overlap more than now. (Walls and
// other bodies do not count.) Hooks that only a turn sets free count as locked, too.

#ifndef INELASTIC_LOCKED_BODIES_H
#define INELASTIC_LOCKED_BODIES_H

#include "inelastic_step.h"

#include "pointers.h"

#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class LockedBodies : protected Pointers {
 public:
  LockedBodies(class LAMMPS *lmp, const Step &step);

  // The spheres of two locked bodies that are nearest to one another. The first is this rank's.
  struct Pair {
    int first, second;
  };

  // Finds the pairs of bodies, or of a body and a free sphere, that are locked and whose nearest
  // spheres are this rank's business.
  void find();
  void clear() { pairs_.clear(); }
  const std::vector<Pair> &pairs() const { return pairs_; }

 private:
  // A body, or a free sphere.
  struct Grain {
    double centre[3], reach;    // [length] from the centre to the farthest surface
    std::vector<int> spheres;
  };

  std::vector<Grain> grains() const;
  void look_at(const Grain &one, const Grain &other);

  const Step &step_;
  std::vector<Pair> pairs_;
  std::vector<double> away_, radii_;    // of all pairs of spheres of two grains: room for look_at
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
