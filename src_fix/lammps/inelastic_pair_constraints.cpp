#include "inelastic_pair_constraints.h"

#include "inelastic_contact_rows.h"
#include "inelastic_entangled_bodies.h"
#include "inelastic_gap_rules.h"
#include "inelastic_mover.h"

#include "atom.h"
#include "force.h"
#include "neigh_list.h"

#include "fmt/format.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::dot;
using inelastic::norm;

namespace {

// A particle may move farther in a round than was allowed for by half of this part of the largest
// radius, before the list is searched again. (With a fifth of it spheres that are shaken do so in
// most steps.)
constexpr double NEAR = 1.0;

// A coordinate in single precision is off by at most this part of it; so are sums of a few.
constexpr float SINGLE = 4.0f * std::numeric_limits<float>::epsilon();

// Tells whether the distance at the end of the step, linearised, |a| + h a.o / |a|, is more than
// `reach` > 0, for a = `away` and o = `opening`, the relative velocity. It takes no root for pairs
// of the list.
bool ends_beyond(double reach, const double *away, double h, const double *opening)
{
  const double square = dot(away, away);
  const double end = square + h * dot(away, opening);
  return end > 0.0 && end * end > reach * reach * square;
}

}    // namespace

PairConstraints::PairConstraints(LAMMPS *lmp, Step &step, GapRules &rules, ContactRows &rows,
                                 const EntangledBodies &entangled, const Movers &movers) :
    Pointers(lmp), step_(step), rules_(rules), rows_(rows), entangled_(entangled), movers_(movers)
{
}

// Takes into account where a particle is, and how far it goes in the step with this velocity.
void PairConstraints::note_motion(const std::vector<double> &velocity)
{
  const double h = step_.problem.timestep;
  for (std::size_t i = 0; i < motion_.size(); ++i)
    motion_[i] = std::max(motion_[i], h * norm(&velocity[3 * i]));
}

// Two particles whose distance is above the sum of their ranges can neither touch at the end of the
// step nor be nearer than `widest_`, though they may move by half of `widest_` more than was known.
// The ranges are in single precision so that a particle takes 16 bytes: the search is bound by the
// memory.
void PairConstraints::search_list()
{
  const double *const *const x = atom->x;
  const std::size_t particles = motion_.size();
  ranges_.resize(particles);
  allowed_.resize(particles);
  for (std::size_t i = 0; i < particles; ++i) {
    allowed_[i] = motion_[i] + 0.5 * widest_;
    const double off = std::max({std::abs(x[i][0]), std::abs(x[i][1]), std::abs(x[i][2])});
    const double range =
        atom->radius[i] + allowed_[i] + SINGLE * (off + atom->radius[i] + allowed_[i]);
    for (int d = 0; d < 3; ++d) ranges_[i].centre[d] = static_cast<float>(x[i][d]);
    ranges_[i].range = static_cast<float>(range);
  }

  const int *const mask = atom->mask;
  const tagint *const tag = atom->tag;
  const int nlocal = atom->nlocal;
  const int group_bit = step_.settings.group_bit;
  const std::vector<int> &body = step_.problem.bodies.body;
  const bool may_pull = rows_.may_pull();
  candidates_.clear();
  std::size_t first_slot = 0;
  for (int ii = 0; ii < list_->inum; ++ii) {
    const int i = list_->ilist[ii];
    const int *const neighbours = list_->firstneigh[i];
    const int count = list_->numneigh[i];
    const std::size_t slot = first_slot;
    first_slot += count;
    if (!(mask[i] & group_bit)) continue;
    if (row_.size() < static_cast<std::size_t>(count)) row_.resize(count);
    const Range own = ranges_[i];
    int found = 0;
    for (int jj = 0; jj < count; ++jj) {
      const int j = neighbours[jj] & NEIGHMASK;
      const Range &other = ranges_[j];
      const float away[3] = {own.centre[0] - other.centre[0], own.centre[1] - other.centre[1],
                             own.centre[2] - other.centre[2]};
      const float reach = own.range + other.range;
      const float square = away[0] * away[0] + away[1] * away[1] + away[2] * away[2];
      row_[found] = jj;
      // What is not a number is not beyond the reach.
      found += !(square > reach * reach) || (may_pull && is_remembered(i, j));
    }
    for (int k = 0; k < found; ++k) {
      const int j = neighbours[row_[k]] & NEIGHMASK;
      if (!(mask[j] & group_bit)) continue;
      // Without newton a pair across ranks is on both lists: one of them takes it.
      if (j >= nlocal && !force->newton_pair && tag[i] > tag[j]) continue;
      if (movers_.any_turns() && body[i] >= 0 && body[i] == body[j]) continue;
      candidates_.push_back({slot + row_[k], i, j});
    }
  }
}

