#include "inelastic_wall_constraints.h"

#include "inelastic_gap_rules.h"
#include "inelastic_ghost_exchange.h"

#include "atom.h"

#include "fmt/format.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::dot;
using inelastic::norm;

namespace {

// [radians] The end of a body that turns further says little about the wall that it has met.
constexpr double HALF_A_TURN = 3.14;

bool is_image(const Viewpoint &from)
{ return from.image[0] != 0.0 || from.image[1] != 0.0 || from.image[2] != 0.0; }

}    // namespace

WallConstraints::WallConstraints(LAMMPS *lmp, Step &step, GapRules &rules, ContactRows &rows,
                                 Walls &walls, GhostExchange &ranks, const Movers &movers) :
    Pointers(lmp), step_(step), rules_(rules), rows_(rows), walls_(walls), ranks_(ranks),
    movers_(movers), periods_(lmp)
{
}

// [length] By how much contacts and loads may bring a wall nearer in the step.
double WallConstraints::travel_of_walls(const double *velocity) const
{
  double fastest = 0.0;
  for (int slot = step_.problem.particles; slot < step_.problem.slots(); ++slot)
    fastest = std::max(fastest, norm(velocity + 3 * static_cast<std::size_t>(slot)));
  return step_.problem.timestep * fastest;
}

// Points from which to look at the walls from where atoms are, as far as the step takes them.
const WallConstraints::Viewpoints &WallConstraints::viewpoints(const double *velocity,
                                                               double beyond)
{
  viewpoints_.clear();
  const double h = step_.problem.timestep;
  // A wall that moves away from a sphere that it holds may be far at the end of the step.
  const bool may_be_far = rows_.may_pull() && walls_.any_moves();
  const double anywhere = periods_.widest();
  const double nearer = beyond + travel_of_walls(velocity);
  for (int i = 0; i < atom->nlocal; ++i) {
    if (step_.problem.inverse_mass[i] == 0.0) continue;
    const double *const x = atom->x[i];
    const double near = atom->radius[i] + nearer + h * norm(velocity + 3 * i);
    const double reach = may_be_far && rows_.remembers_wall(i) ? std::max(near, anywhere) : near;
    if (reach >= clear_of_walls_[i]) viewpoints_.push_back({i, {x[0], x[1], x[2]}, reach});
  }
  return viewpoints_;
}

// Moves a point beyond a periodic boundary to the other side. Tells whether it was beyond one.
// (LAMMPS shows the walls of a region only at that side of the boundary where they are.)
bool WallConstraints::wrap(Viewpoint &from) const
{ return periods_.wrap(from.where, from.image); }

// Points where the step takes those atoms for which the constraint of a wall may be inexact. A
// constraint that was set by an earlier look is set again wherever its wall is now.
const WallConstraints::Viewpoints &WallConstraints::viewpoints_at_end(double margin)
{
  const std::vector<double> &moved = step_.motion();
  viewpoints_.clear();
  const double h = step_.problem.timestep;
  const double nearer = travel_of_walls(step_.velocity.data());
  std::unordered_set<int> followed;
  for (std::size_t c = 0; c < step_.rows.size(); ++c) {
    const int i = step_.problem.contacts.first[c];
    const bool follows = step_.rows[c].followed || step_.may_pull(c);
    if (!step_.contact_of(c).is_with_wall() || !follows) continue;
    if (!step_.is_member(i) || movers_.angle_turned(step_.problem, i) < HALF_A_TURN)
      followed.insert(i);
  }
  for (int i = 0; i < atom->nlocal; ++i) {
    if (step_.problem.inverse_mass[i] == 0.0) continue;
    const double *const x = atom->x[i];
    const double *const v = &moved[3 * i];
    const double reach = followed.count(i)
        ? EXTREME
        : atom->radius[i] + nearer + (movers_.any_turns() ? margin : 0.0);
    Viewpoint end = {i, {x[0] + h * v[0], x[1] + h * v[1], x[2] + h * v[2]}, reach};
    const bool may_differ = !walls_.exact() || step_.is_member(i) || followed.count(i) != 0;
    if (may_differ && reach + h * norm(v) >= clear_of_walls_[i]) viewpoints_.push_back(end);
    if (wrap(end)) viewpoints_.push_back(end);
  }
  return viewpoints_;
}

