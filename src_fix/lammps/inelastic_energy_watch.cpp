#include "inelastic_energy_watch.h"

#include "inelastic_gap_rules.h"
#include "inelastic_ghost_exchange.h"

#include "atom.h"
#include "force.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::dot;

EnergyWatch::EnergyWatch(LAMMPS *lmp, const Step &step, const GapRules &rules,
                         GhostExchange &ranks) :
    Pointers(lmp), step_(step), rules_(rules), ranks_(ranks), clusters_(lmp, step, ranks)
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

bool EnergyWatch::adds_too_much(const std::vector<double> &target)
{
  constexpr double TIMES_AS_FAST = 10.0, ROUND_OFF = 1.0e-10;
  const inelastic::ContactProblem &problem = step_.problem;
  const inelastic::ContactSet &contacts = problem.contacts;
  const double h = problem.timestep;
  added_ = 0.0;
  // n.u and n.u* of a row, without the motion of its wall [length / time].
  const auto along = [&](std::size_t c, const std::vector<double> &v) {
    const double *const n = &contacts.normal[3 * c];
    const double *const one = &v[3 * static_cast<std::size_t>(contacts.first[c])];
    const double *const other = &v[3 * static_cast<std::size_t>(contacts.second[c])];
    return dot(n, one) - dot(n, other) - step_.rows[c].wall_motion / h;
  };
  double fastest = 0.0;
  for (std::size_t c = 0; c < contacts.size(); ++c)
    if (contacts.impulse[c] > 0.0 && step_.contact_of(c).gap_now < 0.0)
      fastest = std::max(fastest, along(c, step_.velocity));
  ranks_.reduce(nullptr, 0, &fastest, 1);
  if (fastest == 0.0) return false;
  fastest = std::min(fastest, REGULAR_OVERLAP * step_.settings.tolerance / step_.regular_timestep);

  clusters_.find();
  enum { MASS, ADDED, SIZE, TARGETS, BY_LAW, SUMS };
  std::vector<double> sums(SUMS * clusters_.size(), 0.0), gives(clusters_.size(), 0.0);
  for (int i = 0; i < atom->nlocal; ++i)
    if (step_.in_group(atom, i) && clusters_.of(i) != Clusters::NONE)
      sums[SUMS * static_cast<std::size_t>(clusters_.of(i)) + MASS] += mass_of(atom, i);
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const double impulse = contacts.impulse[c];
    const int one = clusters_.of(contacts.first[c]), other = clusters_.of(contacts.second[c]);
    if (impulse == 0.0 || std::max(one, other) == Clusters::NONE) continue;
    const auto k = static_cast<std::size_t>(std::max(one, other));
    const double after = along(c, step_.velocity);
    const double before = along(c, problem.predicted_velocity);
    const double added = 0.5 * impulse * (after + before);
    double *const s = &sums[SUMS * k];
    s[ADDED] += added;
    s[SIZE] += 0.5 * std::abs(impulse) * (std::abs(after) + std::abs(before));
    const Contact &contact = step_.contact_of(c);
    const Row &row = step_.rows[c];
    const double turns = row.as_at_start
        ? 0.0
        : contact.gap_now - rules_.wanted_gap(contact) - row.wall_motion - contacts.gap[c];
    s[TARGETS] += std::abs(impulse) * (target[c] + std::max(0.0, turns)) / h;
    if (contact.asked.parts || contact.asked.set.may_pull()) s[BY_LAW] += std::max(0.0, added);
    if (impulse > 0.0 && contact.gap_now < 0.0 && after > 0.0) gives[k] = 1.0;
  }
  clusters_.over_ranks(SUMS, sums, 1, gives);
  times_too_much_ = 0.0;
  for (std::size_t k = 0; k < clusters_.size(); ++k) {
    const double *const s = &sums[SUMS * k];
    const double added = s[ADDED] - s[BY_LAW];
    added_ = std::max(added_, added);
    const double speed = TIMES_AS_FAST * fastest;
    const double most = 0.5 * s[MASS] * speed * speed + s[TARGETS] + ROUND_OFF * s[SIZE];
    if (gives[k] > 0.0 && added > most) times_too_much_ = std::max(times_too_much_, added / most);
  }
  double maxima[2] = {times_too_much_, added_};
  ranks_.reduce(nullptr, 0, maxima, 2);
  times_too_much_ = maxima[0];
  added_ = maxima[1];
  return times_too_much_ > 0.0;
}

void EnergyWatch::end_step()
{
  most_ = std::max(most_, added_);
  added_ = 0.0;
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
