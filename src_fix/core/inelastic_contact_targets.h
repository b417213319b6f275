// The accuracy to which each contact is resolved, which belongs to the contact and not to the
// scene.
//
// A search for the impulses ends when the residual of every contact (inelastic_solver.h) is at most
// its target
//
//   t_c = min(tolerance, max(round-off, A/16 max(v_c, r_c, l_c / 50000)))     [length]
//
//   v_c = min over its particles that can move of max(s_i, n_i)
//
// for contact c, with the accuracy A. Of particle i
//
// - s_i is h times the change of its velocity by all of its contacts together. At rest that is what
//   its forces would give it, whatever it carries: its weight alone, under a column as well as on
//   top;
// - n_i is the part of it that this search has added to the first guess: what is new. In a chain
//   that is hit at one end the targets so follow the impact.
//
// Of contact c
//
// - r_c is the residual of the first guess: for two spheres that meet, by how much they would
//   overlap; of a constraint that was added since the residual when it was;
// - l_c is the length by which the contact's own impulse of the first guess would open its gap if
//   its sides were as heavy as the heaviest of the scene. Where forces balance they change no
//   velocity, v_c is near zero, and l_c alone says what is small. (The sides' own masses would say
//   too much: under a heavy particle light ones would move far by impulses that move nothing.)
//
// Changes of velocity are those of the present impulses. Contacts of bodies have A/48. A contact
// whose refinement (inelastic_contact_set.h) is below 1 has that part of A.

#pragma once

#include "inelastic_contact_problem.h"
#include "inelastic_gap_operator.h"
#include "inelastic_host.h"
#include "inelastic_refined.h"

#include <vector>

namespace inelastic {

struct SolverLimits;

class ContactTargets {
 public:
  // Takes the first guess: the operator was last applied to it, and `gap` are its gaps at the end
  // of the step. `diagonal` is that of A, one number per constraint as well, and the inverse mass
  // [1 / mass] that of the heaviest that can move.
  void begin(const ContactProblem &problem, const GapOperator &gap_operator,
             const std::vector<double> &gap, const std::vector<double> &diagonal,
             double least_inverse_mass);

  // Takes a problem that was judged last when it was solved, and was then refined: its new
  // constraints, and those whose gap has changed, have these gaps now, where the search goes on.
  // Sets least() and part() of these. Returns the residual of this rank.
  Residual go_on(const ContactProblem &problem, const Refined &refined, const SolverLimits &limits,
                 const GapOperator &gap_operator, const std::vector<double> &gap,
                 const std::vector<double> &diagonal, double least_inverse_mass);

  // Sets the targets for the present impulses, to which the operator was last applied. Returns the
  // largest residual as a part of its target, over all ranks; infinity if a number is not finite.
  // Collective.
  double judge(const ContactProblem &problem, const SolverLimits &limits,
               const GapOperator &gap_operator, const std::vector<double> &gap, Host &host);

  // Does the same for the feasibility alone (inelastic_solver.h), to which Uzawa's method looks.
  double judge_feasibility(const ContactProblem &problem, const SolverLimits &limits,
                           const GapOperator &gap_operator, const std::vector<double> &gap,
                           Host &host);

  // The functions below give what the last judge() has found.
  // The residual (inelastic_solver.h) over all ranks.
  const Residual &residual() const { return residual_; }
  // [length] The lower bound of each target, whatever the changes of velocity are.
  const std::vector<double> &least() const { return least_; }
  // The factor from a length h |change of velocity| to a target: A/16, or A/48, times the
  // refinement.
  const std::vector<double> &part() const { return part_; }
  // [length / time] The changes of velocity by the first guess, 3 per slot.
  const std::vector<double> &change_by_guess() const { return change_by_guess_; }
  // [length] The targets, without the tolerance as their upper bound.
  const std::vector<double> &resolved() const { return resolved_; }
  // [length] The largest target of a constraint with impulse, or near it, on all ranks.
  double largest() const { return largest_; }
  // The largest residual, over all ranks, as a part of the lengths v_c, r_c and l_c of its
  // constraint, and of round-off; 0 without an accuracy.
  double unresolved() const { return unresolved_; }

 private:
  enum class Counts { ALL, FEASIBILITY };    // of the residuals

  double judge(const ContactProblem &problem, const SolverLimits &limits,
               const GapOperator &gap_operator, const std::vector<double> &gap, Counts counts,
               Host &host);
  double of_guess(const ContactProblem &problem, const std::vector<double> &gap, std::size_t c,
                  double least_inverse_mass) const;
  void find_lengths(const ContactProblem &problem);
  void set_least(const ContactProblem &problem, const SolverLimits &limits,
                 const GapOperator &gap_operator, std::size_t c);

  std::vector<double> diagonal_;
  std::vector<double> of_guess_;    // [length] max(r_c, l_c / 50000)
  std::vector<double> change_by_guess_;
  std::vector<double> least_, part_, resolved_;
  // [length] per slot: the impulses on it, and with its own motion, for the round-off
  std::vector<double> carried_, length_;
  std::vector<double> changed_;    // [length] per slot that can move: max(s_i, n_i)
  Residual residual_;
  double largest_ = 0.0, unresolved_ = 0.0;
};

}    // namespace inelastic
