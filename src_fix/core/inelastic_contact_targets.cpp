#include "inelastic_contact_targets.h"

#include "inelastic_solver_limits.h"
#include "inelastic_target_formula.h"
#include "inelastic_vector3.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace inelastic {

namespace {

  // In a bed of many contacts residuals make velocities of some hundred times their size, in a
  // chain of n up to n times (which inelastic_settling.h looks at).
  constexpr double IN_NETWORKS = 1.0 / 16.0;
  // Bodies turn, too: the softest motions of their networks are softer.
  constexpr double OF_BODIES = 1.0 / 48.0;
  // The part of the length by which a contact's own impulse opens its gap, to which the contact is
  // resolved even where that impulse, balanced by others, changes no velocity.
  constexpr double PART_OF_LOAD = 2.0e-5;
  // Gaps are known to a few units of round-off of what they are added up from.
  constexpr double ROUND_OFF = 8.0 * std::numeric_limits<double>::epsilon();

  // The slot that stands for all those that move together with this one.
  int grain(const Unknowns &unknowns, int i)
  {
    const RigidBodies &bodies = unknowns.bodies;
    return unknowns.is_member(i) ? bodies.member[bodies.start[bodies.body[i]]] : i;
  }

}    // namespace

void ContactTargets::begin(const ContactProblem &problem, const GapOperator &gap_operator,
                           const std::vector<double> &gap, const std::vector<double> &diagonal,
                           double least_inverse_mass)
{
  const ContactSet &contacts = problem.contacts;
  diagonal_ = diagonal;
  change_by_guess_ = gap_operator.change();
  of_guess_.resize(contacts.size());
  for (std::size_t c = 0; c < contacts.size(); ++c)
    of_guess_[c] = of_guess(problem, gap, c, least_inverse_mass);
}

double ContactTargets::of_guess(const ContactProblem &problem, const std::vector<double> &gap,
                                std::size_t c, double least_inverse_mass) const
{
  const ContactSet &contacts = problem.contacts;
  const double lighter = std::max(problem.inverse_mass_of(contacts.first[c]),
                                  problem.inverse_mass_of(contacts.second[c]));
  const double load = contacts.magnitude(c) * diagonal_[c] * (least_inverse_mass / lighter);
  return std::max(contacts.residual(c, gap.data()).largest(), PART_OF_LOAD * load);
}

Residual ContactTargets::go_on(const ContactProblem &problem, const Refined &refined,
                               const SolverLimits &limits, const GapOperator &gap_operator,
                               const std::vector<double> &gap, const std::vector<double> &diagonal,
                               double least_inverse_mass)
{
  const std::size_t known = of_guess_.size();
  diagonal_.insert(diagonal_.end(), diagonal.begin() + static_cast<std::ptrdiff_t>(known),
                   diagonal.end());
  for (std::vector<double> *const of_contacts : {&of_guess_, &least_, &part_, &resolved_})
    of_contacts->resize(gap.size(), 0.0);
  Residual worst = residual_;
  const auto look = [&](std::size_t c) {
    of_guess_[c] = std::max(of_guess_[c], of_guess(problem, gap, c, least_inverse_mass));
    set_least(problem, limits, gap_operator, c);
    const Residual here = problem.contacts.residual(c, gap.data());
    worst.feasibility = std::max(worst.feasibility, here.feasibility);
    worst.complementarity = std::max(worst.complementarity, here.complementarity);
  };
  for (const ChangedGap &changed : refined.gaps) look(changed.constraint);
  for (std::size_t c = known; c < gap.size(); ++c) look(c);
  return worst;
}

// Finds of what round-off is a part.
void ContactTargets::find_lengths(const ContactProblem &problem)
{
  const ContactSet &contacts = problem.contacts;
  carried_.assign(problem.slots(), 0.0);
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const double load = contacts.magnitude(c) * diagonal_[c];
    if (load == 0.0) continue;
    carried_[grain(problem, contacts.first[c])] += load;
    carried_[grain(problem, contacts.second[c])] += load;
  }
  for (int slot = problem.particles; slot < problem.slots(); ++slot)
    if (!problem.is_mobile(slot)) carried_[slot] = 0.0;
  const double *const v = problem.predicted_velocity.data();
  length_.resize(carried_.size());
  for (std::size_t i = 0; i < length_.size(); ++i)
    length_[i] = carried_[grain(problem, static_cast<int>(i))] + problem.timestep * norm(v + 3 * i);
}

