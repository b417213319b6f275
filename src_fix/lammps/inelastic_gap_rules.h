// This room decides which gap a constraint asks for: at the start of a step, in a bad start, and
// where the end of the step differs from the linearised gap because bodies turn or walls curve.

#ifndef INELASTIC_GAP_RULES_H
#define INELASTIC_GAP_RULES_H

#include "inelastic_first_guess.h"
#include "inelastic_overlap_watch.h"
#include "inelastic_pulled_contacts.h"
#include "inelastic_refined.h"
#include "inelastic_step.h"

#include <array>
#include <optional>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class GapRules {
 public:
  GapRules(Step &step, OverlapWatch &overlaps) : step_(step), pulled_(step), overlaps_(overlaps) {}

  // As for pulled contacts (inelastic_pulled_contacts.h).
  static constexpr int MAX_RELINEARISATIONS = PulledContacts::MOST_ROUNDS;
  static constexpr double LEAST_ALONG = PulledContacts::LEAST_ALONG;

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

  double most_pushed(const Contact &contact) const;

  // Notes by how much a contact ends the step deeper than it may (the excess of StepState). The
  // constraint of a bad overlap asks for less than there is; one that stays as deep as it began has
  // no excess nevertheless, since a shorter step would not open it either.
  void note_end(const Contact &contact, double gap_at_end);

  // Tells whether the end of the step is so deep that the constraint must change.
  bool ends_too_deep(const Contact &contact, double gap_at_end) const;

  // Sets the gap of constraint c to the smaller one of its linearised gap and `exact_gap`, which is
  // exact for the present velocity; approach() says how far it goes there in one round. This holds
  // for a gap that an earlier round has set, too: surfaces that have parted since then are not kept
  // apart by a force, and the step does not depend on the way to its solution. Returns how many
  // constraints changed.
  long follow(std::size_t c, double exact_gap, bool too_deep);

  // Sets the gap of constraint c back to that of the start of the step if its contact may pull and
  // its gap was set by the end of a round (inelastic_pulled_contacts.h): the wall there has since
  // got another plane, and the gap was that of another motion.
  void stop_following_pulled(std::size_t c);

  // Changes constraints of free spheres whose gaps these velocities leave open, or overlapping, by
  // more than the tolerance, since gaps that count as closed may be open or overlap. Such a
  // constraint then asks for its present gap; where the two overlap, first for an overlap of most
  // of the tolerance at the end. Overlaps that are kept do not count: in a dense start spheres jam
  // for a moment, and cannot all be taken apart at once.
  void keep_within_tolerance(const std::vector<double> &velocity, inelastic::Refined &refined);

  // What constraint c asks for beyond its gap at the start of the step [length], because bodies
  // turn or walls curve.
  double closed_by_turning(std::size_t c) const;

  PulledContacts &pulled() { return pulled_; }
  OverlapWatch &overlaps() { return overlaps_; }

 private:
  std::optional<std::array<double, 2>> load_changes(int i, int j) const;
  void approach(std::size_t c, double wanted);
  double closed_gap(const Contact &contact, double last, double most_closing) const;
  double contact_gap(const Contact &contact) const;
  double given_back(const Contact &contact) const;
  double most_given_back() const;
  double limited(const Contact &contact, double wanted) const;
  double bad_kept(const Contact &contact) const;
  double deepest(const Contact &contact, double allowed) const;
  // [length] of constraint c with these velocities, along a straight line.
  double gap_at_end(std::size_t c, const std::vector<double> &velocity) const;

  Step &step_;
  PulledContacts pulled_;
  OverlapWatch &overlaps_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
