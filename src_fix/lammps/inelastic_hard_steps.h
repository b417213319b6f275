// Steps whose contacts are resolved worse than asked for: within EPS, but not to the accuracy. This
// room counts them, and ends the run where one comes after the other, since forces then say little.

#ifndef INELASTIC_HARD_STEPS_H
#define INELASTIC_HARD_STEPS_H

#include "inelastic_projection.h"
#include "inelastic_step.h"

#include "pointers.h"

#include <string>

namespace LAMMPS_NS::Inelastic_NS {

class Constraints;
class GhostExchange;

class HardSteps : protected Pointers {
 public:
  // Steps of a run.
  struct Counts {
    long shortened = 0;     // because they were not solved as long as they were
    long inaccurate = 0;    // in which the accuracy was not reached
    long at_maxiter = 0;    // that ended at maxiter before it was reached
  };

  HardSteps(class LAMMPS *lmp, const Step &step, const Constraints &constraints,
            GhostExchange &ranks);

  void begin_run() { counts_ = Counts{}; }
  void begin_step() { shortened_ = false; }
  const Counts &counts() const { return counts_; }

  // Tells whether a solution, though within EPS, leaves a good part unresolved of what a contact
  // changes.
  bool is_hardly_solved(const inelastic::ProjectionResult &result) const;

  // Notes that the step becomes shorter because it was not solved.
  void note_shortened() { shortened_ = true; }
  bool has_shortened() const { return shortened_; }

  // What masses, or which network, the contacts of the step are of, or that obstacles may leave no
  // room. Collective.
  std::string cause() const;
  // The same where masses in contacts with a force differ by so large a ratio; empty otherwise.
  // Collective.
  std::string of_masses(double ratio) const;

  // Tells whether walls or frozen spheres move. Collective.
  bool obstacles_move() const;

  // Notes how a step ends. Errors, with `maxiter ... warn` a warning: too many in a row could
  // hardly be solved, or ended at maxiter. Collective.
  void end_step(const inelastic::ProjectionResult &result);

 private:
  bool judges_accuracy() const;

  const Step &step_;
  const Constraints &constraints_;
  GhostExchange &ranks_;
  Counts counts_;
  bool shortened_ = false;          // this step
  long in_a_row_ = 0;               // hardly solved, or at maxiter, up to the last step
  bool any_at_maxiter_ = false;     // of these
  double most_unresolved_ = 0.0;    // of these
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
