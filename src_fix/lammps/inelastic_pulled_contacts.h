// This room follows contacts that may pull to the end of the step: which gap they are to
// close.

#ifndef INELASTIC_PULLED_CONTACTS_H
#define INELASTIC_PULLED_CONTACTS_H

#include "inelastic_step.h"

namespace LAMMPS_NS::Inelastic_NS {

class PulledContacts {
 public:
  explicit PulledContacts(Step &step) : step_(step) {}

  // Rounds of a step that may change the gaps of constraints. Each one squares the error where a
  // body turns little; one that turns by a radian takes up to twenty.
  static constexpr int MOST_ROUNDS = 40;
  // The cosine of the angle, 60 degrees, by which a normal may turn in a step for its gap to be
  // made exact.
  static constexpr double LEAST_ALONG = 0.5;

  // The gap [length] that the constraint of an open contact takes for the present one: it counts as
  // under a force, whatever its last one was.
  double gap(const Contact &contact) const;

  // Sets the gap of constraint c, which may pull, so that the surfaces touch at the end of the
  // step: the exact gap there is `gap_at_end`, the velocities open the linearised one by `opening`
  // [length], and `along` is the cosine of the angle by which the normal turns. Surfaces that turn
  // about one another part, though their linearised gap stays; they are closed by no more than
  // most_closed(). Where they would overlap, at least the linearised gap is asked for, which is
  // never more than that of two spheres; where a push leaves open what an earlier round asked for,
  // the gap is that of the present end. Not for bad starts. Returns how many constraints changed.
  long follow(std::size_t c, double gap_at_end, double opening, double along);

 private:
  double most_closed(const Contact &contact) const;

  Step &step_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
