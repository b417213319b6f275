// This room finds the velocities that a step would end with without contacts: every other fix and
// force has done its work.

#ifndef INELASTIC_PREDICTION_H
#define INELASTIC_PREDICTION_H

#include "pointers.h"

namespace LAMMPS_NS::Inelastic_NS {

struct Step;
class LawContacts;
class Movers;
class PhaseClock;
class Rest;
class Walls;

class Prediction : protected Pointers {
 public:
  Prediction(class LAMMPS *lmp, Step &step, const Walls &walls, const LawContacts &laws,
             Movers &movers, Rest &rest, PhaseClock &clock);

  // Sets up the problem of the step at its present length. Collective.
  void run();

 private:
  Step &step_;
  const Walls &walls_;
  const LawContacts &laws_;
  Movers &movers_;
  Rest &rest_;
  PhaseClock &clock_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
