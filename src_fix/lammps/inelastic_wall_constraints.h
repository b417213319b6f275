// The constraints between spheres and walls: which walls are in the problem, from the start or
// because a solution would let a sphere overlap them, and how curved walls and turning bodies
// change their gaps.

#ifndef INELASTIC_WALL_CONSTRAINTS_H
#define INELASTIC_WALL_CONSTRAINTS_H

#include "inelastic_contact_rows.h"
#include "inelastic_mover.h"
#include "inelastic_periods.h"
#include "inelastic_step.h"
#include "inelastic_walls.h"

#include "pointers.h"

#include <cstdint>
#include <unordered_map>
#include <unordered_set>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class GapRules;
class GhostExchange;

class WallConstraints : protected Pointers {
 public:
  WallConstraints(class LAMMPS *lmp, Step &step, GapRules &rules, ContactRows &rows, Walls &walls,
                  GhostExchange &ranks, const Movers &movers);

  // Tells whether the end of a step must be looked at: bodies turn, walls curve, spheres may cross
  // a periodic boundary, or contacts may pull spheres to an obstacle, about which they turn.
  bool need_relinearising() const { return !walls_.empty() && !(walls_.exact() && only_inexact()); }

  // Takes the walls that come nearer than `margin` [length] with the predicted velocities.
  void collect(double margin);

  // Takes more walls, those that are overlapped by more than the tolerance at the end of the step.
  // Returns how many.
  long add_violated();

  // Adds tangent planes, or moves them. Inside a concave wall the distance is not convex: where a
  // sphere ends up overlapping, the wall's tangent plane at that end is added. The planes from
  // before stay: all of them bound the container from outside, and at the tip of a cone a sphere
  // rests on several. Returns how many constraints were added or changed. Collective.
  long relinearise(double margin);

 private:
  using Viewpoints = Walls::Viewpoints;

  std::uint64_t key(int i, int piece) const
  { return static_cast<std::uint64_t>(i) * (walls_.number_of_walls() + 1) + piece; }

  // Tells whether a look at the end of a step may leave out the walls whose constraints are exact.
  bool only_inexact() const { return !movers_.any_turns() && !periods_.any() && !rows_.may_pull(); }
  bool wrap(Viewpoint &) const;
  void note_overlaps_with_moving_walls();
  void take(const Viewpoint &, const WallView &);
  Contact contact_with(int i, int wall, double gap_now) const;
  const Viewpoints &viewpoints(const double *velocity, double beyond);
  const Viewpoints &viewpoints_at_end(double margin);
  Viewpoints last_inside(const Viewpoints &beyond);
  double opening_of(int i, int wall, const double *normal, const double *velocity) const;
  double gap_at_end(const WallView &view, int i) const;
  double travel_of_walls(const double *velocity) const;
  bool may_pull(std::size_t c, const double *normal_at_end) const;
  long follow_pulled(std::size_t c, double gap_at_end, const double *normal_at_end);
  long add_plane(const Viewpoint &, const WallView &, bool too_deep);
  long add_planes_within(const Viewpoints &beyond);
  long follow_unseen(const std::unordered_set<std::size_t> &seen, const Viewpoints &beyond);
  bool is_same_plane(std::size_t c, const double *normal) const;
  bool is_kept_by_plane(const Viewpoint &from, const WallView &view) const;

  Step &step_;
  GapRules &rules_;
  ContactRows &rows_;
  Walls &walls_;
  GhostExchange &ranks_;
  const Movers &movers_;
  const Periods periods_;
  std::unordered_map<std::uint64_t, std::size_t> constraint_;    // atom and piece -> the latest one
  Viewpoints viewpoints_;                                        // room for them
  std::vector<double> clear_of_walls_;    // per owned atom: no wall of this step is as near as this
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
