#include "inelastic_solver.h"

#include <cmath>
#include <cstddef>

namespace inelastic {

Residual residual(const double *gap_at_end, const ContactSet &contacts)
{
  Residual worst;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const Residual here = contacts.residual(c, gap_at_end);
    worst.feasibility = std::max(worst.feasibility, here.feasibility);
    worst.complementarity = std::max(worst.complementarity, here.complementarity);
  }
  return worst;
}

Residual residual_over_ranks(const double *gap_at_end, const ContactSet &contacts, Host &host)
{
  const Residual mine = residual(gap_at_end, contacts);
  double maxima[2] = {mine.feasibility, mine.complementarity};
  host.reduce(nullptr, 0, maxima, 2);
  return {maxima[0], maxima[1]};
}

Network find_network(const ContactProblem &problem, Host &host)
{
  const ContactSet &contacts = problem.contacts;
  // 2 per slot: 1, and how many contacts act on it. Summed up over its images the first is the
  // number of these.
  std::vector<double> of_slot(2 * static_cast<std::size_t>(problem.slots()), 0.0);
  for (std::size_t i = 0; i < of_slot.size(); i += 2) of_slot[i] = 1.0;
  Network network;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    if (!contacts.is_loaded(c)) continue;
    network.contacts += 1.0;
    for (const int slot : {contacts.first[c], contacts.second[c]})
      of_slot[2 * static_cast<std::size_t>(slot) + 1] += 1.0;
  }
  host.sum_over_ghosts(of_slot.data(), 2);
  for (int i = 0; i < problem.particles; ++i) {
    const double *const of_particle = &of_slot[2 * static_cast<std::size_t>(i)];
    if (problem.is_mobile(i) && of_particle[1] > 0.0) network.particles += 1.0 / of_particle[0];
  }
  double sums[2] = {network.contacts, network.particles};
  host.reduce(sums, 2, nullptr, 0);
  return {sums[0], sums[1]};
}

Guess Solver::judge_first_guess(ContactProblem &problem, Host &host)
{
  ContactSet &contacts = problem.contacts;
  const std::vector<double> &free_gap = gap_operator_.free_gap();
  const std::size_t count = contacts.size();
  gap_.resize(count);
  diagonal_.resize(count);
  contacts.make_admissible();
  gap_operator_.apply(problem, contacts.impulse.data(), gap_.data(), host);
  const Residual mine = residual(gap_.data(), contacts);
  Guess guess;
  for (std::size_t c = 0; c < count; ++c) {
    diagonal_[c] = problem.diagonal(c);
    guess.largest_length = std::max(
        {guess.largest_length, std::abs(free_gap[c]), contacts.magnitude(c) * diagonal_[c]});
    guess.largest_diagonal = std::max(guess.largest_diagonal, diagonal_[c]);
  }
  constexpr double NONE = std::numeric_limits<double>::max();
  double least = NONE, most = 0.0;
  for (const std::vector<int> *const sides : {&contacts.first, &contacts.second})
    for (const int slot : *sides) {
      const double inverse_mass = problem.inverse_mass_of(slot);
      if (inverse_mass > 0.0) least = std::min(least, inverse_mass);
      most = std::max(most, inverse_mass);
    }
  double maxima[6] = {mine.feasibility,
                      mine.complementarity,
                      guess.largest_length,
                      guess.largest_diagonal,
                      -least,
                      most};
  host.reduce(nullptr, 0, maxima, 6);
  guess.residual = {maxima[0], maxima[1]};
  guess.largest_length = maxima[2];
  guess.largest_diagonal = maxima[3];
  guess.least_inverse_mass = -maxima[4];
  guess.largest_inverse_mass = maxima[5];
  targets_.begin(problem, gap_operator_, gap_, diagonal_, guess.least_inverse_mass);
  return guess;
}

void Solver::judge_refined(ContactProblem &problem, const Refined &refined,
                           const SolverLimits &limits, Guess &guess)
{
  ContactSet &contacts = problem.contacts;
  const std::size_t known = gap_.size();
  contacts.forget_impulses(known);
  gap_operator_.refine(problem, refined, gap_);
  for (std::size_t c = known; c < contacts.size(); ++c) diagonal_.push_back(problem.diagonal(c));
  guess.residual = targets_.go_on(problem, refined, limits, gap_operator_, gap_, diagonal_,
                                  guess.least_inverse_mass);
}

void settle_for_tolerance(const SolverLimits &limits, double reached, SolverResult &result)
{
  const bool stopped_short = result.status == Status::OUT_OF_ITERATIONS ||
      result.status == Status::ROUND_OFF;
  if (!stopped_short || !(reached <= limits.tolerance)) return;
  result.status = Status::CONVERGED;
}

}    // namespace inelastic
