// LAMMPS regions as walls.

#ifndef INELASTIC_REGION_WALLS_H
#define INELASTIC_REGION_WALLS_H

#include "inelastic_walls.h"
#include "inelastic_wrong_regions.h"

#include "pointers.h"
#include "region.h"

#include <string>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class RegionWalls final : public Walls, protected Pointers {
 public:
  RegionWalls(class LAMMPS *lmp, std::vector<std::string> region_ids);

  // Errors: a region that does not exist, or one of which LAMMPS shows walls wrong.
  void init() override;

  int number_of_walls() const override { return number_of_walls_; }
  void warn() const override;
  bool any_moves() const override;
  bool exact() const override { return exact_; }

  // Collective: moving regions have variables.
  void view(const Viewpoints &viewpoints, bool inexact_only, const Found &found,
            const Outside &outside) override;
  void view_moving_now(const Viewpoints &viewpoints, const Found &found) override;

 private:
  struct Obstacle {
    Region *region;
    int first_wall;
    bool moving;
    bool exact;
    bool convex;
    bool joined;
    bool cone;
  };

  using Contact = Region::Contact;
  using Contacts = std::vector<Contact>;

  void look(Region *region, const double *x, double reach, Contacts &found) const;
  void look_at_parts(Region *joined, const double *x, double reach, Contacts &found) const;
  void correct_cap(Region *cone, const double *x, Contact &cap) const;
  bool see(const Obstacle &, const double *where, double reach, std::vector<WallView> &);

  void view_static(const Obstacle &, const Viewpoints &, const Found &, const Outside &);
  void view_moving(const Obstacle &, const Viewpoints &, const Found &, const Outside &);
  void set_clock(const Obstacle &, int steps_ahead);

  WrongRegions wrong_;
  std::vector<std::string> ids_;
  std::vector<Obstacle> obstacles_;
  Contacts seen_;    // in one look, kept to spare its memory
  int number_of_walls_ = 0;
  bool exact_ = true;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
