#include "inelastic_gap_rules.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

using in_eps::ALLOWED;
using in_eps::CLOSED;
using in_eps::LEFT;
using in_eps::REGULAR;

// A gap beyond CLOSED closes in a step by at most this part of what the contact has to stop.
constexpr double CLOSING = 0.01;

}    // namespace

void GapRules::begin(Contact &contact, const FirstGuess &last, double wall_motion, int i, int j,
                     const double *normal) const
{
  constexpr double PART_OF_LOAD = 0.1;
  constexpr double SAME = 1.0e-9;    // round-off of forces
  contact.force = last.force;
  const auto changes = load_changes(i, j);
  // Loads of particles at rest that change by one factor change contact forces by it.
  if (changes && std::abs((*changes)[1] - (*changes)[0]) <= SAME * (*changes)[0])
    contact.force *= (*changes)[0];
  const inelastic::ContactProblem &problem = step_.problem;
  const double *const v = problem.predicted_velocity.data();
  double opening = 0.0;
  for (int d = 0; d < 3; ++d) opening += normal[d] * (v[3 * i + d] - v[3 * j + d]);
  const double load =
      step_.impulse_per_force * contact.force * problem.mobility_of_pair(i, j, normal);
  contact.length_to_stop =
      std::max({PART_OF_LOAD * load, wall_motion - problem.timestep * opening, 0.0});
  // A contact at rest is closed where it is: to close the gap would be a motion that no force
  // makes.
  contact.closed_gap =
      closed_gap(contact, last.closed_gap, changes ? 0.0 : CLOSING * contact.length_to_stop);
}

// The factors by which the loads of two particles have changed that were at rest in the last step,
// one of them twice beside a wall or a frozen particle; nothing if one was not at rest.
std::optional<std::array<double, 2>> GapRules::load_changes(int i, int j) const
{
  const inelastic::ContactProblem &problem = step_.problem;
  if (step_.load_change.empty()) return std::nullopt;
  if (problem.inverse_mass[i] == 0.0) std::swap(i, j);
  if (problem.is_wall(j) || problem.inverse_mass[j] == 0.0) j = i;
  const double one = step_.load_change[i], other = step_.load_change[j];
  if (!(one > 0.0 && other > 0.0)) return std::nullopt;
  return std::array<double, 2>{one, other};
}

// Returns the gap at which a contact counts as closed [length]. A gap under a force counts as
// closed where it is, up to half a tolerance: positions are not known better, and to correct them
// in a step would give velocities that no force makes. These add up along chains and differ from
// step to step: a bed would never be quiet. A wider gap closes, so little that the force stays.
// When the force goes, the contact is still closed at that gap until the two have parted: a sphere
// on a contact that loses its force for a step does not fall.
double GapRules::closed_gap(const Contact &contact, double last, double most_closing) const
{
  const double tolerance = step_.settings.tolerance;
  const double gap = std::max(0.0, contact.gap_now);
  if (contact.force > 0.0 && gap <= tolerance)
    return gap - std::clamp(gap - step_.eps(CLOSED), 0.0, most_closing);
  // The tolerance may have been lowered.
  const bool parted = last == Contact::NOT_CLOSED || last > tolerance || gap > last + tolerance;
  return parted ? Contact::NOT_CLOSED : std::min(gap, last);
}

// Returns the length by which a contact may close [length]. An overlap of up to half a tolerance
// counts as closed, too; a deeper one is given back little by little.
double GapRules::contact_gap(const Contact &contact) const
{
  const double gap = contact.gap_now;
  if (gap <= 0.0) return -given_back(contact);
  return gap - std::max(0.0, contact.closed_gap);
}

// Returns the part of an overlap that is given back in the step [length]. It grows smoothly: from 0
// at half a tolerance, by the accuracy's part of what the contact has to stop at 0.8 tolerances.
// The part beyond the tolerance, which turning bodies and curved walls leave, is given back at
// once: with the next step's it could become a bad start.
double GapRules::given_back(const Contact &contact) const
{
  const double beyond = -contact.gap_now - step_.eps(CLOSED);
  if (beyond <= 0.0 || step_.keeps_overlaps) return 0.0;
  const double x = beyond / step_.eps(in_eps::WHOLE - CLOSED);
  const double softly = step_.settings.accuracy * contact.length_to_stop * x * std::max(1.0, x * x);
  return std::min(
      {beyond, std::max(softly, -contact.gap_now - step_.eps(ALLOWED)), most_given_back()});
}