void PairConstraints::collect(double margin)
{
  const double *const *const x = atom->x;
  const double *const radius = atom->radius;
  const double h = step_.problem.timestep;
  const std::vector<double> &predicted = step_.problem.predicted_velocity;
  const double *const velocity = predicted.data();
  const bool may_pull = rows_.may_pull();
  std::size_t slots = 0;
  for (int ii = 0; ii < list_->inum; ++ii) slots += list_->numneigh[list_->ilist[ii]];
  taken_.assign(slots, 0);

  widest_ = std::max(margin, NEAR * step_.largest_radius);
  motion_.assign(step_.problem.particles, 0.0);
  note_motion(predicted);
  search_list();
  for (const Candidate &pair : candidates_) {
    const int i = pair.first, j = pair.second;
    const double away[3] = {x[i][0] - x[j][0], x[i][1] - x[j][1], x[i][2] - x[j][2]};
    const double opening[3] = {velocity[3 * i] - velocity[3 * j],
                               velocity[3 * i + 1] - velocity[3 * j + 1],
                               velocity[3 * i + 2] - velocity[3 * j + 2]};
    const double reach = radius[i] + radius[j] + margin;
    if (dot(away, away) > reach * reach && ends_beyond(reach, away, h, opening) &&
        !(may_pull && is_remembered(i, j)))
      continue;
    take(pair.slot, i, j);
  }
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
  if (movers_.any_turns() && (movers_.is_incomplete(i) || movers_.is_incomplete(j))) {
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
  rows_.add({atom->tag[j], gap, size}, 0.0, i, j, normal);
}

// A pair of which something is remembered is in the problem even if it is farther apart than others
// in it.
bool PairConstraints::is_remembered(int i, int j) const
{
  const double *const xi = atom->x[i];
  const double *const xj = atom->x[j];
  const double away[3] = {xi[0] - xj[0], xi[1] - xj[1], xi[2] - xj[2]};
  const double distance = norm(away);
  const double normal[3] = {away[0] / distance, away[1] / distance, away[2] / distance};
  const double size = atom->radius[i] + atom->radius[j];
  return rows_.remembers(i, atom->tag[j], normal, distance - size, size);
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
        !(movers_.any_turns() && square_at_end(i, j) < distance * distance);
  };
  const std::size_t before = step_.problem.contacts.size();
  note_motion(velocity);
  if (movers_.any_turns()) note_motion(step_.motion());
  if (!std::equal(motion_.begin(), motion_.end(), allowed_.begin(), std::less_equal<>()))
    search_list();
  for (const Candidate &pair : candidates_) {
    if (taken_[pair.slot]) continue;
    const int i = pair.first, j = pair.second;
    const double touching = radius[i] + radius[j] - step_.settings.tolerance;
    if (!stays_apart(i, j, touching) && !entangled_.contains(i, j)) take(pair.slot, i, j);
  }
  return static_cast<long>(step_.problem.contacts.size() - before);
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
    const double lacking = gap - rules_.wanted_gap(step_.contact_of(c));
    return (lacking < 0.0 ? lacking / along : lacking) - opening(c);
  };

  const bool may_change = step_.relinearisations <= GapRules::MAX_RELINEARISATIONS;
  long changed = 0;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const Contact &contact = step_.contact_of(c);
    const int i = contacts.first[c], j = contacts.second[c];
    const bool may_pull = step_.may_pull(c);
    if (contact.is_with_wall() || !(may_pull || step_.is_member(i) || step_.is_member(j))) continue;
    if (entangled_.contains(i, j)) continue;
    const double gap = gap_at_end(i, j, away);
    rules_.note_end(contact, gap);
    const bool too_deep = rules_.ends_too_deep(contact, gap);
    // A push leaves pulled pairs as they are, unless it turns a pair back: the gap that was set to
    // make room for its turning would then be an overlap.
    const bool follows = step_.phase == Phase::CONTACT || gap < -step_.settings.tolerance;
    if (may_pull && follows && !rules_.overlaps().is_bad(contact.gap_now)) {
      const double along = dot(&contacts.normal[3 * c], away) / norm(away);
      changed += rules_.pulled().follow(c, gap, opening(c), along);
      continue;
    }
    if (!(step_.is_member(i) || step_.is_member(j))) continue;
    if ((too_deep || step_.rows[c].followed) && may_change)
      changed += rules_.follow(c, relinearised_gap(c, gap), too_deep);
  }
  return changed;
}
