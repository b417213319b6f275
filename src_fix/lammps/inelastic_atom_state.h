// This room holds the memory of every atom from step to step, which therefore follows the atoms
// when LAMMPS sorts them, hands them to other ranks and writes them to restart files.

#ifndef INELASTIC_ATOM_STATE_H
#define INELASTIC_ATOM_STATE_H

#include "inelastic_carried_momenta.h"
#include "inelastic_first_guess.h"
#include "inelastic_law_memory.h"
#include "inelastic_step.h"

#include "pointers.h"

namespace LAMMPS_NS::Inelastic_NS {

class GhostExchange;

class AtomState : protected Pointers {
 public:
  AtomState(class LAMMPS *lmp, const Step &step);
  ~AtomState() override;
  AtomState(const AtomState &) = delete;
  AtomState &operator=(const AtomState &) = delete;

  // Where, how fast and how large the last step predicted an owned atom to be.
  double *expected_position(int i) { return state_[i] + EXPECTED_X; }
  double *expected_velocity(int i) { return state_[i] + EXPECTED_V; }
  double &expected_radius(int i) { return state_[i][EXPECTED_RADIUS]; }
  // In place of the radius of an atom outside of the group.
  static constexpr double OUTSIDE = -1.0;

  // The part of a velocity that takes a bad overlap apart and is no momentum: after the last move,
  // and at whole steps.
  double *push_next(int i) { return state_[i] + PUSH_NEXT; }
  double *push_included(int i) { return state_[i] + PUSH_INCLUDED; }
  // At the end of a run: takes the pushes out of the velocities, which are momentum alone from here
  // on.
  void take_out_pushes();

  // For how many steps a particle has been quiet (inelastic_rest.h).
  double &quiet_steps(int i) { return state_[i][QUIET_STEPS]; }
  // The load of a particle at rest in the last step, [force / mass]; 0 if it was not at rest
  // (inelastic_rest.h).
  double &load_at_rest(int i) { return state_[i][LOAD_AT_REST]; }

  FirstGuesses &first_guesses() { return guesses_; }
  LawMemory &law_memory() { return law_memory_; }
  CarriedMomenta &momenta() { return momenta_; }

  // Both atoms of a contact remember it, those of other ranks included: the next neighbour list may
  // show the pair from the other side, and atoms may migrate before it is built. Collective.
  void remember_contacts(GhostExchange &ranks);

  // Finds how long the messages of an atom are. Call it after each step, and when a restart file
  // has brought what the law remembers, before LAMMPS hands atoms to other ranks or writes another
  // file. Collective.
  void measure_messages(GhostExchange &ranks);

  // LAMMPS's callbacks.
  void grow(int atoms);
  void copy(int from, int to);
  void begin(int i);
  int pack_exchange(int i, double *buffer) const;
  int unpack_exchange(int i, const double *buffer);
  // The largest message of an atom that is handed to another rank [numbers].
  int exchange_size() const;

  // Restart files hold what the contact law remembers. A file that is written during a run holds
  // velocities with pushes in them: the push of an atom goes along, with the velocity that it is a
  // part of. Most atoms have none. Where no atom has one, and without a law (`writes` false), the
  // file holds nothing of this fix, since LAMMPS refuses change_box after a file that does.
  int restart_size(int i, bool writes) const;
  int largest_restart_size() const;
  int pack_restart(int i, double *buffer, bool writes) const;
  // `written` tells whether a run with a law has written the file, and `same_law` whether it is
  // that of this run. Errors: LAMMPS gives the atom what belongs to another one.
  void unpack_restart(int i, int nth, bool written, bool same_law);

  double memory_usage() const;    // [numbers] per atom

 private:
  enum Column {
    EXPECTED_X = 0,
    EXPECTED_V = 3,
    PUSH_NEXT = 6,
    PUSH_INCLUDED = 9,
    EXPECTED_RADIUS = 12,
    QUIET_STEPS = 13,
    LOAD_AT_REST = 14,
    STATE_SIZE = 15
  };
  int carried_size() const
  { return STATE_SIZE + (step_.has_bodies ? CarriedMomenta::PACKED_SIZE : 0); }

  bool has_law() const { return step_.settings.law != nullptr; }
  bool is_pushed(int i) const;
  int push_size() const { return 6 + (step_.has_bodies ? CarriedMomenta::INCLUDED_SIZE : 0); }

  const Step &step_;
  double **state_ = nullptr;
  FirstGuesses guesses_;
  LawMemory law_memory_;      // empty without a law
  CarriedMomenta momenta_;    // empty in a scene of free spheres
  int most_guesses_ = 0;      // of an atom, on any rank
  int most_law_entries_ = 0;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
