#include "pair_constraints.h"

#include "contact_memory.h"
#include "entangled_bodies.h"
#include "gap_rules.h"
#include "law_contacts.h"
#include "rigid_motion.h"

#include "atom.h"
#include "force.h"
#include "neigh_list.h"

#include "fmt/format.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using inelastic::dot;
using inelastic::norm;

namespace {

// Pairs whose gap at the end of the step is smaller than this part of the largest radius are looked at in every
// round of the step. (With a fifth of it spheres that are shaken move too far for it in most steps.)
constexpr double NEAR = 1.0;

// Tells whether the distance at the end of the step, linearised, |a| + h a.o / |a|, is more than `reach` > 0,
// for a = `away` and o = `opening`, the relative velocity. It takes no root for pairs of the list.
bool ends_beyond(double reach, const double *away, double h, const double *opening)
{
  const double square = dot(away, away);
  const double end = square + h * dot(away, opening);
  return end > 0.0 && end * end > reach * reach * square;
}

}    // namespace

PairConstraints::PairConstraints(LAMMPS *lmp, Step &step, GapRules &rules, LawContacts &laws,
                                 const EntangledBodies &entangled, const ContactMemory &memory,
                                 const RigidMotion *bodies) :
    Pointers(lmp), step_(step), rules_(rules), laws_(laws), entangled_(entangled), memory_(memory),
    bodies_(bodies)
{
}

template <typename Visitor> void PairConstraints::for_each_listed(Visitor &&visit) const
{
  const int *const mask = atom->mask;
  const tagint *const tag = atom->tag;
  const int nlocal = atom->nlocal;
  const int group_bit = step_.settings.group_bit;
  const std::vector<int> &body = step_.problem.bodies.body;
  std::size_t slot = 0;
  for (int ii = 0; ii < list_->inum; ++ii) {
    const int i = list_->ilist[ii];
    const int *const neighbours = list_->firstneigh[i];
    const int count = list_->numneigh[i];
    if (!(mask[i] & group_bit)) {
      slot += count;
      continue;
    }
    for (int jj = 0; jj < count; ++jj, ++slot) {
      const int j = neighbours[jj] & NEIGHMASK;
      if (!(mask[j] & group_bit)) continue;
      // Without newton a pair across ranks is on both lists: one of them takes it.
      if (j >= nlocal && !force->newton_pair && tag[i] > tag[j]) continue;
      if (bodies_ && body[i] >= 0 && body[i] == body[j]) continue;
      visit(slot, i, j);
    }
  }
}

void PairConstraints::collect(double margin)
{
  const double *const *const x = atom->x;
  const double *const radius = atom->radius;
  const double h = step_.problem.timestep;
  const double *const velocity = step_.problem.predicted_velocity.data();

  // The motion of bodies that turn is not known before the step is solved.
  scanned_ = bodies_ == nullptr;
  near_pairs_.clear();
  if (scanned_) velocity_at_scan_ = step_.problem.predicted_velocity;
  const double widest = std::max(margin, NEAR * step_.largest_radius);
  const bool has_law = laws_.has_law();
  std::size_t slots = 0;
  for (int ii = 0; ii < list_->inum; ++ii) slots += list_->numneigh[list_->ilist[ii]];
  taken_.assign(slots, 0);

  for_each_listed([&](std::size_t slot, int i, int j) {
    const double away[3] = {x[i][0] - x[j][0], x[i][1] - x[j][1], x[i][2] - x[j][2]};
    const double opening[3] = {velocity[3 * i] - velocity[3 * j],
                               velocity[3 * i + 1] - velocity[3 * j + 1],
                               velocity[3 * i + 2] - velocity[3 * j + 2]};
    const double touching = radius[i] + radius[j];
    const double reach = touching + margin;
    if (dot(away, away) > reach * reach && !(has_law && is_remembered(i, j, away))) {
      if (ends_beyond(touching + widest, away, h, opening)) return;
      if (ends_beyond(reach, away, h, opening)) {
        if (scanned_) near_pairs_.push_back({slot, i, j});
        return;
      }
    }
    take(slot, i, j);
  });
}

