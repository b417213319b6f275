#include "inelastic_pulled_contacts.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

double PulledContacts::gap(const Contact &contact) const
{
  const double open = std::max(0.0, contact.gap_now - step_.eps(in_eps::CLOSED));
  return std::min(open, most_closed(contact));
}

// Returns the most by which the step may close the gap of a pulled contact [length]: the accuracy's
// part of what it has to stop, or as much as the surfaces would part without contacts, which adds
// nothing to the kinetic energy.
double PulledContacts::most_closed(const Contact &contact) const
{
  return std::max(step_.settings.accuracy * contact.length_to_stop,
                  step_.problem.timestep * contact.predicted_speed);
}

long PulledContacts::follow(std::size_t c, double gap_at_end, double opening, double along)
{
  const double tolerance = step_.settings.tolerance;
  inelastic::ContactSet &contacts = step_.problem.contacts;
  Row &row = step_.rows[c];
  const Contact &contact = step_.contact_of(c);
  double gap = gap_at_end - opening;
  if (gap_at_end < -tolerance) {
    gap = std::min(gap, contact.gap_now - row.wall_motion);
    if (step_.relinearisations > MOST_ROUNDS) return 0;
  } else if (gap_at_end <= tolerance || along < LEAST_ALONG ||
             step_.relinearisations > MOST_ROUNDS / 2) {
    return 0;
  } else if (!step_.pulls(c)) {
    // A contact that pushes, and was set by the end of an earlier round, with other velocities.
    gap = std::min(gap, contact.gap_now - row.wall_motion);
    const bool was_lowered = !row.as_at_start && gap - contacts.gap[c] > step_.eps(in_eps::ALLOWED);
    if (!was_lowered || !(contacts.impulse[c] > 0.0)) return 0;
  } else if (contacts.impulse[c] > 0.0) {
    // Surfaces that approach across a gap need no pull, and no push before they touch.
    contacts.set[c] = {};
  } else {
    gap = std::min(gap, most_closed(contact) - row.wall_motion);
    if (gap <= contacts.gap[c]) return 0;
  }
  if (contacts.gap[c] == gap) return 0;
  // The whole way at once, unlike approach(): what is still open after the rounds that may close it
  // would stay so under a force.
  contacts.gap[c] = gap;
  row.as_at_start = false;
  return 1;
}
