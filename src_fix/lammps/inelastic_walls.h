// Walls, whatever they are made of: which of them a sphere can reach in a step, and how far they
// are at the end of it. Rooms ask through this interface alone.

#ifndef INELASTIC_WALLS_H
#define INELASTIC_WALLS_H

#include <functional>
#include <string>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

// A point from which to look at the walls: `where` is the centre of atom i, or the place where it
// will be; walls whose distance is below `reach` are wanted.
struct Viewpoint {
  int atom;
  double where[3];
  double reach;
  // Add this [length] to `where` for the place itself: across a periodic boundary the walls of the
  // other side are seen, from there.
  double image[3] = {};
};

// One wall seen from the centre of one sphere.
struct WallView {
  // 1, 2, ... over all walls of the fix: memory, output and what moves go by surfaces. A sphere may
  // touch several pieces of one, such as triangles; each has its constraint. Of a region they are
  // the same.
  int surface, piece;
  // [length] from the sphere's centre to the wall as it will stand at the end of the step
  double distance;
  // unit vector from the wall to the centre, for the wall at the end of the step
  double normal[3];
  // [length] to the wall as it stands now; the difference is the wall's own motion
  double distance_now;
  bool convex;    // the side of an obstacle that curves, or has edges, away from the sphere
  bool moves;     // in a way that is prescribed
};

class Walls {
 public:
  using Viewpoints = std::vector<Viewpoint>;
  using Found = std::function<void(const Viewpoint &, const WallView &)>;
  using Outside = std::function<void(const Viewpoint &, const std::string &wall)>;

  // Finds the walls and numbers them. Errors: walls that do not exist any more, or that cannot be
  // seen right. Collective.
  virtual void init() = 0;

  virtual int number_of_walls() const = 0;
  bool empty() const { return number_of_walls() == 0; }

  // Warns of walls that cannot be shown in full.
  virtual void warn() const = 0;

  // Tells whether any wall moves in a way that is prescribed.
  virtual bool any_moves() const = 0;

  // Tells whether all walls are flat, or convex obstacles: the linearised constraint is then exact
  // or on the safe side, and no look at the end of the step is needed for free spheres.
  virtual bool exact() const = 0;

  // Calls found(viewpoint, view) for every wall within reach. outside(viewpoint, wall) is called
  // instead for a centre that lies on the wrong side of a wall, from where it is not seen.
  // `inexact_only` leaves out the walls whose constraints are exact. Collective.
  virtual void view(const Viewpoints &viewpoints, bool inexact_only, const Found &found,
                    const Outside &outside) = 0;

  // Calls `found` for every moving wall within reach where it stands now, whatever it does in the
  // step. Collective.
  virtual void view_moving_now(const Viewpoints &viewpoints, const Found &found) = 0;

 protected:
  ~Walls() = default;    // not virtual: walls are never owned through this interface
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
