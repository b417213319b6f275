// This room decides which gap a constraint asks for: at the start of a step, in a bad start, and
// where the end of the step differs from the linearised gap because bodies turn or walls curve.

#ifndef INELASTIC_GAP_RULES_H
#define INELASTIC_GAP_RULES_H

#include "inelastic_first_guess.h"
#include "inelastic_overlap_watch.h"
#include "inelastic_step.h"

#include <array>
#include <optional>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class GapRules {
 public:
  GapRules(Step &step, OverlapWatch &overlaps) : step_(step), overlaps_(overlaps) {}

  // Rounds of a step that may change the gaps of constraints. Each one squares the error where a
  // body turns little; one that turns by a radian takes up to twenty.
  static constexpr int MAX_RELINEARISATIONS = 40;
  // The cosine of the angle, 60 degrees, by which a normal may turn in a step for its gap to be
  // made exact.
  static constexpr double LEAST_ALONG = 0.5;

  // The gap [length] that the constraint takes for the present one, the wall's motion left out.
  double effective_gap(const Contact &contact) const;

  // Takes what is remembered of the contact of slots i and j (inelastic_unknowns.h), and finds the
  // gap at which it is closed, and what it has to stop in this step: the length by which the two
  // approach one another without contacts, or a tenth of that by which the force opens the gap,
  // whichever is more. An overlap of up to 0.8 tolerances gives back at most the accuracy's part of
  // this length in a step, no more than the errors of velocities. A wall closes the gap by
  // `wall_motion` [length] in the step.
  void begin(Contact &contact, const FirstGuess &last, double wall_motion, int i, int j,
             const double *normal) const;

  // The gap [length] at the end of the step for which the constraint is just met: negative where an
  // overlap need not be given back in one step, and but for bad starts by at most half a tolerance.
  double wanted_gap(const Contact &contact) const;

  // Tells whether the end of the step is so deep that the constraint must change. Notes the excess,
  // too (StepState). A bad overlap may stay as deep as it began without an excess, though its
  // constraint asks for less: where less is not to be had, the step need not be shorter.
  bool ends_too_deep(const Contact &contact, double gap_at_end);

  // Sets the gap of constraint c to one that is exact for the present velocity, or to the
  // linearised one if that is smaller; approach() says how far it goes there in one round. A gap
  // that was set for an earlier velocity is set again, so that no force keeps surfaces apart that
  // have parted meanwhile, and the step does not depend on how it was found. Returns how many
  // constraints changed.
  long follow(std::size_t c, double exact_gap, bool too_deep);

  // Sets the gap of constraint c, which may hold, so that the surfaces touch at the end of the
  // step: the exact gap there is `gap_at_end`, the velocities open the linearised one by `opening`
  // [length], and `along` is the cosine of the angle by which the normal turns. Surfaces that turn
  // about one another part, though their linearised gap stays; they are closed by no more than
  // most_closed(). Where they would overlap, at least the linearised gap is asked for, which is
  // never more than that of two spheres. Not for bad starts. Returns how many constraints changed.
  long hold(std::size_t c, double gap_at_end, double opening, double along);

  // Changes constraints of free spheres whose gaps these velocities leave open, or overlapping, by
  // more than the tolerance, since gaps that count as closed may be open or overlap. Such a
  // constraint then asks for its present gap; where the two overlap, first for an overlap of most
  // of the tolerance at the end. Returns how many changed. Overlaps that are kept do not count: in
  // a dense start spheres jam for a moment, and cannot all be taken apart at once.
  long keep_within_tolerance(const std::vector<double> &velocity);

  // What constraint c asks for beyond its gap at the start of the step [length], because bodies
  // turn or walls curve.
  double closed_by_turning(std::size_t c) const;

  OverlapWatch &overlaps() { return overlaps_; }

 private:
  std::optional<std::array<double, 2>> load_changes(int i, int j) const;
  void approach(std::size_t c, double wanted);
  double closed_gap(const Contact &contact, double last, double most_closing) const;
  double contact_gap(const Contact &contact) const;
  double given_back(const Contact &contact) const;
  double most_given_back() const;
  double limited(const Contact &contact, double wanted) const;
  double held_gap(const Contact &contact) const;
  double most_closed(const Contact &contact) const;
  double deepest(const Contact &contact, double allowed) const;
  // [length] of constraint c with these velocities, along a straight line.
  double gap_at_end(std::size_t c, const std::vector<double> &velocity) const;

  Step &step_;
  OverlapWatch &overlaps_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
