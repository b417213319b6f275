// The constraints of a step, from pairs and from walls: those that matter from the start, and those
// that a solution shows to matter (the core's ConstraintSource).

#ifndef INELASTIC_CONSTRAINTS_H
#define INELASTIC_CONSTRAINTS_H

#include "inelastic_contact_rows.h"
#include "inelastic_entangled_bodies.h"
#include "inelastic_gap_rules.h"
#include "inelastic_overlap_watch.h"
#include "inelastic_pair_constraints.h"
#include "inelastic_phase_clock.h"
#include "inelastic_projection.h"
#include "inelastic_wall_constraints.h"
#include "inelastic_walls.h"

#include "pointers.h"

#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class Constraints final : public inelastic::ConstraintSource, protected Pointers {
 public:
  Constraints(class LAMMPS *lmp, Step &step, GhostExchange &ranks, PhaseClock &clock,
              const FirstGuesses &guesses, LawContacts &laws, Walls &walls, Movers &movers);

  bool walls_move() const { return walls_.any_moves(); }
  OverlapWatch &overlaps() { return overlaps_; }
  const OverlapWatch &overlaps() const { return overlaps_; }
  EntangledBodies &entangled() { return entangled_; }
  const GapRules &rules() const { return rules_; }
  void use(NeighList *list) { pairs_.use(list); }

  // At the start of a run: the margin is a part of the smallest radius [length].
  void begin_run(double smallest_radius);

  // Takes the constraints that can matter with the predicted velocities. Collective. Errors:
  // spheres that coincide, that meet their own image or that are beyond a wall, bodies that are not
  // all seen.
  void collect();

  // Adds what the velocities of the step violate, and follows the end of the step where bodies turn
  // or walls curve. Collective, same errors.
  inelastic::Refined refine(const std::vector<double> &velocity,
                            inelastic::ContactProblem &problem) override;

  // Adds what the velocities of the step violate. Returns how many constraints all ranks added.
  // Collective, same errors.
  long add_violated();

  // Finds the excess (StepState) that the velocities of the step leave; changes no constraint.
  // Collective.
  double excess();

  // The first tells whether gaps were set by the end of the step, the second whether the last solve
  // knew of such gaps.
  bool relinearised() const { return relinearised_; }
  bool solved_relinearised() const { return solved_relinearised_; }

  // This is called after a step: it takes more pairs at once when the last projection had to come
  // back for some, fewer otherwise. `reach` [length] is that of the neighbour list.
  void adapt_margin(double reach);

 private:
  bool need_relinearising() const;
  long relinearise();

  Step &step_;
  GhostExchange &ranks_;
  PhaseClock &clock_;
  Movers &movers_;
  Walls &walls_;
  OverlapWatch overlaps_;
  GapRules rules_;
  ContactRows rows_;
  EntangledBodies entangled_;
  PairConstraints pairs_;
  WallConstraints wall_constraints_;
  double margin_ = -1.0;    // [length] what comes nearer than this is in the problem from the start
  bool came_back_ = false;
  bool relinearised_ = false;
  bool solved_relinearised_ = false;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
