#include "inelastic_entangled_bodies.h"

#include "inelastic_overlap_watch.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::norm;

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

void EntangledBodies::find(const std::vector<LockedBodies::Pair> &locked)
{
  pairs_.clear();
  for (const LockedBodies::Pair &of : locked) pairs_.insert(pair(of.first, of.second));
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const Contact &contact = step_.contact_of(c);
    const int i = contacts.first[c], j = contacts.second[c];
    if (!contact.is_with_wall() && (step_.is_member(i) || step_.is_member(j)) &&
        contact.gap_now < -PUSH_LIMIT * contact.size)
      pairs_.insert(pair(i, j));
  }
}

void EntangledBodies::disentangle(const Atom *atom, const OverlapWatch &overlaps)
{
  constexpr double NEVER = 1.0e3;    // of the sum of radii, a gap that no step closes
  inelastic::ContactSet &contacts = step_.problem.contacts;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const Contact &contact = step_.contact_of(c);
    const int i = contacts.first[c], j = contacts.second[c];
    if (contact.is_with_wall() || !contains(i, j)) continue;
    if (!overlaps.is_bad(contact.gap_now)) {
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
