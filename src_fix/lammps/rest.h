// This room tells when the whole scene is at rest. Contacts then take away all that forces give to any
// particle but for what velocities are resolved to, and that is taken away as well: nothing moves, and the
// contact forces of one step solve the next one without an iteration, until something changes.

#ifndef INELASTIC_REST_H
#define INELASTIC_REST_H

#include "projection.h"
#include "step.h"

#include "pointers.h"

namespace LAMMPS_NS {

class GhostExchange;

class Rest : protected Pointers {
 public:
  Rest(class LAMMPS *lmp, Step &step, GhostExchange &ranks);

  // The accuracy with which the next step is to be solved: the setting, or a finer one while it is being
  // found out whether what is left of the motion are errors of the solver.
  double accuracy() const { return part_of_accuracy_ * step_.settings.accuracy; }

  // Judges a step that is solved, and notes in it whether the scene is at rest. Collective.
  void judge(const inelastic::ProjectionResult &result);

 private:
  // What is left of the motion, on all ranks.
  struct Motion {
    // The largest velocity of a particle, as a part of the mean that particles would have without
    // contacts, or of what contacts have taken away from it, whichever is more.
    double fastest = 0.0;
    bool supported = false;    // some contact is with a wall or a frozen particle
    bool driven = false;       // some wall or frozen particle moves
  };

  Motion measure() const;
  bool find_out(const Motion &motion);
  void wake();

  Step &step_;
  GhostExchange &ranks_;
  bool at_rest_ = false;
  long quiet_steps_ = 0;    // in a row
  long patience_;           // quiet steps before it is found out whether the scene is at rest
  long finer_steps_ = 0;    // in which this is being found out
  double part_of_accuracy_ = 1.0;
};

}    // namespace LAMMPS_NS

#endif
