// This room writes what the log says about a run when it has ended.

#ifndef INELASTIC_RUN_SUMMARY_H
#define INELASTIC_RUN_SUMMARY_H

#include "inelastic_energy_watch.h"
#include "inelastic_hard_steps.h"
#include "inelastic_phase_clock.h"
#include "inelastic_projection.h"
#include "inelastic_push_apart.h"
#include "inelastic_step.h"
#include "inelastic_unrest.h"

#include "pointers.h"

namespace LAMMPS_NS::Inelastic_NS {

class RunSummary : protected Pointers {
 public:
  RunSummary(class LAMMPS *lmp, const Step &step, PhaseClock &clock);

  // `shortened_steps` counts from the definition of the fix on.
  void begin(long shortened_steps);

  // A solve took so many iterations with the constraints of the step.
  void add_solve(long iterations);
  void add_step(const inelastic::ProjectionResult &result);
  void add_unconverged() { ++unconverged_; }

  // Collective.
  void log(long shortened_steps, long unexpected_steps, const HardSteps::Counts &hard,
           const PushApart::Left &left, const EnergyWatch &energy, const Unrest &unrest) const;

 private:
  void log_overlaps(long unexpected_steps, const PushApart::Left &left) const;
  void log_given_back(const EnergyWatch &energy) const;
  void log_hard_steps(const HardSteps::Counts &hard) const;
  void log_unrest(const Unrest &unrest) const;
  void log_times() const;

  const Step &step_;
  PhaseClock &clock_;
  long steps_ = 0, unconverged_ = 0, shortened_before_ = 0;
  // Bad starts were pushed apart in so many steps: in those with which the run began, and in later
  // ones.
  long pushed_at_start_ = 0, pushed_later_ = 0;
  long at_rest_ = 0, waited_ = 0;
  double iterations_ = 0.0;
  double constraint_iterations_ = 0.0;    // constraints of this rank, once for each iteration
  double overlap_of_start_ = 0.0;         // [length] the largest of those steps
  double largest_overlap_ = 0.0;          // [length] of the other steps
  double largest_excess_ = 0.0;           // [length]
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
