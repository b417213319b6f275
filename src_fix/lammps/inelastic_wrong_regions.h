// Regions whose walls LAMMPS shows wrong (up to update 4 of 22 Jul 2025): they are refused, or
// mended by a flag of the region. RegionWalls::look mends others by its way of looking.

#ifndef INELASTIC_WRONG_REGIONS_H
#define INELASTIC_WRONG_REGIONS_H

#include "pointers.h"

#include <string>

namespace LAMMPS_NS {
class Region;
}

namespace LAMMPS_NS::Inelastic_NS {

class WrongRegions : protected Pointers {
 public:
  using Pointers::Pointers;

  // Ends with an error if LAMMPS shows walls of a region, or of one of its parts, at wrong places,
  // too late or not at all.
  void refuse(Region *region) const { refuse(region, region, false); }

  // Opens the caps without extent of cones, beside which LAMMPS shows no other wall to points
  // outside; and closes them again where the radius, a variable, has become another one.
  void open_tips(Region *region) const;

 private:
  void refuse(Region *region, const Region *used, bool turned) const;
  void refuse_joined(const Region *region, bool outside, const std::string &what) const;
  void refuse_part(Region *region, bool from_outside, const std::string &what) const;
  double size_of_box() const;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
