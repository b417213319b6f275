#include "gap_rules.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

namespace {

// In tolerances: a smaller overlap at the end of the step changes no constraint.
constexpr double RELINEARISE_BEYOND = 1.1;
// The gap of a contact at rest differs from zero by at most this part of the tolerance.
constexpr double ELASTIC_RANGE = 0.5;

}    // namespace

// What an overlap gives back in a step stays in the velocities: it is no more than what velocities are
// resolved to. Where a force acted, a gap of a quarter of the target counts as closed. There the constraint
// asks for more than the geometry does, which may have no room for it, but for less than the residual that
// is allowed: velocities of this step are resolved to at least half of what they were in the last one
// (FixInelastic::project).
double GapRules::contact_gap(const Side &side) const
{
  const double tolerance = step_.settings.tolerance;
  const double target = std::min(step_.resolution * step_.problem.timestep, tolerance);
  const double gap = side.gap_now;
  if (side.compliance > 0.0) return std::max(gap, -ELASTIC_RANGE * tolerance - target);
  if (gap < 0.0) return std::max(gap, -target);
  constexpr double CLOSED = 0.25;    // of a target
  return side.force > 0.0 ? std::max(0.0, gap - std::min(CLOSED * target, tolerance - target))
                          : gap;
}

double GapRules::gap_by_law(const Side &side, const LawContact &contact) const
{
  if (contact.demand.least_impulse < 0.0) return held_gap(side.gap_now, contact.predicted_speed);
  const double gap = contact_gap(side);
  return contact.demand.parts
      ? std::min(gap, -step_.problem.timestep * contact.demand.parting_speed)
      : gap;
}

double GapRules::held_gap(double gap, double predicted_speed) const
{
  const double h = step_.problem.timestep;
  const double target = std::min(step_.resolution * h, step_.settings.tolerance);
  return std::clamp(gap, -target, most_closed(predicted_speed));
}

// [length] The surfaces of a held contact are brought back to one another by no more than velocities are resolved
// to, or as fast as they would part: this adds nothing to the kinetic energy.
double GapRules::most_closed(double predicted_speed) const
{
  const double h = step_.problem.timestep;
  const double target = std::min(step_.resolution * h, step_.settings.tolerance);
  return std::max(target, h * predicted_speed);
}

void GapRules::rest(Side &side, const ContactMemory::Contact &known, int i, int j,
                    const double *normal) const
{
  // A softer contact costs fewer iterations, but its gap reaches the elastic range with a smaller change
  // of its force. With a PER_TOLERANCE of 0.6 springs slide all the time, and a bed of 1,000 spheres does
  // not come to rest; with half the elastic range it takes twice as long (measured). The other two bound
  // what springs give back when their load goes: 3 % of the change of the impulse, less in a finer run.
  constexpr double MOST_COMPLIANCE = 0.03, PER_ACCURACY = 30.0, PER_TOLERANCE = 0.3;
  const double tolerance = step_.settings.tolerance;
  constexpr double AT_REST = 0.5;    // of the force is sustained
  side.force = known.force;
  side.sustained = known.sustained;
  const bool at_rest = known.force > 0.0 && known.sustained >= AT_REST * known.force;
  if (!at_rest || !(step_.change > 0.0) || overlaps_.is_bad(side.gap_now)) return;
  const LawContact *const law = step_.law_contact(side);
  if (law && !law->demand.is_inelastic()) return;
  // The same force is half of the impulse in half a kick.
  side.compliance = step_.problem.mobility_of_pair(i, j, normal) / step_.kicks() *
      std::min({MOST_COMPLIANCE, PER_ACCURACY * step_.settings.accuracy,
                PER_TOLERANCE * tolerance / step_.change});
  const double length_per_force = side.compliance * step_.impulse_per_force;
  const double range = ELASTIC_RANGE * tolerance / length_per_force;
  const double preload = known.spring_gap == ContactMemory::NONE
      ? known.sustained + side.gap_now / length_per_force
      : known.force + known.spring_gap / length_per_force;
  side.preload = std::clamp(preload, known.sustained - range, known.sustained + range);
}

double GapRules::asked_gap(const Side &side) const
{
  const double rigid = effective_gap(side) - side.wall_motion;
  return side.compliance > 0.0 ? rigid - side.compliance * step_.impulse_per_force * side.preload
                               : rigid;
}

double GapRules::effective_gap(const Side &side) const
{
  const double gap = side.gap_now;
  if (step_.phase == Phase::CONTACT) {
    if (overlaps_.is_bad(gap)) return 0.0;
    const LawContact *const law = step_.law_contact(side);
    return law ? gap_by_law(side, *law) : contact_gap(side);
  }
  const double limit = PUSH_LIMIT * side.size * step_.problem.timestep / step_.regular_timestep;
  return std::max(gap, -std::max(limit, REGULAR_OVERLAP * step_.settings.tolerance));
}

double GapRules::wanted_gap(const Side &side) const
{
  constexpr double MOST_LEFT = 0.5;    // tolerances
  const double wanted = side.gap_now - effective_gap(side);
  return overlaps_.is_bad(side.gap_now) ? wanted
                                        : std::max(wanted, -MOST_LEFT * step_.settings.tolerance);
}

