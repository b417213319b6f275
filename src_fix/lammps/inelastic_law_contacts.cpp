#include "inelastic_law_contacts.h"

#include "inelastic_ghost_exchange.h"

#include "atom.h"

#include "fmt/format.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::Demand;

namespace {

// [length / time] With which the surfaces of two slots (inelastic_unknowns.h) part; the prescribed
// motion of a wall is not in it.
double parting_speed(const std::vector<double> &velocity, int i, int j, const double *normal)
{
  double speed = 0.0;
  for (int d = 0; d < 3; ++d) speed += normal[d] * (velocity[3 * i + d] - velocity[3 * j + d]);
  return speed;
}

}    // namespace

const LawEntry *LawContacts::find(int i, tagint partner, const double *normal, double gap,
                                  double size) const
{
  constexpr double PARTED = 0.1;    // of the sum of radii
  // In the last step surfaces may have collided from afar, and nothing has moved since when a run
  // starts: there the gap tells nothing.
  if (step_.kick == Kick::WHOLE && gap > PARTED * size) return nullptr;
  return memory_.find(i, partner, normal);
}

void LawContacts::ask(Contact &contact, double wall_motion, int i, int j, const double *normal,
                      bool bad_start)
{
  const inelastic::ContactProblem &problem = step_.problem;
  const double h = problem.timestep;
  const double speed_of_wall = wall_motion / h;
  const double speed_before = parting_speed(step_.velocity_before, i, j, normal);
  LawState state{};
  const double predicted_speed =
      parting_speed(problem.predicted_velocity, i, j, normal) - speed_of_wall;
  const LawEntry *const last = find(i, contact.partner, normal, contact.gap_now, contact.size);
  if (last) {
    state.known = true;
    state.remembered = last->remembered;
    state.last_impulse = last->impulse;
  }
  Demand &demand = contact.asked;
  demand = step_.settings.law->ask(
      seen(contact, i, j, normal, speed_before - speed_of_wall, predicted_speed),
      state.remembered.data());
  check(demand, i);
  demand.set = demand.set.after(taken_before(state));
  // The velocities at the start of a run are half way through a collision of the last step, if they
  // are those with which it ended. (Spheres of bodies turn a little.)
  constexpr double SAME = 0.05;
  if (is_repeated(state) && last->demand.parts &&
      std::abs(speed_before - last->speed) <= SAME * last->demand.parting_speed) {
    demand.parts = true;
    demand.parting_speed = last->demand.parting_speed;
  }
  if (bad_start) demand.parts = false;
  contact.predicted_speed = predicted_speed;
  step_.law_states.push_back(state);
}

// A law of a user's own may answer anything.
void LawContacts::check(const Demand &demand, int i)
{
  const bool parts = !demand.parts ||
      (demand.parting_speed >= 0.0 && std::isfinite(demand.parting_speed));
  const double least = demand.set.idle();
  if (parts && least <= 0.0 && std::isfinite(least)) return;
  step_.problem_found = fmt::format(
      "law {} asks a contact of atom {} to part with the speed {} and to carry an impulse of at "
      "least {}: a speed must be a number of at least 0, a least impulse one of at most 0",
      step_.settings.law_words, atom->tag[i], demand.parting_speed, least);
}

// The contact as the law sees it. [length / time] The speeds are those with which the surfaces
// part.
inelastic::ContactState LawContacts::seen(const Contact &contact, int i, int j,
                                          const double *normal, double speed_before,
                                          double predicted_speed) const
{
  const inelastic::ContactProblem &problem = step_.problem;
  const std::vector<double> &v = problem.predicted_velocity;
  const bool wall = contact.is_with_wall();
  inelastic::ContactState state{};
  state.timestep = problem.timestep;
  state.gap = contact.gap_now;
  state.speed_before = speed_before;
  state.predicted_speed = predicted_speed;
  const double along = parting_speed(v, i, j, normal);
  for (int d = 0; d < 3; ++d) state.sliding[d] = v[3 * i + d] - v[3 * j + d] - along * normal[d];
  state.radius = {atom->radius[i], wall ? 0.0 : atom->radius[j]};
  state.type = {atom->type[i], wall ? 0 : atom->type[j]};
  return state;
}

// A contact may have several rows: planes at a curved wall.
void LawContacts::take_impulses()
{
  for (std::size_t c = 0; has_law() && c < step_.rows.size(); ++c)
    step_.law_states[step_.rows[c].contact].impulse += step_.problem.contacts.impulse_of(c);
  for (LawState &state : step_.law_states) {
    inelastic::Impulse taken = state.impulse;
    taken.normal -= taken_before(state);
    state.kept = step_.settings.law->remember(taken, state.remembered.data());
  }
}

// The entry holds the speed that LAMMPS's velocities have at the end of the step: the mean of those
// before and after a whole kick, or those before the half kick with which a run starts, which the
// next run may repeat. There the demand counts again, also of a contact that the law need not keep,
// whose values begin anew.
LawEntry LawContacts::entry_of(std::size_t c) const
{
  const inelastic::ContactProblem &problem = step_.problem;
  const int i = problem.contacts.first[c], j = problem.contacts.second[c];
  const double *const n = &problem.contacts.normal[3 * c];
  const double before = parting_speed(step_.velocity_before, i, j, n);
  const double after = parting_speed(step_.velocity, i, j, n);
  const LawState &state = *step_.law_state_of(c);
  LawEntry entry{};
  entry.partner = step_.contact_of(c).partner;
  std::copy_n(n, 3, entry.normal.begin());
  entry.demand = step_.contact_of(c).asked;
  entry.impulse = state.impulse.normal / step_.kicks();
  entry.speed = step_.kick == Kick::WHOLE ? 0.5 * (before + after) : before;
  if (state.kept) entry.remembered = state.remembered;
  return entry;
}

// Tells whether the push out of a bad start parts the surfaces, which is no motion of a contact.
bool LawContacts::is_pushed_apart(std::size_t c) const
{
  if (!step_.bad_start) return false;
  const inelastic::ContactProblem &problem = step_.problem;
  const double speed = parting_speed(step_.motion(), problem.contacts.first[c],
                                     problem.contacts.second[c], &problem.contacts.normal[3 * c]);
  const double gap =
      step_.contact_of(c).gap_now - step_.rows[c].wall_motion + problem.timestep * speed;
  return gap > step_.eps(in_eps::REGULAR);
}

// Both atoms of a contact remember it: a partner that remembers nothing is another one with the
// same ID.
void LawContacts::follow_ids()
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

void LawContacts::remember(GhostExchange &ranks)
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  for (int i = 0; i < step_.problem.particles; ++i) {
    memory_.forget(i);
    memory_.set_owner(i, atom->tag[i]);
  }
  int last = -1;
  for (std::size_t c = 0; has_law() && c < step_.rows.size(); ++c) {
    // The rows that were added later for a contact come after all first ones.
    if (step_.rows[c].contact <= last) continue;
    last = step_.rows[c].contact;
    const Contact &contact = step_.contacts[last];
    if (!step_.law_states[last].kept && contact.asked.is_inelastic()) continue;
    if (is_pushed_apart(c)) continue;
    LawEntry entry = entry_of(c);
    memory_.remember(contacts.first[c], entry);
    if (contact.is_with_wall()) continue;
    entry.partner = atom->tag[contacts.first[c]];
    for (double &component : entry.normal) component = -component;
    step_.settings.law->turn_round(entry.remembered.data());
    memory_.remember(contacts.second[c], entry);
  }
  ranks.gather(memory_);
}
