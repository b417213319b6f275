// LAMMPS regions as obstacles: which walls a sphere can reach in a step, and how far they are at
// the end of it.

#ifndef INELASTIC_REGION_WALLS_H
#define INELASTIC_REGION_WALLS_H

#include "wrong_regions.h"

#include "pointers.h"
#include "region.h"

#include <functional>
#include <string>
#include <vector>

namespace LAMMPS_NS {

// One wall seen from the centre of one sphere.
struct WallView {
  int wall;    // 1, 2, ... over all regions of the fix
  double
      distance;    // from the sphere's centre to the wall as it will stand at the end of the step
  double
      normal[3];    // unit vector from the wall to the centre, for the wall at the end of the step
  double distance_now;    // to the wall as it stands now; the difference is the wall's own motion
  bool convex;            // the side of an obstacle that curves, or has edges, away from the sphere
};

class RegionWalls : protected Pointers {
 public:
  RegionWalls(class LAMMPS *lmp, std::vector<std::string> region_ids);

  // Finds the regions and numbers their walls. Errors: a region that does not exist, or one of
  // which LAMMPS shows walls wrong.
  void init();

  bool empty() const { return ids_.empty(); }
  bool any_moves() const;
  int number_of_walls() const { return number_of_walls_; }

  // Warns of regions that LAMMPS cannot show in full.
  void warn() const;

  // All walls flat (or convex obstacles): the linearised constraint is exact or on the safe side,
  // and no look at the end of the step is needed.
  bool exact() const { return exact_; }

  // A point from which to look at the walls: `where` is the centre of atom i, or the place where it
  // will be; walls whose distance is below `reach` are wanted.
  struct Viewpoint {
    int atom;
    double where[3];
    double reach;
    // Add this [length] to `where` for the place itself: across a periodic boundary the walls of
    // the other side are seen, from there.
    double image[3] = {};
  };

  // Calls found(viewpoint, view) for every wall within reach. outside(viewpoint, region) is called
  // instead for a centre that lies on the wrong side of a region, from where LAMMPS sees no wall.
  // `inexact_only` leaves out the regions whose constraints are exact. Collective (variables of
  // moving regions).
  void view(const std::vector<Viewpoint> &viewpoints, bool inexact_only,
            const std::function<void(const Viewpoint &, const WallView &)> &found,
            const std::function<void(const Viewpoint &, const std::string &region)> &outside);

  // Calls `found` for every wall of a moving region within reach where the wall stands now,
  // whatever it does in the step. Collective.
  void view_moving_now(const std::vector<Viewpoint> &viewpoints,
                       const std::function<void(const Viewpoint &, const WallView &)> &found);

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

  void view_static(const Obstacle &, const std::vector<Viewpoint> &,
                   const std::function<void(const Viewpoint &, const WallView &)> &,
                   const std::function<void(const Viewpoint &, const std::string &)> &);
  void view_moving(const Obstacle &, const std::vector<Viewpoint> &,
                   const std::function<void(const Viewpoint &, const WallView &)> &,
                   const std::function<void(const Viewpoint &, const std::string &)> &);
  void set_clock(const Obstacle &, int steps_ahead);

  WrongRegions wrong_;
  std::vector<std::string> ids_;
  std::vector<Obstacle> obstacles_;
  Contacts seen_;    // in one look, kept to spare its memory
  int number_of_walls_ = 0;
  bool exact_ = true;
};

}    // namespace LAMMPS_NS

#endif
