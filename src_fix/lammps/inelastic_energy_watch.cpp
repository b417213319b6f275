#include "inelastic_energy_watch.h"

#include "inelastic_gap_rules.h"
#include "inelastic_ghost_exchange.h"
#include "inelastic_mover.h"

#include "atom.h"
#include "force.h"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::dot;

EnergyWatch::EnergyWatch(LAMMPS *lmp, const Step &step, const GapRules &rules, GhostExchange &ranks,
                         const Movers &movers) :
    Pointers(lmp), step_(step), rules_(rules), ranks_(ranks), movers_(movers),
    clusters_(lmp, step, ranks)
{
}

bool EnergyWatch::gives_back() const
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  double any = 0.0;
  for (std::size_t c = 0; c < contacts.size(); ++c)
    if (step_.contact_of(c).gap_now < 0.0 && contacts.gap[c] + step_.rows[c].wall_motion < 0.0)
      any = 1.0;
  ranks_.reduce(nullptr, 0, &any, 1);
  return any > 0.0;
}

// n.u of a row with velocities of the step, without the motion of its wall [length / time].
double EnergyWatch::along(std::size_t c, const std::vector<double> &v) const
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  const double *const n = &contacts.normal[3 * c];
  const double *const one = &v[3 * static_cast<std::size_t>(contacts.first[c])];
  const double *const other = &v[3 * static_cast<std::size_t>(contacts.second[c])];
  return dot(n, one) - dot(n, other) - step_.rows[c].wall_motion / step_.problem.timestep;
}

// Returns the largest speed at which the step gives an overlap back, at most the regular one
// [length / time], and notes whether surfaces part. Collective.
double EnergyWatch::fastest_given_back()
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  double maxima[2] = {0.0, 0.0};
  for (std::size_t c = 0; c < contacts.size(); ++c)
    if (contacts.impulse[c] > 0.0 && step_.contact_of(c).gap_now < 0.0)
      maxima[0] = std::max(maxima[0], along(c, step_.velocity));
  // Without a law none does.
  if (!step_.law_states.empty())
    for (const Contact &contact : step_.contacts)
      if (contact.asked.parts) maxima[1] = 1.0;
  ranks_.reduce(nullptr, 0, maxima, 2);
  parts_ = parts_ || maxima[1] > 0.0;
  return std::min(maxima[0], step_.eps(in_eps::REGULAR) / step_.regular_timestep);
}

// Adds up masses, and what contacts do, cluster by cluster. Collective.
void EnergyWatch::add_up(const std::vector<double> &target)
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  const double h = step_.problem.timestep;
  clusters_.find();
  sums_.assign(SUMS * clusters_.size(), 0.0);
  does_.assign(DOES * clusters_.size(), 0.0);
  for (int i = 0; i < atom->nlocal; ++i)
    if (step_.in_group(atom, i) && clusters_.of(i) != Clusters::NONE)
      sums_[SUMS * static_cast<std::size_t>(clusters_.of(i)) + MASS] += mass_of(atom, i);
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const double impulse = contacts.impulse[c];
    const int one = clusters_.of(contacts.first[c]), other = clusters_.of(contacts.second[c]);
    if (impulse == 0.0 || std::max(one, other) == Clusters::NONE) continue;
    const auto k = static_cast<std::size_t>(std::max(one, other));
    const double after = along(c, step_.velocity);
    const double before = along(c, step_.problem.predicted_velocity);
    const double added = 0.5 * impulse * (after + before);
    const Contact &contact = step_.contact_of(c);
    double *const s = &sums_[SUMS * k];
    s[ADDED] += added;
    s[SIZE] += 0.5 * std::abs(impulse) * (std::abs(after) + std::abs(before));
    s[TARGETS] += std::abs(impulse) * target[c] / h;
    s[IMPULSES] += std::abs(impulse);
    s[TURNS] += std::abs(impulse) * rules_.closed_by_turning(c) / h;
    // A projection adds less than the sum of lambda n.u over contacts: of one that is pulled closed
    // this is what the law adds, be it to the motion of others.
    const bool pulled = contact.asked.set.may_pull();
    if (contact.asked.parts || pulled) s[BY_LAW] += std::max(0.0, pulled ? impulse * after : added);
    double &approach = does_[DOES * k + APPROACH];
    approach = std::max(approach, -before);
    if (impulse > 0.0 && contact.gap_now < 0.0 && after > 0.0) does_[DOES * k + GIVES_BACK] = 1.0;
    if (contact.asked.parts) does_[DOES * k + PARTS] = 1.0;
  }
  clusters_.over_ranks(SUMS, sums_, DOES, does_);
}