// [length] By how much these velocities open the gap of an atom and a wall in the step, beside the
// motion of the wall that is prescribed.
double WallConstraints::opening_of(int i, int wall, const double *normal,
                                   const double *velocity) const
{
  const double *const v = velocity + 3 * i;
  const double *const of_wall = velocity + 3 * step_.problem.slot_of_wall(wall - 1);
  const double relative[3] = {v[0] - of_wall[0], v[1] - of_wall[1], v[2] - of_wall[2]};
  return step_.problem.timestep * dot(normal, relative);
}

// [length] The gap at the end of the step of an atom that is seen from there, with the motion that
// contacts give the wall.
double WallConstraints::gap_at_end(const WallView &view, int i) const
{
  const double *const of_wall = &step_.velocity[3 * step_.problem.slot_of_wall(view.surface - 1)];
  return view.distance - atom->radius[i] - step_.problem.timestep * dot(view.normal, of_wall);
}

void WallConstraints::collect(double margin)
{
  constraint_.clear();
  if (walls_.empty()) return;
  const double *const velocity = step_.problem.predicted_velocity.data();
  // A first look that goes further than needed spares most atoms all other looks of this step. (Not
  // where parts of a region hide others.)
  const double further = walls_.exact() ? 2.0 * step_.largest_radius : 0.0;
  clear_of_walls_.assign(atom->nlocal, 0.0);
  const Viewpoints &far = viewpoints(velocity, margin + further);
  if (walls_.exact())
    for (const Viewpoint &from : far) clear_of_walls_[from.atom] = from.reach;
  walls_.view(
      far, false,
      [&](const Viewpoint &from, const WallView &view) {
        clear_of_walls_[from.atom] = 0.0;
        const double gap = view.distance - atom->radius[from.atom];
        const double gap_now = view.distance_now - atom->radius[from.atom];
        rules_.overlaps().note(gap_now, from.atom, -view.surface);
        const double opening = opening_of(from.atom, view.surface, view.normal, velocity);
        if (gap + std::min(0.0, opening) <= margin ||
            rows_.remembers(from.atom, -view.surface, view.normal, gap_now,
                            atom->radius[from.atom]))
          take(from, view);
      },
      [&](const Viewpoint &from, const std::string &region) {
        step_.problem_found = fmt::format("the centre of atom {} is on the wrong side of region {}",
                                          atom->tag[from.atom], region);
      });
  note_overlaps_with_moving_walls();
}

// A wall that moves away is out of reach at the end of the step, and may be overlapped now.
void WallConstraints::note_overlaps_with_moving_walls()
{
  for (Viewpoint &from : viewpoints_) from.reach = atom->radius[from.atom];
  walls_.view_moving_now(viewpoints_, [&](const Viewpoint &from, const WallView &view) {
    rules_.overlaps().note(view.distance - from.reach, from.atom, -view.surface);
  });
}

void WallConstraints::take(const Viewpoint &from, const WallView &view)
{
  const int i = from.atom;
  const double motion = view.distance_now - view.distance;
  constraint_[key(i, view.piece)] = step_.problem.contacts.size();
  rows_.add(contact_with(i, view.surface, view.distance_now - atom->radius[i]), motion, i,
            step_.problem.slot_of_wall(view.surface - 1), view.normal);
}

// A contact of an atom with a wall that is at this gap now [length].
Contact WallConstraints::contact_with(int i, int wall, double gap_now) const
{ return {-wall, gap_now, atom->radius[i]}; }

long WallConstraints::add_violated()
{
  if (walls_.empty()) return 0;
  const double *const velocity = step_.velocity.data();
  const std::size_t before = step_.problem.contacts.size();
  walls_.view(
      viewpoints(velocity, 0.0), false,
      [&](const Viewpoint &from, const WallView &view) {
        const double gap = view.distance - atom->radius[from.atom];
        const double opening = opening_of(from.atom, view.surface, view.normal, velocity);
        if (gap + opening < -step_.settings.tolerance &&
            !constraint_.count(key(from.atom, view.piece)))
          take(from, view);
      },
      [](const Viewpoint &, const std::string &) {
      });
  return static_cast<long>(step_.problem.contacts.size() - before);
}

bool WallConstraints::is_same_plane(std::size_t c, const double *normal) const
{ return is_same_normal(&step_.problem.contacts.normal[3 * c], normal); }

