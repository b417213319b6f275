#include "solver.h"

#include <cmath>

namespace inelastic {

Residual residual(const double *gap_at_end, const ContactSet &contacts)
{
  Residual worst;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const double impulse = contacts.impulse[c];
    const HalfLine<double> set = contacts.set[c];
    // A value that is no number satisfies no constraint.
    if (!std::isfinite(gap_at_end[c]) || !std::isfinite(impulse)) return UNSOLVED;
    worst.feasibility = std::max(worst.feasibility, -gap_at_end[c]);
    if (!set.is_loaded(impulse)) continue;
    worst.complementarity = std::max(worst.complementarity, gap_at_end[c]);
    if (set.may_pull()) worst.feasibility = std::max(worst.feasibility, gap_at_end[c]);
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

Guess Solver::judge_first_guess(ContactProblem &problem, const SolverLimits &limits, Host &host)
{
  std::vector<double> &impulse = problem.contacts.impulse;
  const std::vector<HalfLine<double>> &set = problem.contacts.set;
  const std::vector<double> &free_gap = gap_operator_.free_gap();
  const std::size_t count = impulse.size();
  gap_.resize(count);
  diagonal_.resize(count);
  for (std::size_t c = 0; c < count; ++c) impulse[c] = set[c].project(impulse[c]);
  gap_operator_.apply(problem, impulse.data(), gap_.data(), host);
  const Residual mine = residual(gap_.data(), problem.contacts);
  Guess guess;
  for (std::size_t c = 0; c < count; ++c) {
    diagonal_[c] = problem.diagonal(c);
    guess.largest_length = std::max(
        {guess.largest_length, std::abs(free_gap[c]), std::abs(impulse[c]) * diagonal_[c]});
    guess.largest_diagonal = std::max(guess.largest_diagonal, diagonal_[c]);
  }
  double maxima[4] = {mine.feasibility, mine.complementarity, guess.largest_length,
                      guess.largest_diagonal};
  host.reduce(nullptr, 0, maxima, 4);
  guess.residual = {maxima[0], maxima[1]};
  guess.largest_length = maxima[2];
  guess.largest_diagonal = maxima[3];
  targets_.begin(problem, limits, gap_operator_, gap_, diagonal_);
  return guess;
}

void settle_for_tolerance(const SolverLimits &limits, double reached, SolverResult &result)
{
  const bool stopped_short = result.status == Status::OUT_OF_ITERATIONS ||
      result.status == Status::ROUND_OFF;
  if (!stopped_short || !(reached <= limits.tolerance)) return;
  result.status = Status::CONVERGED;
}

}    // namespace inelastic
