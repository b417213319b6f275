#include "inelastic_contact_rows.h"

#include "inelastic_first_guess.h"
#include "inelastic_gap_rules.h"
#include "inelastic_law_contacts.h"

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

void ContactRows::begin_step()
{
  step_.problem.contacts.clear();
  step_.contacts.clear();
  step_.rows.clear();
  step_.approaches.clear();
  laws_.begin_step();
}

bool ContactRows::may_pull() const
{ return laws_.has_law(); }

bool ContactRows::remembers(int i, tagint partner, const double *normal, double gap,
                            double size) const
{ return laws_.remembers(i, partner, normal, gap, size); }

bool ContactRows::remembers_wall(int i) const
{ return laws_.remembers_wall(i); }

void ContactRows::add(Contact contact, double wall_motion, int i, int j, const double *normal)
{
  if (laws_.has_law())
    laws_.ask(contact, wall_motion, i, j, normal, rules_.overlaps().is_bad(contact.gap_now));
  const FirstGuess *const last = guesses_.find(i, contact.partner, normal);
  rules_.begin(contact, last ? *last : FirstGuess{}, wall_motion, i, j, normal);
  const double gap = rules_.effective_gap(contact);
  Row row = {static_cast<int>(step_.contacts.size()), wall_motion};
  row.asks_for_gap = gap == contact.gap_now;
  step_.problem.contacts.add(i, j, normal, gap - wall_motion,
                             step_.impulse_per_force * contact.force, 0.0, contact.asked.set,
                             contact.refinement());
  step_.contacts.push_back(contact);
  step_.rows.push_back(row);
}

int ContactRows::add_late(Contact contact, double wall_motion, int i, const double *normal)
{
  const int wall = step_.problem.slot_of_wall(contact.wall() - 1);
  if (laws_.has_law()) laws_.ask(contact, wall_motion, i, wall, normal, true);
  step_.contacts.push_back(contact);
  return static_cast<int>(step_.contacts.size()) - 1;
}

void ContactRows::add_plane(const Row &row, int i, const double *normal, double gap)
{
  const int wall = step_.problem.slot_of_wall(step_.contacts[row.contact].wall() - 1);
  step_.problem.contacts.add(i, wall, normal, gap, 0.0);
  step_.rows.push_back(row);
}
