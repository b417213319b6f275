// This room decides how long a step may be. Pairs that the neighbour list lacks must not meet
// during it, LAMMPS must be able to follow every atom, and, with the keyword shorten, no overlap
// may be left at its end.

#ifndef INELASTIC_STEP_LENGTH_H
#define INELASTIC_STEP_LENGTH_H

#include "inelastic_list_reach.h"
#include "inelastic_step.h"

#include "pointers.h"

#include <string>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class GhostExchange;

class StepLength : protected Pointers {
 public:
  StepLength(class LAMMPS *lmp, Step &step, GhostExchange &ranks);

  // How far the neighbour list reaches.
  ListReach &list() { return list_; }
  const ListReach &list() const { return list_; }

  // At the start of a run.
  void begin_run();

  // The neighbour list is new: takes the positions. Errors: those of ListReach::built().
  // Collective.
  void list_built();

  // At the start of a step: measures how far atoms have moved since the list was built. Collective.
  void begin_step();

  // Shortens the step where the list cannot reach as far as atoms would move without contacts:
  // there is no use in solving first. Collective.
  void fit_to_list();

  // Tells whether the step may be made, `solved` or as far as it goes. Otherwise it is shorter now,
  // or there is an error. `named` tells of the constraint that is farthest from being met, if any,
  // `squeezed` of what walls throw (inelastic_squeezed_grains.h). Collective.
  bool accepts(bool solved, const std::string &named, const std::string &squeezed);

  // Makes the time step shorter. Errors: it is so short already that something else is wrong.
  void shorten(double factor, const std::string &named);

  // Tells whether the keyword allows a shorter step for one that could not be solved, in which the
  // contact law asks surfaces to part or does not.
  bool may_shorten_unsolved(bool law_parts) const;

  // Tells whether the list must be built before the next step, which may be half as fast again.
  // Collective.
  bool needs_new_list();

  // Before a step, or a run: a time step that was shortened is the regular one again.
  void restore();
  // Call it when the time step was changed, also where no run is set up after it (run pre no).
  void timestep_was_set();
  bool is_shortened() const;
  void set_regular_timestep(double timestep);

  long shortened_steps() const { return shortened_steps_; }

 private:
  void set_timestep(double timestep);
  void measure_farthest();
  double part_of_farthest();
  double spread(const double *values);
  double spread_since_build(const double *motion);
  double unhindered_spread(double kicks);
  double room_in_list(double none, double whole) const;

  Step &step_;
  GhostExchange &ranks_;
  ListReach list_;
  // [length] The largest relative displacement since the list was built
  double spread_at_start_ = 0.0;
  double growth_ = 0.0;     // [length] of a radius since then
  double strayed_ = 0.0;    // largest displacement since then, as a part of own_width_
  // [length] The part of the box that this rank owns; no limit where nothing is beyond.
  double own_width_[3] = {EXTREME, EXTREME, EXTREME};
  // LAMMPS loses an atom that goes further than this part of the box, in one direction, between two
  // lists.
  double farthest_[3] = {EXTREME, EXTREME, EXTREME};
  std::vector<double> position_at_build_, radius_at_build_;
  std::vector<double> vectors_;    // room for 3 numbers per atom
  // [time] The length with which this step was tried first; 0 before that
  double first_timestep_ = 0.0;
  bool shortened_ = false;           // restore() must undo it
  bool setting_timestep_ = false;    // the fix itself is changing it
  long shortened_steps_ = 0;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
