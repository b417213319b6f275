#include "gap_rules.h"

#include <algorithm>

using namespace LAMMPS_NS;

namespace {

// In tolerances: a smaller overlap at the end of the step changes no constraint.
constexpr double RELINEARISE_BEYOND = 1.1;

}    // namespace

double GapRules::effective_gap(double gap_now, double size) const
{
  if (!overlaps_.is_bad(gap_now)) return gap_now;
  if (step_.phase == Phase::CONTACT) return 0.0;
  const double limit = PUSH_LIMIT * size * step_.problem.timestep / step_.regular_timestep;
  return std::max(gap_now, -std::max(limit, REGULAR_OVERLAP * step_.settings.tolerance));
}

double GapRules::wanted_gap(double gap_now, double size) const
{ return overlaps_.is_bad(gap_now) ? gap_now - effective_gap(gap_now, size) : 0.0; }

bool GapRules::ends_too_deep(double gap_now, double size, double gap_at_end)
{
  const double tolerance = step_.settings.tolerance;
  const double allowed = overlaps_.is_bad(gap_now) ? gap_now : 0.0;
  step_.excess = std::max(step_.excess, allowed - gap_at_end - REGULAR_OVERLAP * tolerance);
  return wanted_gap(gap_now, size) - gap_at_end > RELINEARISE_BEYOND * tolerance;
}

long GapRules::follow(std::size_t c, double exact_gap, bool too_deep)
{
  inelastic::ContactSet &contacts = step_.problem.contacts;
  Side &side = step_.sides[c];
  const double linear_gap = effective_gap(side.gap_now, side.size) - side.wall_motion;
  const double gap = std::min(exact_gap, linear_gap);
  if (!too_deep) {
    const bool worth_it = contacts.impulse[c] > 0.0 &&
        gap - contacts.gap[c] > RELINEARISE_BEYOND * step_.settings.tolerance &&
        step_.relinearisations <= MAX_RELINEARISATIONS / 2;
    if (!worth_it) return 0;
  }
  contacts.gap[c] = gap;
  side.followed = step_.is_member(contacts.first[c]) ||
      (side.wall == 0 && step_.is_member(contacts.second[c]));
  return 1;
}
