// The contacts of a step as the contact law sees them. Constraints ask here what the law asks of
// them, and after the step the law takes the impulses. Without a law this room is empty, and is
// asked for nothing but whether there is one and what it remembers: nothing.

#ifndef INELASTIC_LAW_CONTACTS_H
#define INELASTIC_LAW_CONTACTS_H

#include "law_memory.h"
#include "step.h"

#include <mpi.h>

namespace LAMMPS_NS {

class GhostExchange;

class LawContacts {
 public:
  LawContacts(Step &step, LawMemory &memory) : step_(step), memory_(memory) {}

  bool has_law() const { return step_.settings.law != nullptr; }

  void begin_step() { step_.law_contacts.clear(); }

  // Asks the law about a contact of particle i with particle j (the number of particles: a wall),
  // and notes the answer for its `side`. Of a bad start the law only asks which impulse is allowed.
  void ask(Side &side, int i, int j, tagint partner, const double *normal, bool bad_start);

  // Tells whether the law remembers a contact with this gap and sum of radii [length], which then
  // belongs to the problem.
  bool remembers(int i, tagint partner, const double *normal, double gap, double size) const
  { return has_law() && find(i, partner, normal, gap, size) != nullptr; }
  bool remembers_wall(int i) const { return has_law() && memory_.remembers_wall(i); }

  // Gives the law the impulses of a step that is solved.
  void take_impulses();

  // Before a run, or a restart file: follows the atoms whose IDs have changed since the law
  // remembered them, and forgets those that are gone. Collective.
  void follow_ids(const Atom *atom, MPI_Comm world);

  // Keeps what the law remembers with the atoms, those of other ranks included. Collective.
  void remember(const Atom *atom, GhostExchange &ranks);

 private:
  // The half kick with which a run starts takes the place of the second half of the last step of
  // the run before, whose impulses the law has taken: it is given the difference. [mass length /
  // time]
  double taken_before(const LawContact &contact) const
  { return is_repeated(contact) ? step_.kicks() * contact.last_impulse : 0.0; }
  bool is_repeated(const LawContact &contact) const
  { return contact.known && step_.kick == Kick::HALF; }

  // Looks for what is remembered of a contact with this gap and sum of radii [length]. One whose
  // surfaces something else than a step has parted begins anew.
  const LawMemory::Entry *find(int i, tagint partner, const double *normal, double gap,
                               double size) const;
  bool is_pushed_apart(std::size_t c) const;

  // What is to be remembered of constraint c, on its first side.
  LawMemory::Entry entry_of(std::size_t c, const LawContact &contact, tagint partner) const;

  Step &step_;
  LawMemory &memory_;
};

}    // namespace LAMMPS_NS

#endif
