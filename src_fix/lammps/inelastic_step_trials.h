// This room solves a step, whose length may become shorter on the way: trial after trial, until one
// is solved and moves nothing too far.

#ifndef INELASTIC_STEP_TRIALS_H
#define INELASTIC_STEP_TRIALS_H

#include "inelastic_energy_watch.h"
#include "inelastic_hard_steps.h"
#include "inelastic_problem_record.h"
#include "inelastic_projection.h"
#include "inelastic_push_apart.h"
#include "inelastic_squeezed_grains.h"
#include "inelastic_unsolved_step.h"

#include <functional>
#include <memory>

namespace LAMMPS_NS::Inelastic_NS {

class Constraints;
class PhaseClock;
class RunSummary;
class StepLength;

class StepTrials : protected Pointers {
 public:
  // `predict` sets up the problem of the step at its present length, with the velocities that it
  // would end with without contacts.
  StepTrials(class LAMMPS *lmp, Step &step, Constraints &constraints, StepLength &length,
             Movers &movers, GhostExchange &ranks, RunSummary &summary, PhaseClock &clock,
             std::function<void()> predict);

  // At the start of a run, and where its summary begins to count.
  void begin_run() { squeezed_.begin_run(); }
  void begin_summary();

  // Finds the velocities of the step. Collective. Errors: it is not solved, or adds energy, and
  // nothing that is tried helps; and those of Constraints and StepLength.
  inelastic::ProjectionResult solve();

  // Solves the step once more, from its solution, where contacts are to be known better. Returns
  // whether it is solved. Collective, same errors.
  bool refine(inelastic::ProjectionResult &result);

  // Lengths below it are round-off of positions [length].
  double least_length() const;

  // Notes how the step ends, and warns. Collective.
  void end_step(const inelastic::ProjectionResult &result);

  const HardSteps::Counts &counts() const { return hard_.counts(); }
  const PushApart &push_apart() const { return push_apart_; }
  const EnergyWatch &energy() const { return energy_; }

 private:
  // Why a step begins again.
  enum class Again {
    NO,
    KEEPS_OVERLAPS,    // beside bad overlaps, which may leave no room, or does so no longer
    WAITS,             // it has no room for what overlaps give back
    UNSOLVED,          // shorter: it is not solved, or hardly
    ADDS_ENERGY,       // shorter: contacts add more energy than they may
    LAW_ADDS,          // shorter: so do surfaces that part
    TOO_FAR            // shorter: something moves too far, or ends too deep
  };

  Again try_once(inelastic::ProjectionResult &result);
  Again judge(inelastic::ProjectionResult &result);
  inelastic::ProjectionResult project(long max_iterations, bool to_targets = false);
  void record(const inelastic::ProjectionResult &result);
  void push(inelastic::ProjectionResult &result);
  void look_for_squeezed(bool solved);
  void waits_for_room();
  bool halves(bool law_parts);
  bool adds_too_much(inelastic::ProjectionResult &result);

  Step &step_;
  Constraints &constraints_;
  StepLength &length_;
  std::function<void()> predict_;
  GhostExchange &ranks_;
  RunSummary &summary_;
  PhaseClock &clock_;
  std::unique_ptr<inelastic::Solver> solver_;
  PushApart push_apart_;
  HardSteps hard_;
  EnergyWatch energy_;
  UnsolvedStep unsolved_;
  SqueezedGrains squeezed_;
  ProblemRecord record_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