long WallConstraints::add_plane(const Viewpoint &from, const WallView &view, bool too_deep)
{
  if (step_.relinearisations > GapRules::MAX_RELINEARISATIONS) return 0;
  const int i = from.atom;
  const double h = step_.problem.timestep;
  const auto existing = constraint_.find(key(i, view.piece));
  const bool known = existing != constraint_.end();
  const double *const n = view.normal;
  const double *const x = atom->x[i];
  double from_here[3];
  for (int d = 0; d < 3; ++d) from_here[d] = from.where[d] + from.image[d] - x[d];
  const double gap_there = gap_at_end(view, i);
  // Of the wall where it is prescribed to be: the row adds what contacts make of it.
  const double gap_here = view.distance - atom->radius[i] - dot(n, from_here);
  const double wall_motion = view.distance_now - view.distance;
  // A region can show a wall late: from inside one part of a union the others are not seen. An
  // obstacle that is overlapped is seen; its plane at the end of the step may lie beyond where the
  // sphere is now; and that of a wall that turns, or curves and moves, is not where it is now: bad
  // overlaps with such walls are known from note_overlaps_with_moving_walls().
  const double to_plane = gap_here + wall_motion;
  const bool is_beyond =
      to_plane < 0.0 && (view.convex || (view.moves && rules_.overlaps().is_bad(to_plane)));
  Contact unseen = contact_with(i, view.surface, is_beyond ? 0.0 : to_plane);
  const Contact &contact = known ? step_.contact_of(existing->second) : unseen;
  rules_.overlaps().note(contact.gap_now, i, -view.surface);
  // With `turning` the gap is exact for this motion, also where a body turns.
  const double turning = step_.is_member(i)
      ? h * (dot(n, &step_.motion()[3 * i]) - dot(n, &step_.velocity[3 * i]))
      : 0.0;
  const double gap = gap_here + turning - rules_.wanted_gap(contact);
  if (known && is_same_plane(existing->second, n))
    return rules_.follow(existing->second, gap, too_deep);
  if (!too_deep) return 0;
  // A sphere that passes an obstacle behind a periodic boundary in one step sees its far side,
  // where a plane would push the sphere on: no plane is added, and the step is too long.
  if (is_image(from) && view.convex && to_plane < -step_.settings.tolerance) {
    step_.excess = std::max(step_.excess, -gap_there);
    return 0;
  }
  if (known) rules_.stop_following_pulled(existing->second);
  const int place = known ? step_.rows[existing->second].contact
                          : rows_.add_late(unseen, wall_motion, i, n);
  constraint_[key(i, view.piece)] = step_.problem.contacts.size();
  rows_.add_plane({place, wall_motion, false, step_.is_member(i)}, i, n, gap);
  return 1;
}

long WallConstraints::relinearise(double margin)
{
  long changed = 0;
  Viewpoints beyond;
  std::unordered_set<std::size_t> seen;
  walls_.view(
      viewpoints_at_end(margin), only_inexact(),
      [&](const Viewpoint &from, const WallView &view) {
        const auto existing = constraint_.find(key(from.atom, view.piece));
        const bool known = existing != constraint_.end();
        if (known) seen.insert(existing->second);
        const Contact contact = known ? step_.contact_of(existing->second)
                                      : contact_with(from.atom, view.surface, 0.0);
        const double gap = gap_at_end(view, from.atom);
        // The walls behind a periodic boundary are as exact as others.
        const bool exact = is_image(from) && walls_.exact() && !step_.is_member(from.atom);
        rules_.note_end(contact, gap);
        const bool too_deep = rules_.ends_too_deep(contact, gap) ||
            (exact && gap < std::min(contact.gap_now, -step_.settings.tolerance));
        if (known && may_pull(existing->second, view.normal))
          changed += follow_pulled(existing->second, gap, view.normal);
        else if (too_deep || (known && step_.rows[existing->second].followed))
          changed += add_plane(from, view, too_deep);
      },
      [&](const Viewpoint &from, const std::string &) {
        beyond.push_back(from);
      });
  if (movers_.any_turns()) changed += follow_unseen(seen, beyond);
  return changed + add_planes_within(beyond);
}

// Tells whether a constraint is that of a contact that may pull, not in a bad start, and
// where the wall at the end of the step does not face another way.
bool WallConstraints::may_pull(std::size_t c, const double *normal_at_end) const
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  return step_.may_pull(c) && step_.phase == Phase::CONTACT &&
      !rules_.overlaps().is_bad(step_.contact_of(c).gap_now) &&
      dot(&contacts.normal[3 * c], normal_at_end) >= GapRules::LEAST_ALONG;
}

