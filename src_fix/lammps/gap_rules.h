// This room decides which gap a constraint asks for: at the start of a step, in a bad start, and where
// the end of the step differs from the linearised gap because bodies turn or walls curve.

#ifndef INELASTIC_GAP_RULES_H
#define INELASTIC_GAP_RULES_H

#include "overlap_watch.h"
#include "step.h"

namespace LAMMPS_NS {

class GapRules {
 public:
  GapRules(Step &step, OverlapWatch &overlaps) : step_(step), overlaps_(overlaps) {}

  // Rounds of a step that may change the gaps of constraints. Each one squares the error where a body
  // turns little; one that turns by a radian takes up to twenty.
  static constexpr int MAX_RELINEARISATIONS = 40;
  // The cosine of the angle, 60 degrees, by which a normal may turn in a step for its gap to be made exact.
  static constexpr double LEAST_ALONG = 0.5;

  // The gap [length] that the constraint takes for the present one, the wall's motion left out.
  double effective_gap(const Side &side) const;

  // Takes what is known of a contact of particles i and j, and makes it a spring if it is at rest, of the
  // compliance A_cc min(0.03, 30 accuracy, 0.3 tolerance / change of the last step). A_cc is the length by
  // which a unit impulse along the unit normal opens the gap [time / mass]. A bed of rigid contacts is held by
  // just as many as it needs: none can take over from another, a small error of any force lets some of them open, and
  // the bed hums. A spring changes its force by little where its gap changes by little. Its gap is zero
  // at the preload, the force when the contact came to rest, which slides where the force has changed
  // so much that the gap would leave the elastic range.
  void rest(Side &side, const ContactMemory::Contact &known, int i, int j,
            const double *normal) const;

  // The gap [length] of the constraint, the wall's motion and the preload in it (contact_set.h).
  double asked_gap(const Side &side) const;

  // The gap [length] at the end of the step for which the constraint is just met: negative where an overlap
  // need not be given back in one step, of which at most half a tolerance may be left.
  double wanted_gap(const Side &side) const;

  // Tells whether the end of the step is so deep that the constraint must change. The excess is noted as well:
  // what starts with a bad overlap may keep it, but not get deeper. It is asked for more, which costs no
  // shorter step where it is not to be had.
  bool ends_too_deep(const Side &side, double gap_at_end);

  // Sets the gap of constraint c to one that is exact for the present velocity, or to the linearised one
  // if that is smaller. One that was set for an earlier velocity is set again, so that no force keeps
  // apart what has moved on meanwhile, and the step does not depend on how it was found. Returns how many
  // constraints changed.
  long follow(std::size_t c, double exact_gap, bool too_deep);

  // Sets the gap of constraint c, which may hold, so that the surfaces touch at the end of the step: the exact
  // gap there is `gap_at_end`, the velocities open the linearised one by `opening` [length], and `along` is the
  // cosine of the angle by which the normal turns. Surfaces that turn about one another part, though their
  // linearised gap stays; they are closed by no more than most_closed(). Where they would overlap, at least the
  // linearised gap is asked for, which is never more than that of two spheres. Not for bad starts. Returns how
  // many constraints changed.
  long hold(std::size_t c, double gap_at_end, double opening, double along);

  // Lets constraints of free spheres that these velocities leave beyond the tolerance ask for their
  // present gap, as rigid contacts: what they asked for at the start went by what velocities of the last
  // step were resolved to, and those of this step may be known less well. Returns how many.
  long keep_within_tolerance(const std::vector<double> &velocity);

  // Makes all springs rigid, those of bodies, too, whose force has grown to more than twice that of the last
  // step, or whose gap would leave the elastic range. To be called on all ranks where a constraint of any
  // rank was not kept within the tolerance: in an impact on a bed, and where it is shaken, springs would give
  // way one after the other.
  void make_overloaded_rigid(const std::vector<double> &velocity);

  OverlapWatch &overlaps() { return overlaps_; }

 private:
  double contact_gap(const Side &side) const;
  double gap_by_law(const Side &side, const LawContact &contact) const;
  double held_gap(double gap, double predicted_speed) const;
  double most_closed(double predicted_speed) const;
  // [length] of constraint c with these velocities, along a straight line.
  double gap_at_end(std::size_t c, const std::vector<double> &velocity) const;

  Step &step_;
  OverlapWatch &overlaps_;
};

}    // namespace LAMMPS_NS

#endif