void PairConstraints::take(std::size_t slot, int i, int j)
{
  inelastic::ContactProblem &problem = step_.problem;
  const double *const xi = atom->x[i];
  const double *const xj = atom->x[j];
  taken_[slot] = 1;
  if (problem.inverse_mass[i] + problem.inverse_mass[j] == 0.0) return;
  const double away[3] = {xi[0] - xj[0], xi[1] - xj[1], xi[2] - xj[2]};
  const double distance = norm(away);
  const double size = atom->radius[i] + atom->radius[j];
  if (!(distance > COINCIDENT * size)) {
    step_.problem_found = fmt::format("the centres of atoms {} and {} coincide: move one of them",
                                      atom->tag[i], atom->tag[j]);
    return;
  }
  const double normal[3] = {away[0] / distance, away[1] / distance, away[2] / distance};
  const double gap = distance - size;
  rules_.overlaps().note(gap, i, atom->tag[j]);
  if (bodies_ && (bodies_->is_incomplete(i) || bodies_->is_incomplete(j))) {
    step_.problem_found =
        fmt::format("atoms {} and {} meet where a rank does not see all of their bodies: "
                    "raise comm_modify cutoff",
                    atom->tag[i], atom->tag[j]);
    return;
  }
  if (atom->tag[i] == atom->tag[j]) {
    if (rules_.overlaps().is_bad(gap))
      step_.problem_found = fmt::format(
          "atom {} overlaps its own periodic image: the box is too small", atom->tag[i]);
    return;
  }
  Side side = {0, gap, size, 0.0};
  if (laws_.has_law()) laws_.ask(side, i, j, atom->tag[j], normal, rules_.overlaps().is_bad(gap));
  rules_.rest(side, memory_.find(i, atom->tag[j]), i, j, normal);
  problem.contacts.add(i, j, normal, rules_.asked_gap(side), step_.impulse_per_force * side.force,
                       side.compliance, step_.least_impulse(side));
  step_.sides.push_back(side);
}

// A pair that the contact law remembers is in the problem even if it is farther apart than others in it.
bool PairConstraints::is_remembered(int i, int j, const double *away) const
{
  const double distance = norm(away);
  const double normal[3] = {away[0] / distance, away[1] / distance, away[2] / distance};
  const double size = atom->radius[i] + atom->radius[j];
  return laws_.remembers(i, atom->tag[j], normal, distance - size, size);
}

double PairConstraints::gap_at_end(int i, int j, double *away) const
{
  const double h = step_.problem.timestep;
  const std::vector<double> &moved = step_.motion();
  for (int d = 0; d < 3; ++d)
    away[d] = atom->x[i][d] - atom->x[j][d] + h * (moved[3 * i + d] - moved[3 * j + d]);
  return norm(away) - atom->radius[i] - atom->radius[j];
}