bool GapRules::ends_too_deep(const Side &side, double gap_at_end)
{
  const double tolerance = step_.settings.tolerance;
  const bool bad = overlaps_.is_bad(side.gap_now);
  const double allowed = bad ? side.gap_now : 0.0;
  step_.excess = std::max(step_.excess, allowed - gap_at_end - REGULAR_OVERLAP * tolerance);
  const double wanted = bad ? wanted_gap(side) : 0.0;
  // A spring can give way by more than the residual.
  const double beyond = side.compliance > 0.0 ? 1.0 : RELINEARISE_BEYOND;
  return wanted - gap_at_end > beyond * tolerance;
}

long GapRules::keep_within_tolerance(const std::vector<double> &velocity)
{
  inelastic::ContactSet &contacts = step_.problem.contacts;
  const double tolerance = step_.settings.tolerance;
  long changed = 0;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    Side &side = step_.sides[c];
    // Gaps that were set by the end of the step are kept there by follow().
    const double linear_gap = side.gap_now - side.wall_motion;
    const bool asks_for_all = contacts.gap[c] == linear_gap && contacts.compliance[c] == 0.0;
    if (!side.as_at_start || asks_for_all || overlaps_.is_bad(side.gap_now)) continue;
    if (step_.is_member(contacts.first[c])) continue;
    if (side.wall == 0 && step_.is_member(contacts.second[c])) continue;
    const LawContact *const law = step_.law_contact(side);
    if (law && law->demand.parts) continue;
    const double at_end = gap_at_end(c, velocity);
    // A held contact is closed no faster than its gap asks for.
    const bool holds = step_.may_hold(c) && contacts.impulse[c] < 0.0;
    const bool may_stay = holds || contacts.impulse[c] == 0.0;
    if (at_end >= -tolerance && (at_end <= tolerance || may_stay)) continue;
    if (contacts.impulse[c] > 0.0) contacts.least[c] = 0.0;
    contacts.gap[c] = linear_gap;
    contacts.compliance[c] = side.compliance = 0.0;
    side.as_at_start = false;
    ++changed;
  }
  return changed;
}

long GapRules::hold(std::size_t c, double gap_at_end, double opening, double along)
{
  const double tolerance = step_.settings.tolerance;
  inelastic::ContactSet &contacts = step_.problem.contacts;
  Side &side = step_.sides[c];
  double gap = gap_at_end - opening;
  if (gap_at_end < -tolerance) {
    gap = std::min(gap, side.gap_now - side.wall_motion);
    if (step_.relinearisations > MAX_RELINEARISATIONS) return 0;
  } else {
    if (gap_at_end <= RELINEARISE_BEYOND * tolerance || !step_.holds(c) || along < LEAST_ALONG ||
        step_.relinearisations > MAX_RELINEARISATIONS / 2)
      return 0;
    if (contacts.impulse[c] > 0.0) {
      // What approaches across a gap needs no pull, and no push before it touches.
      contacts.least[c] = 0.0;
    } else {
      gap = std::min(gap, most_closed(step_.law_contact(side)->predicted_speed) - side.wall_motion);
      if (gap <= contacts.gap[c]) return 0;
    }
  }
  if (contacts.gap[c] == gap) return 0;
  contacts.gap[c] = gap;
  side.as_at_start = false;
  return 1;
}

double GapRules::gap_at_end(std::size_t c, const std::vector<double> &velocity) const
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  const Side &side = step_.sides[c];
  const int i = contacts.first[c], j = contacts.second[c];
  double opening = 0.0;
  for (int d = 0; d < 3; ++d)
    opening += contacts.normal[3 * c + d] *
        (velocity[3 * i + d] - (side.wall != 0 ? 0.0 : velocity[3 * j + d]));
  return side.gap_now - side.wall_motion + step_.problem.timestep * opening;
}

void GapRules::make_overloaded_rigid(const std::vector<double> &velocity)
{
  constexpr double MOST_GROWTH = 2.0;    // of a spring's force in a step
  inelastic::ContactSet &contacts = step_.problem.contacts;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    Side &side = step_.sides[c];
    if (contacts.compliance[c] == 0.0) continue;
    const double before = step_.impulse_per_force * side.force;
    const bool carries_more = contacts.impulse[c] > MOST_GROWTH * before;
    if (!carries_more &&
        std::abs(gap_at_end(c, velocity)) <= ELASTIC_RANGE * step_.settings.tolerance)
      continue;
    contacts.compliance[c] = side.compliance = 0.0;
    contacts.gap[c] = asked_gap(side);
  }
}

long GapRules::follow(std::size_t c, double exact_gap, bool too_deep)
{
  inelastic::ContactSet &contacts = step_.problem.contacts;
  Side &side = step_.sides[c];
  const double linear_gap = effective_gap(side) - side.wall_motion;
  const double gap = std::min(exact_gap, linear_gap);
  if (!too_deep) {
    const double asked = contacts.gap[c] + contacts.compliance[c] * contacts.impulse[c];
    const bool worth_it = contacts.impulse[c] > 0.0 &&
        gap - asked > RELINEARISE_BEYOND * step_.settings.tolerance &&
        step_.relinearisations <= MAX_RELINEARISATIONS / 2;
    if (!worth_it) return 0;
  }
  contacts.gap[c] = gap;
  contacts.compliance[c] = side.compliance = 0.0;
  side.as_at_start = false;
  side.followed = step_.is_member(contacts.first[c]) ||
      (side.wall == 0 && step_.is_member(contacts.second[c]));
  return 1;
}