// Sets what the target of a contact takes of it, whatever the changes of velocity are.
void ContactTargets::set_least(const ContactProblem &problem, const SolverLimits &limits,
                               const GapOperator &gap_operator, std::size_t c)
{
  const ContactSet &contacts = problem.contacts;
  if (limits.accuracy == 0.0) {
    least_[c] = limits.tolerance;
    part_[c] = 0.0;
    return;
  }
  const bool of_bodies = !problem.bodies.empty() &&
      (problem.is_member(contacts.first[c]) || problem.is_member(contacts.second[c]));
  part_[c] = (of_bodies ? OF_BODIES : IN_NETWORKS) * limits.accuracy * limits.coarseness *
      contacts.refinement[c];
  const double length = std::abs(gap_operator.free_gap()[c]) + length_[contacts.first[c]] +
      length_[contacts.second[c]];
  least_[c] = std::max({ROUND_OFF * length, limits.least_length,
                        std::numeric_limits<double>::epsilon() * limits.tolerance,
                        part_[c] * of_guess_[c]});
}

double ContactTargets::judge(const ContactProblem &problem, const SolverLimits &limits,
                             const GapOperator &gap_operator, const std::vector<double> &gap,
                             Host &host)
{ return judge(problem, limits, gap_operator, gap, Counts::ALL, host); }

double ContactTargets::judge_feasibility(const ContactProblem &problem, const SolverLimits &limits,
                                         const GapOperator &gap_operator,
                                         const std::vector<double> &gap, Host &host)
{ return judge(problem, limits, gap_operator, gap, Counts::FEASIBILITY, host); }

double ContactTargets::judge(const ContactProblem &problem, const SolverLimits &limits,
                             const GapOperator &gap_operator, const std::vector<double> &gap,
                             Counts counts, Host &host)
{
  const ContactSet &contacts = problem.contacts;
  const std::vector<double> &change = gap_operator.change();
  constexpr double NEAR = 5.0;    // tolerances
  if (limits.accuracy > 0.0) find_lengths(problem);
  constexpr double NONE = std::numeric_limits<double>::max();
  changed_.assign(problem.slots(), NONE);
  for (std::size_t i = 0; limits.accuracy > 0.0 && i < changed_.size(); ++i) {
    if (!problem.is_mobile(static_cast<int>(i))) continue;
    const double *const now = &change[3 * i], *const before = &change_by_guess_[3 * i];
    const double added[3] = {now[0] - before[0], now[1] - before[1], now[2] - before[2]};
    changed_[i] = problem.timestep * std::max(norm(now), norm(added));
  }
  // The largest part of a target, the largest target, the largest part that is unresolved, and the
  // residual.
  double maxima[5] = {0.0, 0.0, 0.0, 0.0, 0.0};
  for (std::vector<double> *const of_contacts : {&least_, &part_, &resolved_})
    of_contacts->resize(contacts.size());
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    set_least(problem, limits, gap_operator, c);
    const double by_velocity =
        part_[c] * std::min(changed_[contacts.first[c]], changed_[contacts.second[c]]);
    double target;
    find_free_target(by_velocity, least_[c], resolved_[c]);
    bound_target(resolved_[c], limits.tolerance, target);
    const Residual residual = contacts.residual(c, gap.data());
    const double left = counts == Counts::ALL ? residual.largest() : residual.feasibility;
    // Most constraints are met as they are.
    if (left != 0.0) {
      maxima[0] = std::max(maxima[0], left / target);
      maxima[2] = std::max(maxima[2], part_[c] * left / resolved_[c]);
    }
    maxima[3] = std::max(maxima[3], residual.feasibility);
    maxima[4] = std::max(maxima[4], residual.complementarity);
    if (contacts.is_loaded(c) || gap[c] < NEAR * limits.tolerance)
      maxima[1] = std::max(maxima[1], target);
  }
  host.reduce(nullptr, 0, maxima, 5);
  largest_ = maxima[1];
  unresolved_ = maxima[2];
  residual_ = {maxima[3], maxima[4]};
  return maxima[0];
}

}    // namespace inelastic
