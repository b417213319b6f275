#include "contact_rows.h"

#include "contact_memory.h"
#include "gap_rules.h"
#include "law_contacts.h"

using namespace LAMMPS_NS;

void ContactRows::begin_step()
{
  step_.problem.contacts.clear();
  step_.sides.clear();
  laws_.begin_step();
}

bool ContactRows::may_hold() const
{ return laws_.has_law(); }

bool ContactRows::remembers(int i, tagint partner, const double *normal, double gap,
                            double size) const
{ return laws_.remembers(i, partner, normal, gap, size); }

bool ContactRows::remembers_wall(int i) const
{ return laws_.remembers_wall(i); }

void ContactRows::add(Side side, int i, int j, tagint partner, const double *normal)
{
  if (laws_.has_law())
    laws_.ask(side, i, j, partner, normal, rules_.overlaps().is_bad(side.gap_now));
  rules_.begin(side, memory_.find(i, partner), i, j, normal);
  step_.problem.contacts.add(i, j, normal, rules_.asked_gap(side),
                             step_.impulse_per_force * side.force, 0.0, side.asked.least_impulse,
                             side.asked.refinement());
  step_.sides.push_back(side);
}

void ContactRows::add_plane(Side side, int i, const double *normal, double gap, bool known)
{
  const int wall = step_.problem.slot_of_wall(side.wall - 1);
  if (!known && laws_.has_law()) laws_.ask(side, i, wall, -side.wall, normal, true);
  step_.problem.contacts.add(i, wall, normal, gap, 0.0);
  step_.sides.push_back(side);
}
