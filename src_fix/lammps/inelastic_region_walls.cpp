#include "inelastic_region_walls.h"

#include "comm.h"
#include "domain.h"
#include "error.h"
#include "modify.h"
#include "region.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

// Off an axis, in units of the reach: far above round-off, and so little that the distance changes
// by the part along the normal alone.
constexpr double OFF_AXIS[3] = {1.0e-12, 0.7e-12, 0.4e-12};
constexpr double EVERYTHING = 1.0e300;    // a reach that no wall exceeds

// LAMMPS marks a union of parts that rotate as rotating itself, by an angle and about a point that
// it never sets.
void let_only_parts_move(Region *region)
{
  if (!region->reglist) return;
  region->moveflag = region->rotateflag = 0;
  for (int k = 0; k < region->nregion; ++k) let_only_parts_move(region->reglist[k]);
}

WallView make_view(const Region::Contact &contact, int first_wall)
{
  WallView view{};
  view.surface = view.piece = first_wall + contact.iwall;
  view.distance = view.distance_now = contact.r;
  // Near a curved wall the distance is a small difference, with more round-off than the vector.
  const double length = std::sqrt(contact.delx * contact.delx + contact.dely * contact.dely +
                                  contact.delz * contact.delz);
  const double inverse = length > 0.0 ? 1.0 / length : 0.0;
  view.normal[0] = contact.delx * inverse;
  view.normal[1] = contact.dely * inverse;
  view.normal[2] = contact.delz * inverse;
  return view;
}

}    // namespace

RegionWalls::RegionWalls(LAMMPS *lmp, std::vector<std::string> region_ids) :
    Pointers(lmp), wrong_(lmp), ids_(std::move(region_ids))
{
}

void RegionWalls::init()
{
  obstacles_.clear();
  number_of_walls_ = 0;
  exact_ = true;
  for (const std::string &id : ids_) {
    Region *region = domain->get_region_by_id(id);
    if (!region)
      error->all(FLERR,
                 "Fix inelastic: region {} does not exist: the words behind the keyword region are "
                 "IDs of regions, up to "
                 "the next keyword",
                 id);
    const bool moving = region->dynamic_check() != 0;
    const bool flat = strcmp(region->style, "block") == 0 || strcmp(region->style, "plane") == 0 ||
        strcmp(region->style, "prism") == 0;
    // The distance to a convex obstacle (side out) is a convex function, like the one to a flat
    // wall. Motion changes nothing: walls are taken where they stand at the end of the step.
    const bool convex_obstacle =
        !region->interior && !region->openflag && strcmp(region->style, "intersect") != 0;
    const bool exact = (flat && !region->openflag) || convex_obstacle;
    wrong_.refuse(region);
    const bool joined = region->reglist != nullptr;
    let_only_parts_move(region);
    // Cones can also be parts of joined regions.
    const bool cone = joined || strcmp(region->style, "cone") == 0;
    obstacles_.push_back(
        {region, number_of_walls_ + 1, moving, exact, convex_obstacle, joined, cone});
    number_of_walls_ += region->cmax;
    exact_ = exact_ && exact;
  }
}

bool RegionWalls::any_moves() const
{
  return std::any_of(obstacles_.begin(), obstacles_.end(), [](const Obstacle &obstacle) {
    return obstacle.moving;
  });
}

void RegionWalls::warn() const
{
  for (const Obstacle &obstacle : obstacles_)
    if (strcmp(obstacle.region->style, obstacle.region->interior ? "union" : "intersect") == 0 &&
        comm->me == 0)
      error->warning(FLERR,
                     "Fix inelastic: LAMMPS shows the walls of region {} only to spheres whose "
                     "centre is in the "
                     "same part of it: spheres can overlap the re-entrant edges where parts of "
                     "this union meet",
                     obstacle.region->id);
}

void RegionWalls::view(const Viewpoints &viewpoints, bool inexact_only, const Found &found,
                       const Outside &outside)
{
  for (const Obstacle &obstacle : obstacles_) {
    if (inexact_only && obstacle.exact) continue;
    if (obstacle.moving)
      view_moving(obstacle, viewpoints, found, outside);
    else
      view_static(obstacle, viewpoints, found, outside);
  }
}

