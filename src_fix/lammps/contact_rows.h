// The only way of a contact into the problem of a step. Here it is told what it asks for, what is
// remembered of it and which gap it has; pairs and walls find contacts, and know nothing of laws.

#ifndef INELASTIC_CONTACT_ROWS_H
#define INELASTIC_CONTACT_ROWS_H

#include "step.h"

namespace LAMMPS_NS {

class ContactMemory;
class GapRules;
class LawContacts;

class ContactRows {
 public:
  ContactRows(Step &step, GapRules &rules, LawContacts &laws, const ContactMemory &memory) :
      step_(step), rules_(rules), laws_(laws), memory_(memory)
  {
  }

  void begin_step();

  // Tells whether contacts of this scene may pull, or belong to the problem because something is
  // remembered of them.
  bool may_hold() const;

  // Tells whether something is remembered of the contact of particle i with a partner (an atom's
  // ID, or minus a wall's number) on the side of the normal, with this gap and sum of radii
  // [length].
  bool remembers(int i, tagint partner, const double *normal, double gap, double size) const;
  bool remembers_wall(int i) const;

  // Adds a contact of particle i with particle j, or with a wall: then j is the number of
  // particles.
  void add(Side side, int i, int j, tagint partner, const double *normal);

  // Adds one more tangent plane of a wall, which asks for `gap` [length] (contact_set.h). `known`
  // tells whether the contact with this wall is in the problem already; if not, the plane only
  // pushes in this step.
  void add_plane(Side side, int i, const double *normal, double gap, bool known);

 private:
  Step &step_;
  GapRules &rules_;
  LawContacts &laws_;
  const ContactMemory &memory_;
};

}    // namespace LAMMPS_NS

#endif
