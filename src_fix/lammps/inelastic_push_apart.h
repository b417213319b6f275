// The way out of a bad start, overlaps beyond the regular ones: the smallest motion, added to the
// step's but not kept as momentum, that takes the spheres apart at a bounded speed.

#ifndef INELASTIC_PUSH_APART_H
#define INELASTIC_PUSH_APART_H

#include "inelastic_projection.h"

#include <functional>

namespace LAMMPS_NS {
class Atom;
}

namespace LAMMPS_NS::Inelastic_NS {

class Constraints;
class Movers;
struct Step;

class PushApart {
 public:
  // Projects the step's predicted velocities with at most so many iterations.
  using Project = std::function<inelastic::ProjectionResult(long max_iterations)>;

  PushApart(Step &step, Constraints &constraints, Movers &movers) :
      step_(step), constraints_(constraints), movers_(movers)
  {
  }

  // Changes the velocities of the step, which were projected with bad overlaps counted as touching.
  // The predicted velocities become those without the push. Adds the second projection to the
  // result.
  void run(const Atom *atom, inelastic::ProjectionResult &result, const Project &project);

 private:
  void begin_push();
  void look_for_progress();
  void begin_trial(const inelastic::ContactSet &contacts);
  void ask_for(double part, const Atom *atom);
  void note_solved(double part, bool at_once);

  Step &step_;
  Constraints &constraints_;
  Movers &movers_;

  // The part of the length by which overlaps are to open that the last step could open them by.
  double part_ = 1.0;
  int easy_ = 0;                   // steps in a row in which the first trial was solved
  int looked_ = 0;                 // steps since the largest overlap was largest_before_
  double largest_before_ = 0.0;    // [length]
  bool stuck_ = false;             // overlaps get no smaller, so that all is asked for
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