// Finds the walls of a region that LAMMPS shows from a point, within reach of it. To points outside
// a cone whose radius is a variable it shows nothing beyond the largest radius at first and the
// reach: it is given a longer one.
void RegionWalls::look(Region *region, const double *x, double reach, Contacts &found) const
{
  found.clear();
  if (region->reglist) {
    look_at_parts(region, x, reach, found);
    return;
  }
  const bool cone = strcmp(region->style, "cone") == 0;
  const int count =
      region->surface(x[0], x[1], x[2], cone && region->varshape ? EVERYTHING : reach);
  std::copy_if(region->contact, region->contact + count, std::back_inserter(found),
               [reach](const Contact &contact) {
                 return contact.r < reach;
               });
  if (cone)
    for (Contact &contact : found) correct_cap(region, x, contact);
}

// The walls of the parts of a union or an intersection, as LAMMPS chooses and numbers them. It
// would choose by the uncorrected vectors to the caps of cones.
void RegionWalls::look_at_parts(Region *joined, const double *x, double reach,
                                Contacts &found) const
{
  const bool unite = strcmp(joined->style, "union") == 0;
  const bool outside = !joined->interior;
  Region **const parts = joined->reglist;
  const auto turn_over = [&] {
    for (int k = 0; outside && k < joined->nregion; ++k) parts[k]->interior ^= 1;
  };
  turn_over();
  Contacts of_part;
  int first_wall = 0;
  for (int k = 0; k < joined->nregion; ++k) {
    look(parts[k], x, reach, of_part);
    for (Contact &contact : of_part) {
      const double place[3] = {x[0] - contact.delx, x[1] - contact.dely, x[2] - contact.delz};
      const auto leaves = [&](Region *other) {
        if (other == parts[k]) return true;
        const bool within = other->match(place[0], place[1], place[2]) != 0;
        return unite ? !within || other->openflag : within != outside;
      };
      if (!std::all_of(parts, parts + joined->nregion, leaves)) continue;
      contact.iwall = outside ? k : first_wall + contact.iwall;
      found.push_back(contact);
    }
    first_wall += parts[k]->cmax;
  }
  turn_over();
}

// The walls of one region within reach of a point; empty when LAMMPS shows none. False when the
// point lies on a wall or beyond it.
bool RegionWalls::see(const Obstacle &obstacle, const double *where, double reach,
                      std::vector<WallView> &views)
{
  Region *region = obstacle.region;
  // From a point exactly on its axis LAMMPS does not see the side of a cone or a cylinder, nor from
  // outside anything of a cone (a division by zero).
  const double off = !obstacle.exact || obstacle.cone ? std::min(reach, 1.0) : 0.0;
  double x[3];
  for (int d = 0; d < 3; ++d) x[d] = where[d] + off * OFF_AXIS[d];
  views.clear();
  look(region, x, reach, seen_);
  for (const Contact &contact : seen_) {
    if (!(contact.r > 0.0)) return false;
    WallView view = make_view(contact, obstacle.first_wall);
    view.convex = obstacle.convex;
    view.moves = obstacle.moving;
    // Looks of different reach, at the end of a step and at the start of the next, see the same.
    for (int d = 0; d < 3; ++d) view.distance -= view.normal[d] * (x[d] - where[d]);
    view.distance_now = view.distance;
    views.push_back(view);
  }
  // Beyond the wall of one part of an intersection LAMMPS may still show another one's.
  return (!seen_.empty() && !obstacle.joined) || region->match(x[0], x[1], x[2]) != 0;
}

// LAMMPS points the vector to the caps of a cone along y in the wrong direction (update 4 of 22 Jul
// 2025), though their distance is right. A vector is right if the wall is half as far from half
// way; otherwise it is the gradient of the distance, which is linear for a cap.
void RegionWalls::correct_cap(Region *cone, const double *x, Contact &cap) const
{
  constexpr double PROBE = 1.0e-3;            // of the distance: stays on the same side of the wall
  constexpr double SAME_DISTANCE = 1.0e-6;    // relative; round-off is far below
  if (!(cap.r > 0.0)) return;
  auto distance_from = [&](const double *point) {
    const double reach = cone->varshape ? EVERYTHING : 2.0 * cap.r;
    const int count = cone->surface(point[0], point[1], point[2], reach);
    for (int k = 0; k < count; ++k)
      if (cone->contact[k].iwall == cap.iwall) return cone->contact[k].r;
    return -1.0;
  };
  const double half_way[3] = {x[0] - 0.5 * cap.delx, x[1] - 0.5 * cap.dely, x[2] - 0.5 * cap.delz};
  if (std::abs(distance_from(half_way) - 0.5 * cap.r) < SAME_DISTANCE * cap.r) return;

  double gradient[3];
  double length_squared = 0.0;
  for (int d = 0; d < 3; ++d) {
    double step = PROBE * cap.r;
    double point[3] = {x[0], x[1], x[2]};
    point[d] += step;
    double there = distance_from(point);
    if (there < 0.0) {    // beyond another wall, from where this one is not seen
      step = -step;
      point[d] = x[d] + step;
      there = distance_from(point);
    }
    gradient[d] = (there - cap.r) / step;
    length_squared += gradient[d] * gradient[d];
  }
  const double scale = cap.r / std::sqrt(length_squared);
  cap.delx = scale * gradient[0];
  cap.dely = scale * gradient[1];
  cap.delz = scale * gradient[2];
}

