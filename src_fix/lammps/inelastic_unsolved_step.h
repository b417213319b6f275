// A step that could not be solved: which constraint is farthest from being met, what is the cause,
// and what the user can do.

#ifndef INELASTIC_UNSOLVED_STEP_H
#define INELASTIC_UNSOLVED_STEP_H

#include "inelastic_projection.h"
#include "inelastic_push_apart.h"
#include "inelastic_step.h"

#include "pointers.h"

#include <string>

namespace LAMMPS_NS::Inelastic_NS {

class Constraints;
class GhostExchange;
class HardSteps;
class Movers;

class UnsolvedStep : protected Pointers {
 public:
  UnsolvedStep(class LAMMPS *lmp, const Step &step, const Constraints &constraints,
               const HardSteps &hard, GhostExchange &ranks, const Movers &movers);

  // At the start of a step, and of every trial of it with another time step.
  void begin_step()
  {
    no_room_ = false;
    named_.clear();
    named_last_.clear();
  }
  void begin_trial()
  {
    if (!named_.empty()) named_last_ = named_;
    named_.clear();
    worst_ = -1.0;
  }

  // Notes the constraint of all ranks that is farthest from being met, in any projection of the
  // trial. Collective.
  void note_worst(const inelastic::ProjectionResult &result);
  const std::string &named() const { return named_; }

  // Notes that it is certain that there are no velocities for the step as long as it was.
  void note_no_room() { no_room_ = true; }

  // Tells whether the contact law asks surfaces to part, which perhaps cannot all do so in so long
  // a step. Collective.
  bool law_parts() const;

  // Stops the run, or warns where the keyword maxiter allows it. Collective.
  void report(const inelastic::ProjectionResult &result);
  // The same for overlaps that a push no longer opens.
  void report_jam(const PushApart::Left &left);
  // The same for contacts that add so many times as much kinetic energy as they may.
  void report_energy(double times);

 private:
  std::string no_room(const inelastic::ProjectionResult &result, std::string &cause) const;
  std::string out_of_iterations(const inelastic::ProjectionResult &result,
                                std::string &cause) const;
  double largest_angle() const;
  // The names of the worst constraint of the trial, or of the last one that had one.
  const std::string &named_or_last() const { return named_.empty() ? named_last_ : named_; }

  const Step &step_;
  const Constraints &constraints_;
  const HardSteps &hard_;
  GhostExchange &ranks_;
  const Movers &movers_;
  double worst_ = -1.0;               // [length] what the named one leaves
  std::string named_, named_last_;    // of the trial, and of the last one that had one
  bool no_room_ = false;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
