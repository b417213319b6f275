// This room takes the velocities of particles at rest away (inelastic_rest.h). The moving particles
// beside them were solved for with these velocities: they are projected once more, with the
// particles at rest as obstacles, so that nothing moves into these.

#ifndef INELASTIC_HOLD_STILL_H
#define INELASTIC_HOLD_STILL_H

#include "inelastic_solver.h"
#include "inelastic_step.h"

#include <functional>
#include <memory>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class GhostExchange;
class Movers;

class HoldStill {
 public:
  HoldStill(Step &step, GhostExchange &ranks, Movers &movers);

  // Changes velocities and impulses of the step, which is solved. The marks are one per particle,
  // those of ghosts are not read; of a body any marked member will do. `add_violated` adds
  // constraints that the step's velocities violate, and returns how many all ranks added; `excess`
  // finds the excess that they leave (StepState). Returns the number of iterations that it took.
  // Where the moving particles find no room, or would leave more excess, nothing is changed.
  // Collective.
  long run(const std::vector<char> &stopped, const std::function<long()> &add_violated,
           const std::function<double()> &excess);

 private:
  std::vector<char> with_ghosts(const std::vector<char> &stopped) const;
  inelastic::SolverResult project(const std::vector<char> &still);
  void turn_bodies();
  void note_stop();

  Step &step_;
  GhostExchange &ranks_;
  Movers &movers_;
  // Not the solver of the steps, which learns from them.
  std::unique_ptr<inelastic::Solver> solver_;
  inelastic::ContactProblem moving_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