void RegionWalls::view_static(const Obstacle &obstacle, const Viewpoints &viewpoints,
                              const Found &found, const Outside &outside)
{
  std::vector<WallView> views;
  for (const Viewpoint &from : viewpoints) {
    if (see(obstacle, from.where, from.reach, views))
      for (const WallView &view : views) found(from, view);
    else
      outside(from, obstacle.region->id);
  }
}

void RegionWalls::view_moving_now(const Viewpoints &viewpoints, const Found &found)
{
  std::vector<WallView> views;
  for (const Obstacle &obstacle : obstacles_) {
    if (!obstacle.moving) continue;
    set_clock(obstacle, 0);
    for (const Viewpoint &from : viewpoints) {
      see(obstacle, from.where, from.reach, views);
      for (const WallView &view : views) found(from, view);
    }
  }
}

// Variables that move a region are evaluated for the end of the step by setting LAMMPS's clock
// ahead.
void RegionWalls::set_clock(const Obstacle &obstacle, int steps_ahead)
{
  modify->clearstep_compute();
  update->ntimestep += steps_ahead;
  obstacle.region->prematch();
  update->ntimestep -= steps_ahead;
  if (obstacle.cone && obstacle.region->varshape) wrong_.open_tips(obstacle.region);
  modify->addstep_compute(update->ntimestep + 1);
}

void RegionWalls::view_moving(const Obstacle &obstacle, const Viewpoints &viewpoints,
                              const Found &found, const Outside &outside)
{
  Region *region = obstacle.region;

  set_clock(obstacle, 0);
  const double now[3] = {region->dx, region->dy, region->dz};
  set_clock(obstacle, 1);
  const double shift[3] = {region->dx - now[0], region->dy - now[1], region->dz - now[2]};
  const double shift_length =
      std::sqrt(shift[0] * shift[0] + shift[1] * shift[1] + shift[2] * shift[2]);

  struct Seen {
    const Viewpoint *from;
    WallView view;
    bool passed_over;
  };
  std::vector<Seen> seen;
  std::vector<WallView> views;
  for (const Viewpoint &from : viewpoints) {
    if (see(obstacle, from.where, from.reach, views))
      for (const WallView &view : views) seen.push_back({&from, view, false});
    else
      seen.push_back({&from, WallView{}, true});
  }

  set_clock(obstacle, 0);
  const bool only_translates = !region->rotateflag && !region->varshape && !obstacle.joined;
  for (Seen &entry : seen) {
    const double *x = entry.from->where;
    if (entry.passed_over) {
      // The wall will have swept over the centre. LAMMPS then sees no wall, but for one that only
      // translates the distance it will have follows from the one it has now. (Of the parts of a
      // union or an intersection each may move in its own way.)
      const bool seen_now =
          only_translates && see(obstacle, x, entry.from->reach + shift_length, views);
      for (WallView &view : views) {
        if (!seen_now) break;
        for (int d = 0; d < 3; ++d) view.distance -= view.normal[d] * shift[d];
        if (view.distance < entry.from->reach) found(*entry.from, view);
      }
      if (!seen_now) outside(*entry.from, region->id);
      continue;
    }
    // A wall that moves away is not seen yet where the sphere will be behind it as it is now.
    if (only_translates)
      for (int d = 0; d < 3; ++d) entry.view.distance_now += entry.view.normal[d] * shift[d];
    look(region, x, EVERYTHING, seen_);
    for (const Contact &contact : seen_)
      if (obstacle.first_wall + contact.iwall == entry.view.piece)
        entry.view.distance_now = contact.r;
    found(*entry.from, entry.view);
  }
}
