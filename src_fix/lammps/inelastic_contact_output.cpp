#include "inelastic_contact_output.h"

#include "inelastic_ghost_exchange.h"

#include "atom.h"
#include "memory.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

ContactOutput::ContactOutput(LAMMPS *lmp, const Step &step, GhostExchange &ranks) :
    Pointers(lmp), step_(step), ranks_(ranks)
{
}

ContactOutput::~ContactOutput()
{
  memory->destroy(per_atom_);
  memory->destroy(local_);
}

// Values that the contact law remembers of each contact.
int ContactOutput::remembered() const
{ return step_.settings.law ? step_.settings.law->remembers() : 0; }

void ContactOutput::take(const inelastic::ProjectionResult &result, long shortened_steps,
                         const VirialTarget &virial)
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  const double force_per_impulse = 1.0 / step_.impulse_per_force;
  clear_sums(virial.per_atom);
  int active = 0;
  for (std::size_t c = 0; c < contacts.size(); ++c)
    if (is_contact(c)) ++active;
  if (active > local_room_) {
    local_room_ = active * 5 / 4 + 16;
    memory->grow(local_, local_room_, local_columns(), "inelastic:array_local");
  }
  for (std::size_t c = 0; c < contacts.size(); ++c)
    if (is_contact(c)) add_contact(c, contacts.impulse[c] * force_per_impulse, virial);
  for (int row = 0; row < local_rows_; ++row)
    if (local_[row][FORCE] > 0.0) counts_.pressed += 1.0;
  share(virial);

  enum { PAIRS, WALLS, PRESSED, HELD, ROWS, SUMS };
  double sums[SUMS] = {counts_.pairs, counts_.walls, counts_.pressed, counts_.kept,
                       static_cast<double>(contacts.size())};
  ranks_.reduce(sums, SUMS, &largest_change_, 1);
  vector_[PARTICLE_CONTACTS] = sums[PAIRS];
  vector_[WALL_CONTACTS] = sums[WALLS];
  vector_[CONSTRAINTS] = sums[ROWS];
  vector_[ITERATIONS] = static_cast<double>(result.iterations);
  vector_[FEASIBILITY] = result.residual.feasibility;
  vector_[COMPLEMENTARITY] = result.residual.complementarity;
  vector_[OVERLAP] = step_.largest_overlap;
  vector_[ROUNDS] = result.rounds;
  vector_[TOTAL_ITERATIONS] += static_cast<double>(result.iterations);
  vector_[SHORTENED_STEPS] = static_cast<double>(shortened_steps);
  vector_[EXCESS] = step_.excess;
  vector_[PUSHED_STEPS] += step_.bad_start ? 1.0 : 0.0;
  vector_[AT_REST] = step_.at_rest ? 1.0 : 0.0;
  vector_[PRESSED_CONTACTS] = sums[PRESSED];
  vector_[HELD_CONTACTS] = sums[HELD];
}

// Tells whether a row is a contact of the output: it carries a force, or the law remembers
// something of its contact. Of several rows of one contact only those with a force count.
bool ContactOutput::is_contact(std::size_t c) const
{
  if (step_.problem.contacts.impulse[c] != 0.0) return true;
  const LawState *const law = step_.law_state_of(c);
  return law && law->kept && law->impulse.normal == 0.0;
}

void ContactOutput::clear_sums(bool virial_per_atom)
{
  const std::size_t size = 3 * static_cast<std::size_t>(step_.problem.slots());
  contact_force_.assign(size, 0.0);
  contact_count_.assign(2 * static_cast<std::size_t>(step_.problem.slots()), 0.0);
  if (virial_per_atom) { virial_.assign(2 * size, 0.0); }
  wall_forces_.clear();
  local_rows_ = 0;
  last_row_.assign(step_.contacts.size(), NONE);
  row_before_.clear();
  counts_ = Counts{};
  largest_change_ = 0.0;
}

// Returns the row of the local list that has this contact with the same normal, or NONE: a plane
// that the end of a step has left, and come back to, is in the problem twice.
int ContactOutput::listed_before(std::size_t c) const
{
  const double *const n = &step_.problem.contacts.normal[3 * c];
  int row = last_row_[step_.rows[c].contact];
  while (row != NONE && !is_same_normal(&local_[row][NORMAL], n)) row = row_before_[row];
  return row;
}