long WallConstraints::follow_pulled(std::size_t c, double gap_at_end, const double *normal_at_end)
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  const double *const normal = &contacts.normal[3 * c];
  const double opening =
      opening_of(contacts.first[c], step_.contact_of(c).wall(), normal, step_.velocity.data());
  return rules_.pulled().follow(c, gap_at_end, opening, dot(normal, normal_at_end));
}

// Sets constraints again whose walls are not seen from where a body ends (a part of an intersection
// of regions may hide them): the plane tells how far the wall is.
long WallConstraints::follow_unseen(const std::unordered_set<std::size_t> &seen,
                                    const Viewpoints &beyond)
{
  std::unordered_set<int> skipped;
  for (const Viewpoint &from : beyond) skipped.insert(from.atom);
  long changed = 0;
  for (const auto &[atom_and_wall, c] : constraint_) {
    const Row &row = step_.rows[c];
    const int i = step_.problem.contacts.first[c];
    if (!row.followed || seen.count(c) || skipped.count(i) ||
        movers_.angle_turned(step_.problem, i) >= HALF_A_TURN)
      continue;
    const double *const n = &step_.problem.contacts.normal[3 * c];
    const double turning =
        step_.problem.timestep * (dot(n, &step_.motion()[3 * i]) - dot(n, &step_.velocity[3 * i]));
    const double linear_gap = rules_.effective_gap(step_.contact_of(c)) - row.wall_motion;
    changed += rules_.follow(c, linear_gap + turning, false);
  }
  return changed;
}

// Adds planes for spheres that end beyond a wall, from where nothing is seen: those of the last
// place from which the wall is seen. Collective.
long WallConstraints::add_planes_within(const Viewpoints &beyond)
{
  double number_beyond = static_cast<double>(beyond.size());
  ranks_.reduce(&number_beyond, 1, nullptr, 0);
  if (!(number_beyond > 0.0)) return 0;
  for (const Viewpoint &from : beyond)
    step_.excess = std::max(step_.excess, atom->radius[from.atom]);
  long changed = 0;
  walls_.view(
      last_inside(beyond), only_inexact(),
      [&](const Viewpoint &from, const WallView &view) {
        changed += add_plane(from, view, !is_kept_by_plane(from, view));
      },
      [](const Viewpoint &, const std::string &) {
      });
  return changed;
}

// Tells whether a sphere has the plane of this wall already and, along it, does not end too deep.
// To set it anew would only take back what the round has changed of its gap.
bool WallConstraints::is_kept_by_plane(const Viewpoint &from, const WallView &view) const
{
  const int i = from.atom;
  const auto existing = constraint_.find(key(i, view.piece));
  if (existing == constraint_.end() || step_.is_member(i) ||
      !is_same_plane(existing->second, view.normal))
    return false;
  double to_end[3];    // from the viewpoint
  for (int d = 0; d < 3; ++d)
    to_end[d] = atom->x[i][d] + step_.problem.timestep * step_.velocity[3 * i + d] - from.where[d] -
        from.image[d];
  return !rules_.ends_too_deep(step_.contact_of(existing->second),
                               gap_at_end(view, i) + dot(view.normal, to_end));
}

// Finds by bisection how far along the step each of these centres is still inside. Collective.
WallConstraints::Viewpoints WallConstraints::last_inside(const Viewpoints &beyond)
{
  constexpr int BISECTIONS = 12;
  // Parts of the step.
  std::vector<double> inside(beyond.size(), 0.0), outside(beyond.size(), 1.0);
  auto viewpoints_at = [&](const std::vector<double> &part) {
    Viewpoints points = beyond;
    for (std::size_t k = 0; k < beyond.size(); ++k)
      for (int d = 0; d < 3; ++d)
        points[k].where[d] += (part[k] - 1.0) *
            (beyond[k].where[d] + beyond[k].image[d] - atom->x[beyond[k].atom][d]);
    return points;
  };
  for (int bisection = 0; bisection < BISECTIONS; ++bisection) {
    std::vector<double> middle(beyond.size());
    for (std::size_t k = 0; k < beyond.size(); ++k) middle[k] = 0.5 * (inside[k] + outside[k]);
    const Viewpoints points = viewpoints_at(middle);
    std::vector<char> out(beyond.size(), 0);
    walls_.view(
        points, only_inexact(),
        [](const Viewpoint &, const WallView &) {
        },
        [&](const Viewpoint &from, const std::string &) {
          out[&from - points.data()] = 1;
        });
    for (std::size_t k = 0; k < beyond.size(); ++k) (out[k] ? outside : inside)[k] = middle[k];
  }
  return viewpoints_at(inside);
}
