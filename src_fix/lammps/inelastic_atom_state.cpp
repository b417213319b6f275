#include "inelastic_atom_state.h"

#include "inelastic_ghost_exchange.h"

#include "atom.h"
#include "error.h"
#include "memory.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

AtomState::AtomState(LAMMPS *lmp, const Step &step) : Pointers(lmp), step_(step) {}

AtomState::~AtomState()
{ memory->destroy(state_); }

void AtomState::take_out_pushes()
{
  for (int i = 0; i < atom->nlocal; ++i)
    for (int d = 0; d < 3; ++d) {
      atom->v[i][d] -= push_included(i)[d];
      push_included(i)[d] = 0.0;
    }
}

void AtomState::remember_contacts(GhostExchange &ranks)
{
  const inelastic::ContactProblem &problem = step_.problem;
  const double force_per_impulse = 1.0 / step_.impulse_per_force;
  for (int i = 0; i < problem.particles; ++i) guesses_.forget(i);
  for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
    const Contact &contact = step_.contact_of(c);
    const double closed_gap = contact.closed_gap;
    if (problem.contacts.impulse[c] == 0.0 && closed_gap == Contact::NOT_CLOSED) continue;
    const int i = problem.contacts.first[c];
    const int j = problem.contacts.second[c];
    const double force = problem.contacts.impulse[c] * force_per_impulse;
    guesses_.remember(i, {contact.partner, force, closed_gap});
    if (!contact.is_with_wall()) guesses_.remember(j, {atom->tag[i], force, closed_gap});
  }
  ranks.gather(guesses_);
  measure_messages(ranks);
}

void AtomState::measure_messages(GhostExchange &ranks)
{
  double most[2] = {0.0, 0.0};
  for (int i = 0; i < atom->nlocal; ++i) {
    most[0] = std::max(most[0], static_cast<double>(guesses_.number_of_entries(i)));
    if (has_law())
      most[1] = std::max(most[1], static_cast<double>(law_memory_.number_of_entries(i)));
  }
  ranks.reduce(nullptr, 0, most, 2);
  most_guesses_ = static_cast<int>(most[0]);
  most_law_entries_ = static_cast<int>(most[1]);
}

int AtomState::exchange_size() const
{
  return carried_size() + FirstGuesses::packed_size(most_guesses_) +
      (has_law() ? LawMemory::packed_size(most_law_entries_) : 0);
}

void AtomState::grow(int atoms)
{
  memory->grow(state_, atoms, STATE_SIZE, "inelastic:state");
  guesses_.resize(atoms);
  if (has_law()) law_memory_.resize(atoms);
  if (step_.has_bodies) momenta_.resize(atoms);
}

void AtomState::copy(int from, int to)
{
  std::copy_n(state_[from], STATE_SIZE, state_[to]);
  guesses_.copy(from, to);
  if (has_law()) law_memory_.copy(from, to);
  if (step_.has_bodies) momenta_.copy(from, to);
}

// An atom that is created during a run moves on from where it is.
void AtomState::begin(int i)
{
  std::fill_n(state_[i], STATE_SIZE, 0.0);
  guesses_.forget(i);
  if (has_law()) law_memory_.forget(i);
  if (step_.has_bodies) momenta_.forget(i);
  std::copy_n(atom->x[i], 3, expected_position(i));
  std::copy_n(atom->v[i], 3, expected_velocity(i));
  expected_radius(i) = atom->radius[i];
}

int AtomState::pack_exchange(int i, double *buffer) const
{
  double *out = std::copy_n(state_[i], STATE_SIZE, buffer);
  if (step_.has_bodies) out += momenta_.pack(i, out);
  out += guesses_.pack(i, 0, guesses_.number_of_entries(i), out);
  if (has_law()) out += law_memory_.pack(i, out);
  return static_cast<int>(out - buffer);
}

int AtomState::unpack_exchange(int i, const double *buffer)
{
  std::copy_n(buffer, STATE_SIZE, state_[i]);
  guesses_.forget(i);
  const double *in = buffer + STATE_SIZE;
  if (step_.has_bodies) in += momenta_.unpack(i, in);
  in += guesses_.unpack(i, in);
  if (has_law()) {
    law_memory_.forget(i);
    in += law_memory_.unpack(i, in);
  }
  return static_cast<int>(in - buffer);
}

bool AtomState::is_pushed(int i) const
{
  const double *const included = state_[i] + PUSH_INCLUDED;
  return included[0] != 0.0 || included[1] != 0.0 || included[2] != 0.0 ||
      (step_.has_bodies && momenta_.has_included(i));
}

// The layout is: this size; what the law remembers of contacts, or without a law a 0 if more
// follows; the push, if there is one.
int AtomState::restart_size(int i, bool writes) const
{
  if (!writes) return 0;
  const int push = is_pushed(i) ? push_size() : 0;
  if (has_law()) return 1 + LawMemory::packed_size(law_memory_.number_of_entries(i)) + push;
  return push > 0 ? 2 + push : 1;
}

int AtomState::largest_restart_size() const
{ return 1 + LawMemory::packed_size(most_law_entries_) + push_size(); }

int AtomState::pack_restart(int i, double *buffer, bool writes) const
{
  const int size = restart_size(i, writes);
  if (size == 0) return size;
  double *out = buffer;
  *out++ = size;
  if (size == 1) return size;
  if (has_law())
    out += law_memory_.pack(i, out);
  else
    *out++ = 0.0;
  if (!is_pushed(i)) return size;
  out = std::copy_n(atom->v[i], 3, out);
  out = std::copy_n(state_[i] + PUSH_INCLUDED, 3, out);
  if (step_.has_bodies) momenta_.pack_included(i, out);
  return size;
}

void AtomState::unpack_restart(int i, int nth, bool written, bool same_law)
{
  const double *in = atom->extra[i];
  for (int k = 0; k < nth; ++k) in += static_cast<int>(*in);
  const double *const end = in + static_cast<int>(*in);
  if (++in >= end) return;
  if (same_law) {
    in += law_memory_.unpack(i, in);
    if (law_memory_.owner(i) != atom->tag[i])
      error->one(
          FLERR,
          "Fix inelastic: LAMMPS gives atom {} what the restart file holds of contacts of atom "
          "{}: define the fix after read_restart before atoms are deleted, or their order or "
          "IDs change",
          atom->tag[i], law_memory_.owner(i));
  } else
    in += written ? LawMemory::size_of_packed(in) : 1;
  if (in == end) return;
  // A velocity that was set since the file was written is momentum alone.
  if (!std::equal(in, in + 3, atom->v[i])) return;
  for (int d = 0; d < 3; ++d) atom->v[i][d] -= in[3 + d];
  if (step_.has_bodies && end - in == push_size()) momenta_.unpack_included(i, in + 6);
}

double AtomState::memory_usage() const
{ return STATE_SIZE; }