// Returns the most of an overlap that is given back in the step [length]: at a speed that does not
// grow where the step becomes shorter.
double GapRules::most_given_back() const
{
  if (step_.keeps_overlaps) return 0.0;
  return step_.eps(REGULAR) * step_.problem.timestep / step_.regular_timestep;
}

// Returns the gap that is wanted at the end of the step [length], or where it gives back more of an
// overlap than most_given_back() the one that does not.
double GapRules::limited(const Contact &contact, double wanted) const
{ return contact.gap_now < 0.0 ? std::min(wanted, contact.gap_now + most_given_back()) : wanted; }

double GapRules::effective_gap(const Contact &contact) const
{
  const double gap = contact.gap_now;
  if (step_.phase == Phase::CONTACT) {
    if (overlaps_.is_bad(gap)) return 0.0;
    if (contact.asked.set.may_pull())
      return gap <= 0.0 ? -given_back(contact) : pulled_.gap(contact);
    const double closed = contact_gap(contact);
    const double parted = -step_.problem.timestep * contact.asked.parting_speed;
    return contact.asked.parts ? std::min(closed, parted) : closed;
  }
  return std::max(gap, -most_pushed(contact));
}

// Returns the most by which a step pushes an overlap apart [length]: at a speed that does not grow
// where the step becomes shorter, or no step could be short enough for the neighbour list.
double GapRules::most_pushed(const Contact &contact) const
{
  const double most = std::max(PUSH_LIMIT * contact.size, step_.eps(REGULAR));
  return most * step_.problem.timestep / step_.regular_timestep;
}

double GapRules::wanted_gap(const Contact &contact) const
{
  const double wanted = contact.gap_now - effective_gap(contact);
  return overlaps_.is_bad(contact.gap_now) ? wanted
                                           : limited(contact, std::max(wanted, -step_.eps(CLOSED)));
}

// Returns the overlap that a bad one may end with [length], as a gap: one that gives way to others
// may become as deep as the deepest.
double GapRules::bad_kept(const Contact &contact) const
{ return step_.gives_way ? -step_.largest_overlap : contact.gap_now; }

void GapRules::note_end(const Contact &contact, double gap_at_end)
{
  const double allowed = overlaps_.is_bad(contact.gap_now) ? bad_kept(contact) : 0.0;
  step_.excess = std::max(step_.excess, allowed - gap_at_end - step_.eps(REGULAR));
}

bool GapRules::ends_too_deep(const Contact &contact, double gap_at_end) const
{
  double wanted = 0.0;
  if (overlaps_.is_bad(contact.gap_now))
    wanted = step_.gives_way ? bad_kept(contact) : wanted_gap(contact);
  return wanted - gap_at_end > std::min(deepest(contact, step_.eps(ALLOWED)), step_.eps(REGULAR));
}

double GapRules::closed_by_turning(std::size_t c) const
{
  const Row &row = step_.rows[c];
  const Contact &contact = step_.contact_of(c);
  const double gap = step_.problem.contacts.gap[c];
  const double linear_gap = contact.gap_now - row.wall_motion;
  // The gaps of free spheres that keep_within_tolerance() changes ask for overlaps alone.
  if (row.as_at_start || gap == linear_gap || gap == linear_gap + step_.eps(LEFT)) return 0.0;
  return std::max(0.0, linear_gap - wanted_gap(contact) - gap);
}

// Returns how deep an overlap may be at the end of the step [length] if an ordinary step allows
// `allowed`. Beside bad ones regular ones are kept: in a dense start spheres jam for a moment, and
// cannot all be taken apart at once. Where a step waits, what is deeper than allowed may stay, but
// nothing becomes so.
double GapRules::deepest(const Contact &contact, double allowed) const
{
  if (!step_.keeps_overlaps) return allowed;
  if (step_.bad_start) return std::numeric_limits<double>::infinity();
  return std::max(allowed, -contact.gap_now);
}

