// The overlaps at the start of a step: how deep the deepest is, whether one is a bad start, and
// whether one has appeared that no step has left behind, which means that something else has moved
// or changed the scene.

#ifndef INELASTIC_OVERLAP_WATCH_H
#define INELASTIC_OVERLAP_WATCH_H

#include "inelastic_step.h"

#include "pointers.h"

#include <string>

namespace LAMMPS_NS::Inelastic_NS {

class GhostExchange;

class OverlapWatch : protected Pointers {
 public:
  OverlapWatch(class LAMMPS *lmp, Step &step, GhostExchange &ranks);

  void begin_run();
  void begin_step();

  // A bad start: more than a step may leave behind.
  bool is_bad(double gap) const { return gap < -step_.eps(in_eps::REGULAR); }

  // Takes the gap [length] of atom i at the start of the step: with another atom (`partner` is its
  // ID) or with a wall (minus the wall's number).
  void note(double gap, int i, tagint partner);

  // Collective: the step's bad_start and largest_overlap are those of all ranks from here on.
  void share();

  // Collective: warns of an overlap that no step has left, once a run, and counts such steps.
  void warn_of_unexpected();

  // Notes after a step which overlaps it may have left behind. `certain` says that it was solved,
  // and that every bad start in it was treated; a push has left them as deep as `pushed` [length].
  void end_step(bool certain, double pushed);

  // Steps of this run in which an unexpected overlap was there.
  long unexpected_steps() const { return unexpected_steps_; }
  void begin_count() { unexpected_steps_ = 0; }

  // Tells whether this step or the one before pushed spheres apart: a whole-step velocity holds
  // half of each push.
  bool pushes_in_velocity() const { return pushes_in_velocity_; }
  // Tells whether the step before pushed spheres apart.
  bool pushed_before() const { return pushed_before_; }

 private:
  Step &step_;
  GhostExchange &ranks_;
  bool pushed_before_ = false;
  bool pushes_in_velocity_ = false;
  double left_ = EXTREME;      // [length] the largest that the last step may have left
  double unexpected_ = 0.0;    // [length] the largest of this step that no step has left
  bool appeared_ = false;      // such an overlap, on any rank
  std::string who_;            // the two that overlap so
  long unexpected_steps_ = 0;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
