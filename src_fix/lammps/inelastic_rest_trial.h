// This room solves a step as if the particles of some clusters that contacts hold had begun it at
// rest: what velocities they then have tells whether their contacts balance the forces on them. It
// is a trial, of which the step knows nothing until it is taken (inelastic_rest.h).

#ifndef INELASTIC_REST_TRIAL_H
#define INELASTIC_REST_TRIAL_H

#include "inelastic_solver.h"
#include "inelastic_step.h"

#include <memory>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class GhostExchange;
class Movers;

class RestTrial {
 public:
  RestTrial(Step &step, GhostExchange &ranks, Movers &movers);

  // What is tried: one mark per particle that is to begin the step with the velocity `common`
  // (3 per particle) [length / time], ghosts included, and one per constraint that is to be solved
  // more accurately.
  struct Begun {
    std::vector<char> particles;
    std::vector<double> common;
    std::vector<char> constraints;
  };

  // Begins the trials of a step: finds the velocities before its forces. Collective.
  void begin();

  // Solves the step so, to this part of the accuracy, from the impulses of its last trial, or from
  // its own. `least_length` is the least target (SolverLimits). Returns whether the targets were
  // reached in so many iterations. Collective.
  bool run(const Begun &begun, double refinement, double least_length, long most_iterations);
  long iterations() const { return iterations_; }    // since begin()

  // Exchanges the predicted velocities, the velocities and the impulses of the step with those of
  // the trial.
  void exchange();

  // By constraint, of those that the step had: the impulses of the trial.
  const std::vector<double> &impulse() const { return tried_.contacts.impulse; }
  // 3 per particle: the velocities before the forces of the step [length / time], and those with
  // which the trial would end without contacts.
  const std::vector<double> &velocity_before() const { return before_; }
  const std::vector<double> &predicted() const { return tried_.predicted_velocity; }
  // 3 per slot: those with which it ends.
  const std::vector<double> &velocity() const { return velocity_; }

 private:
  void set_up(const Begun &begun, double refinement);
  bool close_contacts(const Begun &begun);

  Step &step_;
  GhostExchange &ranks_;
  Movers &movers_;
  // Not the solver of the steps, which learns from them.
  std::unique_ptr<inelastic::Solver> solver_;
  inelastic::ContactProblem tried_;
  std::vector<double> velocity_, before_;
  long iterations_ = 0;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