bool EnergyWatch::adds_too_much(const std::vector<double> &target)
{
  constexpr double TIMES_AS_FAST = 10.0, ROUND_OFF = 1.0e-10;
  // Of what its contacts take and give: so much is what a step of ordinary length adds in a
  // cluster where surfaces part.
  constexpr double LAW_ADDS = 0.01;
  // Of the energy of rotation of a body: a hundredth in a thousand steps.
  constexpr double TURNING_ADDS = 1.0e-5;
  added_ = times_too_much_ = 0.0;
  law_adds_ = false;
  const double given_back = fastest_given_back();
  if (given_back == 0.0 && !parts_) return false;
  // Overlaps are known to the round-off of a length alone.
  const double least_known = std::numeric_limits<double>::epsilon() * step_.largest_radius;
  const double speed = TIMES_AS_FAST * std::max(given_back, least_known / step_.problem.timestep);
  // What the accuracy leaves of a velocity that opens EPS in a regular step, of an impulse of the
  // last step that this one has no use for, say, is no sign of a network without room.
  const double least_told =
      TIMES_AS_FAST * step_.eps(step_.settings.accuracy) / step_.regular_timestep;
  add_up(target);
  double law_adds = 0.0;
  for (std::size_t k = 0; k < clusters_.size(); ++k) {
    const double *const s = &sums_[SUMS * k];
    const double *const does = &does_[DOES * k];
    const double added = s[ADDED] - s[BY_LAW];
    // What is added where surfaces part is told apart (steps_of_law).
    if (does[PARTS] == 0.0) added_ = std::max(added_, added);
    const double residuals =
        std::min(s[TARGETS],
                 std::max(step_.settings.accuracy * does[APPROACH] * s[IMPULSES],
                          0.5 * s[MASS] * least_told * least_told));
    const double least = 0.5 * s[MASS] * speed * speed + residuals + ROUND_OFF * s[SIZE];
    const double most = least + s[TURNS];
    // Where surfaces part others may gain by that, whatever is given back.
    if (does[GIVES_BACK] > 0.0 && does[PARTS] == 0.0 && added > most)
      times_too_much_ = std::max(times_too_much_, added / most);
    if (does[PARTS] > 0.0 && s[ADDED] > least + LAW_ADDS * s[SIZE]) law_adds = 1.0;
  }
  for (int i = 0; parts_ && i < atom->nlocal; ++i)
    if (step_.is_member(i) && movers_.energy_of_turning(step_.problem, i) > TURNING_ADDS)
      law_adds = 1.0;
  double maxima[3] = {times_too_much_, added_, law_adds};
  ranks_.reduce(nullptr, 0, maxima, 3);
  times_too_much_ = maxima[0];
  added_ = maxima[1];
  law_adds_ = maxima[2] > 0.0;
  return times_too_much_ > 0.0;
}

void EnergyWatch::end_step()
{
  most_ = std::max(most_, added_);
  added_ = 0.0;
  if (law_adds_) ++steps_of_law_;
  law_adds_ = false;
  if (!step_.waits) pause_ = 0;
}

double EnergyWatch::most() const
{ return most_ * force->mvv2e; }

bool EnergyWatch::waits_on()
{
  if (left_ == 0) return false;
  --left_;
  return true;
}

void EnergyWatch::note_no_room()
{
  constexpr int LONGEST = 64;
  pause_ = std::clamp(2 * pause_, 1, LONGEST);
  left_ = pause_;
}
