#include "solver.h"

#include <cmath>

namespace inelastic {

Residual residual(const double *gap_at_end, const ContactSet &contacts)
{
  Residual worst;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const double impulse = contacts.impulse[c], least = contacts.least[c];
    // A value that is no number satisfies no constraint.
    if (!std::isfinite(gap_at_end[c]) || !std::isfinite(impulse)) return UNSOLVED;
    worst.feasibility = std::max(worst.feasibility, -gap_at_end[c]);
    if (!(impulse > least)) continue;
    worst.complementarity = std::max(worst.complementarity, gap_at_end[c]);
    if (least < 0.0) worst.feasibility = std::max(worst.feasibility, gap_at_end[c]);
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

double target_residual(const SolverLimits &limits, const Guess &guess)
{
  if (limits.accuracy == 0.0) return limits.tolerance;
  // Lengths are known to a few units of round-off.
  constexpr double ROUND_OFF = 8.0 * std::numeric_limits<double>::epsilon();
  // Where contacts carry what they carried before, solving deeper is cheap, and a bed is quieter.
  constexpr double CARRIED = 0.1;
  const double changed = std::max(CARRIED * guess.mean_change, guess.residual.largest());
  return std::min(
      limits.tolerance,
      std::max({limits.accuracy * changed, ROUND_OFF * guess.largest_length, limits.least_target}));
}

Guess Solver::judge_first_guess(ContactProblem &problem, Host &host)
{
  std::vector<double> &impulse = problem.contacts.impulse;
  const std::vector<double> &least = problem.contacts.least;
  const std::vector<double> &free_gap = gap_operator_.free_gap();
  const std::size_t count = impulse.size();
  gap_.resize(count);
  diagonal_.resize(count);
  for (std::size_t c = 0; c < count; ++c) impulse[c] = std::max(least[c], impulse[c]);
  gap_operator_.apply(problem, impulse.data(), gap_.data(), host);
  const Residual mine = residual(gap_.data(), problem.contacts);
  Guess guess;
  double changes = 0.0, changing = 0.0, pulling = 0.0;
  for (std::size_t c = 0; c < count; ++c) {
    diagonal_[c] = problem.diagonal(c);
    const double change = std::abs(impulse[c]) * diagonal_[c];
    guess.along += impulse[c] * gap_[c];
    guess.along_free += impulse[c] * free_gap[c];
    guess.largest_length = std::max({guess.largest_length, std::abs(free_gap[c]), change});
    guess.largest_diagonal = std::max(guess.largest_diagonal, diagonal_[c]);
    changes += change;
    if (impulse[c] != 0.0) changing += 1.0;
    if (least[c] < 0.0) pulling = 1.0;
  }
  double sums[4] = {guess.along, guess.along_free, changes, changing};
  double maxima[5] = {mine.feasibility, mine.complementarity, guess.largest_length,
                      guess.largest_diagonal, pulling};
  host.reduce(sums, 4, maxima, 5);
  guess.along = sums[0];
  guess.along_free = sums[1];
  if (sums[3] > 0.0) guess.mean_change = sums[2] / sums[3];
  guess.residual = {maxima[0], maxima[1]};
  guess.largest_length = maxima[2];
  guess.largest_diagonal = maxima[3];
  guess.pulls = maxima[4] > 0.0;
  return guess;
}

void settle_for_tolerance(const SolverLimits &limits, double reached, SolverResult &result)
{
  const bool stopped_short = result.status == Status::OUT_OF_ITERATIONS ||
      result.status == Status::ROUND_OFF;
  if (!stopped_short || !(reached <= limits.tolerance)) return;
  result.status = Status::CONVERGED;
  result.target = reached;
}

}    // namespace inelastic