void GapRules::keep_within_tolerance(const std::vector<double> &velocity,
                                     inelastic::Refined &refined)
{
  inelastic::ContactSet &contacts = step_.problem.contacts;
  // Once a constraint has to change, later ones that are near the tolerance change with it: in a
  // chain each would otherwise need a round of its own.
  double allowed = step_.eps(ALLOWED);
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    Row &row = step_.rows[c];
    if (row.as_at_start && row.asks_for_gap) continue;
    const Contact &contact = step_.contact_of(c);
    const double linear_gap = contact.gap_now - row.wall_motion;
    const double lessened = linear_gap + step_.eps(LEFT);
    // Gaps that were set by the end of the step are kept there by follow().
    if (!row.as_at_start && contacts.gap[c] != lessened) continue;
    if (contacts.gap[c] == linear_gap || overlaps_.is_bad(contact.gap_now)) continue;
    if (step_.is_member(contacts.first[c]) || step_.is_member(contacts.second[c])) continue;
    const double at_end = gap_at_end(c, velocity);
    // A pulled contact is closed no faster than its gap asks for.
    const bool pulls = step_.may_pull(c) && contacts.impulse[c] < 0.0;
    const bool may_be_open = pulls || contacts.impulse[c] == 0.0 || contact.asked.parts;
    const bool stays = at_end >= -deepest(contact, allowed);
    if (stays && (at_end <= allowed || may_be_open)) continue;
    // Surfaces that part are asked for no less than that.
    if (contact.asked.parts && contacts.gap[c] <= linear_gap) continue;
    allowed = step_.eps(LEFT);
    refined.anew = refined.anew || (contacts.impulse[c] > 0.0 && contacts.set[c].may_pull());
    if (contacts.impulse[c] > 0.0) contacts.set[c] = {};
    const bool first_time = row.as_at_start && at_end < 0.0 && lessened < contacts.gap[c];
    const double before = contacts.gap[c];
    contacts.gap[c] = first_time ? lessened : linear_gap;
    row.as_at_start = false;
    refined.gaps.push_back({c, contacts.gap[c] - before});
    ++refined.number;
  }
}

// Changes the gap of constraint c towards `wanted`, for which the present velocity asks. A body may
// answer by turning the other way, so that the next round asks for the opposite, and so on without
// an end. The gap therefore takes the part of the way to where the secant through the last two
// rounds is zero, and never more than the whole. In late rounds, which only take apart what is too
// deep, it takes the whole.
void GapRules::approach(std::size_t c, double wanted)
{
  double &gap = step_.problem.contacts.gap[c];
  double part = 1.0;
  if (step_.relinearisations <= MAX_RELINEARISATIONS / 2) {
    Approach &last = step_.approaches[c];
    const double change = wanted - gap;
    if (last.change != 0.0 && change / last.change < 1.0)
      part = std::min(1.0, last.part / (1.0 - change / last.change));
    last = {change, part};
  }
  gap = part == 1.0 ? wanted : gap + part * (wanted - gap);
  step_.rows[c].as_at_start = false;
}

double GapRules::gap_at_end(std::size_t c, const std::vector<double> &velocity) const
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  const Row &row = step_.rows[c];
  const Contact &contact = step_.contact_of(c);
  const int i = contacts.first[c], j = contacts.second[c];
  double opening = 0.0;
  for (int d = 0; d < 3; ++d)
    opening += contacts.normal[3 * c + d] * (velocity[3 * i + d] - velocity[3 * j + d]);
  return contact.gap_now - row.wall_motion + step_.problem.timestep * opening;
}

void GapRules::stop_following_pulled(std::size_t c)
{
  Row &row = step_.rows[c];
  if (!step_.may_pull(c) || row.as_at_start) return;
  step_.problem.contacts.gap[c] = effective_gap(step_.contact_of(c)) - row.wall_motion;
  row.as_at_start = true;
}

long GapRules::follow(std::size_t c, double exact_gap, bool too_deep)
{
  inelastic::ContactSet &contacts = step_.problem.contacts;
  Row &row = step_.rows[c];
  const Contact &contact = step_.contact_of(c);
  const double linear_gap = effective_gap(contact) - row.wall_motion;
  double gap = std::min(exact_gap, linear_gap);
  // A contact that may keep its overlap, and with the residual still ends too deep, has to give it
  // back by that end.
  if (too_deep && gap >= contacts.gap[c] && !overlaps_.is_bad(contact.gap_now))
    gap = std::min(gap, exact_gap + std::min(wanted_gap(contact), 0.0));
  if (!too_deep) {
    const bool worth_it = contacts.impulse[c] > 0.0 && gap - contacts.gap[c] > step_.eps(ALLOWED) &&
        step_.relinearisations <= MAX_RELINEARISATIONS / 2;
    if (!worth_it) return 0;
  }
  approach(c, gap);
  row.followed = step_.is_member(contacts.first[c]) || step_.is_member(contacts.second[c]);
  return 1;
}