// `strength` is the force of the contact.
void ContactOutput::add_contact(std::size_t c, double strength, const VirialTarget &virial)
{
  const inelastic::ContactProblem &problem = step_.problem;
  const int i = problem.contacts.first[c];
  const int j = problem.contacts.second[c];
  const double *const n = &problem.contacts.normal[3 * c];
  const Contact &contact = step_.contact_of(c);
  const bool is_wall = contact.is_with_wall();
  const double to_point = atom->radius[i] + (is_wall ? contact.gap_now : 0.5 * contact.gap_now);
  const int before = listed_before(c);
  if (before == NONE) {
    count_contact(c);
    list_contact(c, strength, to_point);
  } else {
    join(local_[before], strength, n, i, to_point);
  }
  largest_change_ = std::max(largest_change_,
                             std::abs(problem.contacts.impulse[c]) *
                                 (problem.inverse_mass[i] + problem.inverse_mass[j]));
  for (int d = 0; d < 3; ++d) {
    contact_force_[3 * i + d] += strength * n[d];
    contact_force_[3 * j + d] -= strength * n[d];
    if (is_wall) wall_forces_.of(contact.wall() - 1)[d] -= strength * n[d];
  }
  if (virial.global || virial.per_atom) {
    const double arm = is_wall ? to_point : contact.size + contact.gap_now;
    add_virial(c, arm * strength, virial);
  }
}

// Adds a force to that of a row of the list, whose normal is the same but for the sixth digit, and
// gives the row the direction of the sum: what is listed adds up to the forces on the spheres.
void ContactOutput::join(double *row, double strength, const double *normal, int i,
                         double to_point) const
{
  double sum[3];
  for (int d = 0; d < 3; ++d) sum[d] = row[FORCE] * row[NORMAL + d] + strength * normal[d];
  const double size = inelastic::norm(sum);
  if (!(size > 0.0)) return;
  row[FORCE] = std::copysign(size, row[FORCE] + strength);
  for (int d = 0; d < 3; ++d) {
    row[NORMAL + d] = sum[d] / row[FORCE];
    row[POINT + d] = atom->x[i][d] - to_point * row[NORMAL + d];
  }
}

void ContactOutput::count_contact(std::size_t c)
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  const bool is_wall = step_.contact_of(c).is_with_wall();
  (is_wall ? counts_.walls : counts_.pairs) += 1.0;
  const LawState *const law = step_.law_state_of(c);
  if (law && law->kept) counts_.kept += 1.0;
  contact_count_[2 * contacts.first[c] + is_wall] += 1.0;
  if (!is_wall) contact_count_[2 * contacts.second[c]] += 1.0;
}

void ContactOutput::list_contact(std::size_t c, double strength, double to_point)
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  const int i = contacts.first[c];
  const double *const n = &contacts.normal[3 * c];
  const Contact &contact = step_.contact_of(c);
  int &last = last_row_[step_.rows[c].contact];
  row_before_.push_back(last);
  last = local_rows_++;
  double *const out = local_[last];
  out[0] = static_cast<double>(atom->tag[i]);
  out[1] = static_cast<double>(contact.partner);
  for (int d = 0; d < 3; ++d) {
    out[POINT + d] = atom->x[i][d] - to_point * n[d];
    out[NORMAL + d] = n[d];
  }
  out[8] = contact.gap_now;
  out[FORCE] = strength;
  if (remembered() > 0)
    std::copy_n(step_.law_state_of(c)->remembered.begin(), remembered(), out + LOCAL_COLUMNS);
}

// `weight` is the distance over which the force acts, times the force. Half goes to each side; a
// wall's half goes to the sphere as well.
void ContactOutput::add_virial(std::size_t c, double weight, const VirialTarget &virial)
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  const double *const n = &contacts.normal[3 * c];
  const double v[6] = {weight * n[0] * n[0], weight * n[1] * n[1], weight * n[2] * n[2],
                       weight * n[0] * n[1], weight * n[0] * n[2], weight * n[1] * n[2]};
  if (virial.global)
    for (int k = 0; k < 6; ++k) virial.total[k] += v[k];
  if (!virial.per_atom) return;
  const int i = contacts.first[c];
  const int j = step_.contact_of(c).is_with_wall() ? i : contacts.second[c];
  for (int k = 0; k < 6; ++k) {
    virial_[6 * i + k] += 0.5 * v[k];
    virial_[6 * j + k] += 0.5 * v[k];
  }
}

void ContactOutput::share(const VirialTarget &virial)
{
  if (virial.per_atom) {
    ranks_.sum_over_ghosts(virial_.data(), 6);
    for (int i = 0; i < atom->nlocal; ++i)
      for (int k = 0; k < 6; ++k) virial.atoms[i][k] += virial_[6 * i + k];
  }
  ranks_.sum_over_ghosts(contact_force_.data(), 3);
  ranks_.sum_over_ghosts(contact_count_.data(), 2);
  for (int i = 0; i < atom->nlocal; ++i) {
    per_atom_[i][0] = contact_count_[2 * i];
    per_atom_[i][1] = contact_count_[2 * i + 1];
    for (int d = 0; d < 3; ++d) per_atom_[i][2 + d] = contact_force_[3 * i + d];
  }
}

void ContactOutput::grow(int atoms)
{ memory->grow(per_atom_, atoms, PER_ATOM_COLUMNS, "inelastic:array_atom"); }

void ContactOutput::copy(int from, int to)
{ std::copy_n(per_atom_[from], PER_ATOM_COLUMNS, per_atom_[to]); }

void ContactOutput::clear(int i)
{ std::fill_n(per_atom_[i], PER_ATOM_COLUMNS, 0.0); }
