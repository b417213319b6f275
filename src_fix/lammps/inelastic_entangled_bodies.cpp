#include "inelastic_entangled_bodies.h"

#include "inelastic_contact_rows.h"
#include "inelastic_overlap_watch.h"

#include "atom.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::norm;

EntangledBodies::EntangledBodies(LAMMPS *lmp, Step &step, ContactRows &rows,
                                 OverlapWatch &overlaps) :
    Pointers(lmp), step_(step), rows_(rows), overlaps_(overlaps), locked_(lmp, step)
{
}

std::uint64_t EntangledBodies::pair(int i, int j) const
{
  const inelastic::RigidBodies &bodies = step_.problem.bodies;
  auto number = [&bodies](int k) {
    const int body = bodies.body[k];
    return static_cast<std::uint32_t>(body < 0 ? bodies.size() + k : body);
  };
  const std::uint64_t a = number(i), b = number(j);
  return std::min(a, b) << 32 | std::max(a, b);
}

void EntangledBodies::begin_step()
{
  pairs_.clear();
  locked_.clear();
  if (!step_.settings.unlock || !is_start_) return;
  locked_.find();
  for (const LockedBodies::Pair &locked : locked_.pairs())
    overlaps_.note(-PUSH_LIMIT * (atom->radius[locked.first] + atom->radius[locked.second]),
                   locked.first, atom->tag[locked.second]);
}

void EntangledBodies::find()
{
  pairs_.clear();
  for (const LockedBodies::Pair &locked : locked_.pairs())
    pairs_.insert(pair(locked.first, locked.second));
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const Contact &contact = step_.contact_of(c);
    const int i = contacts.first[c], j = contacts.second[c];
    if (!contact.is_with_wall() && (step_.is_member(i) || step_.is_member(j)) &&
        contact.gap_now < -PUSH_LIMIT * contact.size)
      pairs_.insert(pair(i, j));
  }
  for (const LockedBodies::Pair &locked : locked_.pairs()) {
    const int i = locked.first, j = locked.second;
    const double size = atom->radius[i] + atom->radius[j];
    // Along the line between the centres, which disentangle() sets.
    const double any[3] = {1.0, 0.0, 0.0};
    rows_.add({atom->tag[j], -PUSH_LIMIT * size, size}, 0.0, i, j, any);
  }
}

void EntangledBodies::disentangle()
{
  constexpr double NEVER = 1.0e3;    // of the sum of radii, a gap that no step closes
  inelastic::ContactSet &contacts = step_.problem.contacts;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const Contact &contact = step_.contact_of(c);
    const int i = contacts.first[c], j = contacts.second[c];
    if (contact.is_with_wall() || !contains(i, j)) continue;
    if (!overlaps_.is_bad(contact.gap_now)) {
      contacts.gap[c] = NEVER * contact.size;
      continue;
    }
    double apart[3];
    for (int d = 0; d < 3; ++d)
      apart[d] = atom->x[i][d] - step_.arm(i)[d] - atom->x[j][d] + step_.arm(j)[d];
    const double distance = norm(apart);
    if (distance > COINCIDENT * contact.size)
      for (int d = 0; d < 3; ++d) contacts.normal[3 * c + d] = apart[d] / distance;
  }
}