long PairConstraints::add_violated()
{
  const double *const *const x = atom->x;
  const double *const radius = atom->radius;
  const double h = step_.problem.timestep;
  const std::vector<double> &velocity = step_.velocity;
  const double *const moved = step_.motion().data();
  auto square_at_end = [&](int i, int j) {
    double away[3];
    for (int d = 0; d < 3; ++d)
      away[d] = x[i][d] - x[j][d] + h * (moved[3 * i + d] - moved[3 * j + d]);
    return dot(away, away);
  };
  auto stays_apart = [&](int i, int j, double distance) {
    const double away[3] = {x[i][0] - x[j][0], x[i][1] - x[j][1], x[i][2] - x[j][2]};
    const double opening[3] = {velocity[3 * i] - velocity[3 * j],
                               velocity[3 * i + 1] - velocity[3 * j + 1],
                               velocity[3 * i + 2] - velocity[3 * j + 2]};
    return ends_beyond(distance, away, h, opening) &&
        !(bodies_ && square_at_end(i, j) < distance * distance);
  };
  const std::size_t before = step_.problem.contacts.size();
  auto look_at = [&](std::size_t slot, int i, int j) {
    const double touching = radius[i] + radius[j] - step_.settings.tolerance;
    if (!stays_apart(i, j, touching) && !entangled_.contains(i, j)) take(slot, i, j);
  };
  const double near = NEAR * step_.largest_radius;
  if (scanned_ && 2.0 * h * change_since_scan() < near) {
    for (const NearPair &pair : near_pairs_)
      if (!taken_[pair.slot]) look_at(pair.slot, pair.first, pair.second);
  } else {
    near_pairs_.clear();
    for_each_listed([&](std::size_t slot, int i, int j) {
      if (taken_[slot] || stays_apart(i, j, radius[i] + radius[j] + near)) return;
      near_pairs_.push_back({slot, i, j});
      look_at(slot, i, j);
    });
    scanned_ = true;
    velocity_at_scan_ = velocity;
    if (bodies_) motion_at_scan_ = step_.motion();
  }
  return static_cast<long>(step_.problem.contacts.size() - before);
}

// The largest change of a velocity, or of the motion of a turning body, since all pairs were scanned.
double PairConstraints::change_since_scan() const
{
  auto largest = [](const std::vector<double> &a, const std::vector<double> &b) {
    double most = 0.0;
    for (std::size_t k = 0; k < a.size(); k += 3) {
      const double change[3] = {a[k] - b[k], a[k + 1] - b[k + 1], a[k + 2] - b[k + 2]};
      most = std::max(most, dot(change, change));
    }
    return std::sqrt(most);
  };
  const double change = largest(step_.velocity, velocity_at_scan_);
  return bodies_ ? std::max(change, largest(step_.motion(), motion_at_scan_)) : change;
}

long PairConstraints::relinearise()
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  const std::vector<double> &velocity = step_.velocity;
  double away[3];
  auto opening = [&](std::size_t c) {
    const double *const n = &contacts.normal[3 * c];
    double speed = 0.0;
    for (int d = 0; d < 3; ++d)
      speed += n[d] * (velocity[3 * contacts.first[c] + d] - velocity[3 * contacts.second[c] + d]);
    return step_.problem.timestep * speed;
  };
  auto relinearised_gap = [&](std::size_t c, double gap) {
    const double along =
        std::max(GapRules::LEAST_ALONG, dot(&contacts.normal[3 * c], away) / norm(away));
    const Side &side = step_.sides[c];
    const double lacking = gap - rules_.wanted_gap(side);
    return (lacking < 0.0 ? lacking / along : lacking) - opening(c);
  };

  const bool may_change = step_.relinearisations <= GapRules::MAX_RELINEARISATIONS;
  long changed = 0;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const Side &side = step_.sides[c];
    const int i = contacts.first[c], j = contacts.second[c];
    const bool may_hold = step_.may_hold(c);
    if (side.wall != 0 || !(may_hold || step_.is_member(i) || step_.is_member(j))) continue;
    if (entangled_.contains(i, j)) continue;
    const double gap = gap_at_end(i, j, away);
    const bool too_deep = rules_.ends_too_deep(side, gap);
    if (may_hold && step_.phase == Phase::CONTACT && !rules_.overlaps().is_bad(side.gap_now)) {
      const double along = dot(&contacts.normal[3 * c], away) / norm(away);
      changed += rules_.hold(c, gap, opening(c), along);
      continue;
    }
    if (!(step_.is_member(i) || step_.is_member(j))) continue;
    if ((too_deep || side.followed) && may_change)
      changed += rules_.follow(c, relinearised_gap(c, gap), too_deep);
  }
  return changed;
}
