// This room refuses what other commands and fixes of a deck must not do, because fix inelastic
// would not see it: hide spheres or pairs from it, hold spheres, or change the box or the radii
// while a run lasts.

#ifndef INELASTIC_SCENE_CHECK_H
#define INELASTIC_SCENE_CHECK_H

#include "pointers.h"

#include <string>
#include <vector>

namespace LAMMPS_NS {
class Fix;
}

namespace LAMMPS_NS::Inelastic_NS {

class SceneCheck : protected Pointers {
 public:
  explicit SceneCheck(class LAMMPS *lmp) : Pointers(lmp) {}

  struct Group {
    int bit;           // of the spheres that the fix sees
    int frozen_bit;    // of those that nothing moves; 0 = none
    bool bodies;       // the keyword rigid is given
  };

  // Errors: settings that keep spheres out of the neighbour list or ghosts away, and fixes that
  // will change the box or radii, or do not bear that the time step is shortened.
  void check(bool shorten) const;

  // At the start of a run. Errors: fixes that are to hold or guide spheres of the group that are
  // not frozen. Collective.
  void check_held(const Group &group) const;

  // At the start of a run. Warnings: settings that keep pairs apart. Collective.
  void warn_of_hidden_pairs(const Group &group) const;

  // At the start of a run. Warnings, once: computes that count contacts by overlaps, of which hard
  // spheres have few.
  void warn_of_counts();

  // Remembers the box as it is at the start of a run.
  void remember_box();

  // Says what has changed about the box since then; empty if nothing has.
  std::string change_of_box() const;

  // Tells whether a fix moves a sphere, as an integrator does.
  bool is_integrated(int i) const;

  // Names the fixes that may have changed the radius of a sphere; empty if there are none.
  std::string fixes_that_change_radii() const;

 private:
  static bool sets_forces(const Fix *fix);
  bool changes_periods(const Fix *fix) const;
  template <typename One, typename Other>
  bool hides(const Group &group, One &&on_one_side, Other &&on_the_other) const;
  void warn_of_hidden(const std::string &what) const;
  bool any(bool here) const;

  std::vector<double> box_at_start_;    // periods and tilts
  bool warned_of_counts_ = false;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
