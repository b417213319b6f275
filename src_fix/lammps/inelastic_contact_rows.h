// Contacts enter the problem of a step through this room alone. It finds what a contact asks for,
// what is remembered of it, and its gap; the rooms of pairs and walls find contacts, and know
// nothing of laws.

#ifndef INELASTIC_CONTACT_ROWS_H
#define INELASTIC_CONTACT_ROWS_H

#include "inelastic_step.h"

namespace LAMMPS_NS::Inelastic_NS {

class FirstGuesses;
class GapRules;
class LawContacts;

class ContactRows {
 public:
  ContactRows(Step &step, GapRules &rules, LawContacts &laws, const FirstGuesses &guesses) :
      step_(step), rules_(rules), laws_(laws), guesses_(guesses)
  {
  }

  void begin_step();

  // Tells whether contacts of this scene may pull, or belong to the problem because something is
  // remembered of them.
  bool may_pull() const;

  // Tells whether something is remembered of the contact of particle i with a partner (an atom's
  // ID, or minus a wall's number) on the side of the normal, with this gap and sum of radii
  // [length].
  bool remembers(int i, tagint partner, const double *normal, double gap, double size) const;
  bool remembers_wall(int i) const;

  // Adds a contact with one row. Slot i is its first particle, slot j the other side
  // (inelastic_unknowns.h). The wall, if it is one, closes the gap by `wall_motion` [length] during
  // the step.
  void add(Contact contact, double wall_motion, int i, int j, const double *normal);

  // Adds a contact with a wall that comes to light at the end of the step, without a row. In this
  // step it only pushes. Returns its place in Step::contacts.
  int add_late(Contact contact, double wall_motion, int i, const double *normal);

  // Adds a row, a tangent plane of a wall, to a contact of particle i. It asks for `gap` [length]
  // (inelastic_contact_set.h).
  void add_plane(const Row &row, int i, const double *normal, double gap);

 private:
  Step &step_;
  GapRules &rules_;
  LawContacts &laws_;
  const FirstGuesses &guesses_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
