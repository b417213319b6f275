// This room checks that the scene is as the fix left it: LAMMPS moved what the last step predicted,
// nothing was added or changed during the run, and forces and velocities are numbers.

#ifndef INELASTIC_MOTION_CHECK_H
#define INELASTIC_MOTION_CHECK_H

#include "inelastic_scene_check.h"
#include "inelastic_step.h"

#include "pointers.h"

#include <string>

namespace LAMMPS_NS {
class Fix;
}

namespace LAMMPS_NS::Inelastic_NS {

class AtomState;
class GhostExchange;
class Movers;

class MotionCheck : protected Pointers {
 public:
  MotionCheck(class LAMMPS *lmp, const Fix *fix, Step &step, GhostExchange &ranks, AtomState &state,
              Movers &movers);

  // Errors of inelastic_scene_check.h.
  void check_other_fixes() const;
  // At the start of a run. Warnings of inelastic_scene_check.h.
  void begin_run();
  // At the start of a run, when its box is set up.
  void set_up();
  // `pushing`: the last step pushed spheres apart, and the run's end has taken that out of
  // velocities.
  void end_run(bool pushing);

  // Tells whether the next step is the first of a run that is not set up (`run pre no`).
  bool goes_on_without_setup() const { return step_.continues && !goes_on_; }

  // Before a step. Errors: velocities or forces that are no numbers, a box that has changed, atoms
  // that did not move as predicted. Collective.
  void before_step();

  // This is called after a step: it notes which atoms are in the group, and how large, and that
  // there is a prediction. The largest change [velocity] is that which one of the contacts made.
  void after_step(double largest_change);

 private:
  std::string break_in_run();
  std::string not_finite() const;
  std::string compare(int i) const;
  std::string changed_before(int i) const;
  std::string moved_otherwise(int i, double position_error, double velocity_error,
                              double speed_error) const;
  std::string other_fixes() const;
  void compare_all();

  const Fix *fix_;
  Step &step_;
  GhostExchange &ranks_;
  AtomState &state_;
  Movers &movers_;
  SceneCheck scene_;
  bool goes_on_ = false;                // between setup and the end of the run
  bool first_without_setup_ = false;    // the step is the first of a run that is not set up
  // Velocities lack the push that the end of the last run took out of them.
  bool ended_pushing_ = false;
  double largest_change_ = 0.0;    // [velocity] on any rank
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
