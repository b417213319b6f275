// The contacts of a step as the contact law sees them. Constraints ask here what the law asks of
// them, and after the step the law takes the impulses. Without a law this room is empty: others ask
// it only whether there is a law, and whether that remembers a contact, which it does not.

#ifndef INELASTIC_LAW_CONTACTS_H
#define INELASTIC_LAW_CONTACTS_H

#include "inelastic_law_memory.h"
#include "inelastic_step.h"

#include "pointers.h"

namespace LAMMPS_NS::Inelastic_NS {

class GhostExchange;

class LawContacts : protected Pointers {
 public:
  LawContacts(class LAMMPS *lmp, Step &step, LawMemory &memory) :
      Pointers(lmp), step_(step), memory_(memory)
  {
  }

  bool has_law() const { return step_.settings.law != nullptr; }

  void begin_step() { step_.law_states.clear(); }

  // Asks the law about a contact of slots i and j (inelastic_unknowns.h), which is the next one of
  // the step, and notes the answer with it. A wall closes the gap by `wall_motion` [length] in the
  // step. In a bad start the answer counts for the impulses alone: no speed is asked for.
  void ask(Contact &contact, double wall_motion, int i, int j, const double *normal,
           bool bad_start);

  // Tells whether the law remembers a contact with this gap and sum of radii [length], which then
  // belongs to the problem.
  bool remembers(int i, tagint partner, const double *normal, double gap, double size) const
  { return has_law() && find(i, partner, normal, gap, size) != nullptr; }
  bool remembers_wall(int i) const { return has_law() && memory_.remembers_wall(i); }

  // Gives the law the impulses of a step that is solved.
  void take_impulses();

  // Before a run, or a restart file: follows the atoms whose IDs have changed since the law
  // remembered them, and forgets those that are gone. Collective.
  void follow_ids();

  // Keeps what the law remembers with the atoms, those of other ranks included. Collective.
  void remember(GhostExchange &ranks);

 private:
  // Returns the part of a contact's impulse that the law has taken already [mass length / time]:
  // the half kick with which a run starts repeats the second half of the last kick of the run
  // before. The law is given the difference.
  double taken_before(const LawState &state) const
  { return is_repeated(state) ? step_.kicks() * state.last_impulse : 0.0; }
  bool is_repeated(const LawState &state) const { return state.known && step_.kick == Kick::HALF; }

  // Looks for what is remembered of a contact with this gap and sum of radii [length]. A contact
  // whose surfaces were parted by something else than a step begins anew.
  const LawEntry *find(int i, tagint partner, const double *normal, double gap, double size) const;
  void check(const inelastic::Demand &demand, int i);
  bool is_pushed_apart(std::size_t c) const;
  inelastic::ContactState seen(const Contact &contact, int i, int j, const double *normal,
                               double speed_before, double predicted_speed) const;

  // What is to be remembered of the contact of row c, on its first side.
  LawEntry entry_of(std::size_t c) const;

  Step &step_;
  LawMemory &memory_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
