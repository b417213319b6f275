#include "law_contacts.h"

#include "ghost_exchange.h"

#include "atom.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using inelastic::Demand;

namespace {

// [length / time] With which the surfaces of two slots (unknowns.h) part; the prescribed motion of
// a wall is not in it.
double parting_speed(const std::vector<double> &velocity, int i, int j, const double *normal)
{
  double speed = 0.0;
  for (int d = 0; d < 3; ++d) speed += normal[d] * (velocity[3 * i + d] - velocity[3 * j + d]);
  return speed;
}

}    // namespace

const LawMemory::Entry *LawContacts::find(int i, tagint partner, const double *normal, double gap,
                                          double size) const
{
  constexpr double PARTED = 0.1;    // of the sum of radii
  // Nothing has moved since the last step when a run starts, in which the surfaces may have
  // collided from afar.
  if (step_.kick == Kick::WHOLE && gap > PARTED * size) return nullptr;
  return memory_.find(i, partner, normal);
}

void LawContacts::ask(Side &side, int i, int j, tagint partner, const double *normal,
                      bool bad_start)
{
  const inelastic::ContactProblem &problem = step_.problem;
  const double h = problem.timestep;
  const double speed_of_wall = side.wall_motion / h;
  const double speed_before = parting_speed(step_.velocity_before, i, j, normal);
  LawContact contact{};
  const double predicted_speed =
      parting_speed(problem.predicted_velocity, i, j, normal) - speed_of_wall;
  const LawMemory::Entry *const last = find(i, partner, normal, side.gap_now, side.size);
  if (last) {
    contact.known = true;
    contact.remembered = last->remembered;
    contact.last_impulse = last->impulse;
  }
  const inelastic::ContactState state = {h, side.gap_now, speed_before - speed_of_wall,
                                         predicted_speed};
  Demand &demand = contact.demand;
  demand = step_.settings.law->ask(state, contact.remembered.data());
  demand.least_impulse = std::min(0.0, demand.least_impulse + taken_before(contact));
  // The velocities at the start of a run are half way through a collision of the last step, if they
  // are those with which it ended. (Spheres of bodies turn a little.)
  constexpr double SAME = 0.05;
  if (is_repeated(contact) && last->demand.parts &&
      std::abs(speed_before - last->speed) <= SAME * last->demand.parting_speed) {
    demand.parts = true;
    demand.parting_speed = last->demand.parting_speed;
  }
  if (bad_start) demand.parts = false;
  side.asked = {demand.least_impulse, demand.parts, demand.parting_speed, predicted_speed};
  side.law_contact = static_cast<int>(step_.law_contacts.size());
  step_.law_contacts.push_back(contact);
}

// Several constraints can be one contact: planes at a curved wall.
void LawContacts::take_impulses()
{
  for (std::size_t c = 0; c < step_.sides.size(); ++c)
    if (LawContact *const contact = step_.law_contact(step_.sides[c]))
      contact->impulse += step_.problem.contacts.impulse[c];
  for (LawContact &contact : step_.law_contacts)
    contact.kept = step_.settings.law->remember(contact.impulse - taken_before(contact),
                                                contact.remembered.data());
}

// In the half kick with which a run starts velocities are at the end of the last step already; the
// next run may start with the same half kick.
LawMemory::Entry LawContacts::entry_of(std::size_t c, const LawContact &contact,
                                       tagint partner) const
{
  const inelastic::ContactProblem &problem = step_.problem;
  const int i = problem.contacts.first[c], j = problem.contacts.second[c];
  const double *const n = &problem.contacts.normal[3 * c];
  const double before = parting_speed(step_.velocity_before, i, j, n);
  const double after = parting_speed(step_.velocity, i, j, n);
  LawMemory::Entry entry;
  entry.partner = partner;
  std::copy_n(n, 3, entry.normal.begin());
  entry.demand = contact.demand;
  entry.impulse = contact.impulse / step_.kicks();
  entry.speed = step_.kick == Kick::WHOLE ? 0.5 * (before + after) : before;
  entry.remembered = contact.remembered;
  return entry;
}

// Tells whether the push out of a bad start parts the surfaces, which is no motion of a contact.
bool LawContacts::is_pushed_apart(std::size_t c) const
{
  if (!step_.bad_start) return false;
  const inelastic::ContactProblem &problem = step_.problem;
  const Side &side = step_.sides[c];
  const double speed = parting_speed(step_.motion(), problem.contacts.first[c],
                                     problem.contacts.second[c], &problem.contacts.normal[3 * c]);
  const double gap = side.gap_now - side.wall_motion + problem.timestep * speed;
  return gap > REGULAR_OVERLAP * step_.settings.tolerance;
}

// Both atoms of a contact remember it: a partner that remembers nothing is another one with the
// same ID.
void LawContacts::follow_ids(const Atom *atom, MPI_Comm world)
{
  std::vector<tagint> mine;    // the IDs then and now of each atom, one after the other
  for (int i = 0; i < atom->nlocal; ++i)
    if (memory_.number_of_entries(i) > 0) {
      mine.push_back(memory_.owner(i));
      mine.push_back(atom->tag[i]);
    }
  int ranks;
  MPI_Comm_size(world, &ranks);
  // LAMMPS's own mpi.h, of builds without MPI, takes no constants.
  int count = static_cast<int>(mine.size());
  std::vector<int> counts(ranks), offsets(ranks, 0);
  MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, world);
  for (int rank = 1; rank < ranks; ++rank) offsets[rank] = offsets[rank - 1] + counts[rank - 1];
  std::vector<tagint> all(offsets.back() + counts.back());
  MPI_Allgatherv(mine.data(), count, MPI_LMP_TAGINT, all.data(), counts.data(), offsets.data(),
                 MPI_LMP_TAGINT, world);
  std::unordered_map<tagint, tagint> id_now;
  for (std::size_t k = 0; k < all.size(); k += 2) id_now[all[k]] = all[k + 1];
  for (int i = 0; i < atom->nlocal; ++i) {
    memory_.rename_partners(i, id_now);
    memory_.set_owner(i, atom->tag[i]);
  }
}

void LawContacts::remember(const Atom *atom, GhostExchange &ranks)
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  for (int i = 0; i < step_.problem.particles; ++i) {
    memory_.forget(i);
    memory_.set_owner(i, atom->tag[i]);
  }
  int last = -1;
  for (std::size_t c = 0; c < step_.sides.size(); ++c) {
    const Side &side = step_.sides[c];
    const LawContact *const contact = step_.law_contact(side);
    // The constraints that were added later for a contact come after all first ones.
    if (!contact || side.law_contact <= last) continue;
    last = side.law_contact;
    if (!contact->kept && contact->demand.is_inelastic()) continue;
    if (is_pushed_apart(c)) continue;
    const int i = contacts.first[c], j = contacts.second[c];
    const tagint partner = side.wall != 0 ? -side.wall : atom->tag[j];
    LawMemory::Entry entry = entry_of(c, *contact, partner);
    memory_.remember(i, entry);
    if (side.wall != 0) continue;
    entry.partner = atom->tag[i];
    for (double &component : entry.normal) component = -component;
    memory_.remember(j, entry);
  }
  ranks.gather(memory_);
}
