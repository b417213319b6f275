// The periods of the simulation box: which directions have one, where images of a point are, and
// how much of the box is a rank's own. Other rooms of the fix ask here; inelastic_step_length.cpp
// alone takes motions in units of the box from LAMMPS itself.

#ifndef INELASTIC_PERIODS_H
#define INELASTIC_PERIODS_H

#include "pointers.h"

#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class Periods : protected Pointers {
 public:
  explicit Periods(class LAMMPS *lmp) : Pointers(lmp) {}

  bool any() const;
  bool along(int direction) const;

  // [length] The widest direction of the box, periodic or not: nothing in it is farther apart along
  // an axis.
  double widest() const;

  // [length] The narrowest width of the box along a direction that is periodic; infinite if there
  // is none.
  double narrowest() const;

  // Moves a point (3) that is beyond a periodic boundary into the box, and sets `image` (3) to what
  // must be added to it for the place where it was. Returns whether it was beyond one; if not,
  // nothing is changed.
  bool wrap(double *where, double *image) const;

  // Replaces a vector (3) between two points by that to the nearest image of the second.
  void to_nearest_image(double *vector) const;

  // The part of the box that is this rank's own, along a direction; 1 on one rank.
  double own_part(int direction) const;

  // [length] The widths of the directions that are periodic, and the three tilts: gaps depend on
  // these alone.
  std::vector<double> lengths_and_tilts() const;

  // The bits of Fix::box_change by which a fix changes these.
  int changes() const;

 private:
  bool wrap_tilted(double *where, double *image) const;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
