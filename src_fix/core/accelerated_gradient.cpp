#include "accelerated_gradient.h"

#include "infeasibility.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace inelastic {

namespace {

  constexpr double UNIT_ROUND_OFF = 0.5 * std::numeric_limits<double>::epsilon();

  // Returns whether round-off, a few 1e-7 of the largest length in single precision, is far below
  // the tolerance. Double precision is the best there is.
  template <typename Real> bool suffices(double largest_length, double tolerance)
  {
    constexpr double MOST_TOLERANCES = 3.0e5;
    return sizeof(Real) == sizeof(double) || largest_length < MOST_TOLERANCES * tolerance;
  }

  // Nesterov's momentum is beta_k = (t_k - 1) / t_(k+1) with t_1 = 1 and
  // t_(k+1) = (1 + sqrt(1 + 4 t_k^2)) / 2.
  class Momentum {
   public:
    double value() const { return value_; }

    void restart()
    {
      value_ = 0.0;
      time_ = 1.0;
    }

    void grow()
    {
      const double next_time = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * time_ * time_));
      value_ = (time_ - 1.0) / next_time;
      time_ = next_time;
    }

   private:
    double value_ = 0.0;
    double time_ = 1.0;    // t
  };

  packed::Passed over_ranks(const packed::Passed &mine, Host &host)
  {
    double sums[3] = {mine.uphill, mine.change_squared, mine.curved};
    double maxima[3] = {-mine.least_gap, mine.most_under_force, mine.heaviest};
    host.reduce(sums, 3, maxima, 3);
    packed::Passed all;
    all.uphill = sums[0];
    all.change_squared = sums[1];
    all.curved = sums[2];
    all.least_gap = -maxima[0];
    all.most_under_force = maxima[1];
    all.heaviest = maxima[2];
    return all;
  }

}    // namespace

// The first guess lambda is judged and scaled by these numbers, which are over all ranks.
struct AcceleratedProjectedGradient::FirstGuess {
  Residual residual;
  double along;               // lambda . w(lambda)
  double along_free;          // lambda . w(0)
  double largest_length;      // largest |w_c(0)| or D_c lambda_c
  double largest_diagonal;    // largest D_c

  // The guess is first made as large as the dual function likes it along its own direction. This
  // costs no product with A, since w is affine: the minimum over s of the dual function at s lambda
  // is at s = -lambda . w(0) / lambda . (w(lambda) - w(0)). It saves a tenth of the iterations
  // (measured), within these bounds.
  double scale() const
  {
    constexpr double LEAST_SCALE = 0.9, MOST_SCALE = 1.1;
    const double curved_along = along - along_free;
    return curved_along > 0.0 ? std::clamp(-along_free / curved_along, LEAST_SCALE, MOST_SCALE)
                              : 1.0;
  }
};

void AcceleratedProjectedGradient::set_diagonal(const ContactProblem &problem)
{
  const ContactSet &contacts = problem.contacts;
  diagonal_.resize(contacts.size());
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const double *const n = &contacts.normal[3 * c];
    diagonal_[c] = problem.timestep *
        (problem.mobility(contacts.first[c], n) + problem.mobility(contacts.second[c], n));
  }
}

AcceleratedProjectedGradient::FirstGuess
AcceleratedProjectedGradient::judge_first_guess(const ContactProblem &problem, Host &host)
{
  const std::vector<double> &impulse = problem.contacts.impulse;
  const std::vector<double> &free_gap = gap_operator_.free_gap();
  const std::size_t count = impulse.size();
  gap_.resize(count);
  gap_operator_.apply(problem, impulse.data(), gap_.data(), host);
  const Residual mine = residual(gap_.data(), impulse.data(), count);
  double along = 0.0, along_free = 0.0, largest = 0.0, largest_diagonal = 0.0;
  for (std::size_t c = 0; c < count; ++c) {
    along += impulse[c] * gap_[c];
    along_free += impulse[c] * free_gap[c];
    largest = std::max({largest, std::abs(free_gap[c]), impulse[c] * diagonal_[c]});
    largest_diagonal = std::max(largest_diagonal, diagonal_[c]);
  }
  double sums[2] = {along, along_free};
  double maxima[4] = {mine.feasibility, mine.complementarity, largest, largest_diagonal};
  host.reduce(sums, 2, maxima, 4);
  return {{maxima[0], maxima[1]}, sums[0], sums[1], maxima[2], maxima[3]};
}

bool AcceleratedProjectedGradient::judge(const ContactProblem &problem, const SolverLimits &limits,
                                         Host &host, SolverResult &result)
{
  const std::vector<double> &impulse = problem.contacts.impulse;
  gap_.resize(impulse.size());
  gap_operator_.apply(problem, impulse.data(), gap_.data(), host);
  result.residual = residual_over_ranks(gap_.data(), impulse.data(), impulse.size(), host);
  return result.residual.largest() <= limits.tolerance;
}

std::optional<Status> AcceleratedProjectedGradient::judge_prospects(const ContactProblem &problem,
                                                                    const SolverLimits &limits,
                                                                    Host &host,
                                                                    SolverResult &result)
{
  // The residual comes down to 0.6 to 1.6 times the unit round-off of the heaviest impulse as a
  // length (measured in columns, heaps and crystals of 2 to 600 particles).
  constexpr double BELOW_ROUND_OFF = 0.5;
  const bool infeasible = is_infeasible(problem, gap_operator_, limits, host);
  if (!infeasible && !(limits.tolerance < BELOW_ROUND_OFF * result.round_off)) return std::nullopt;
  if (judge(problem, limits, host, result)) return Status::CONVERGED;
  return infeasible ? Status::INFEASIBLE : Status::ROUND_OFF;
}

void AcceleratedProjectedGradient::raise_curvature(double curved, double change_squared)
{
  constexpr double MARGIN = 1.05;
  if (curved > curvature_ * change_squared && change_squared > 0.0)
    curvature_ = MARGIN * curved / change_squared;
}

template <typename Real>
Status AcceleratedProjectedGradient::iterate(PackedIterations<Real> &iterations,
                                             ContactProblem &problem, const SolverLimits &limits,
                                             const Scales &scales, Host &host, SolverResult &result)
{
  // If double precision refuses so many residuals that single precision finds within the tolerance,
  // round-off shows and single precision is given up.
  constexpr long MOST_FAILURES = 4;

  iterations.prepare(problem, gap_operator_.free_gap(), diagonal_, scales, host);
  std::vector<double> &impulse = problem.contacts.impulse;
  const double tolerance = limits.tolerance / scales.length;
  Momentum momentum;
  double last_change_squared = 0.0;
  long next_check = 0;
  long failures = 0;
  while (result.iterations < limits.max_iterations) {
    const packed::Passed passed =
        over_ranks(iterations.advance(momentum.value(), 1.0 / curvature_), host);
    ++result.iterations;
    if (!std::isfinite(passed.curved)) {
      result.residual = UNSOLVED;
      return Status::NOT_FINITE;
    }
    raise_curvature(passed.curved, last_change_squared);
    last_change_squared = passed.change_squared;
    const double packed_residual = std::max(-passed.least_gap, passed.most_under_force);
    result.trend.see(result.iterations, scales.length * packed_residual);

    if (packed_residual <= tolerance && result.iterations >= next_check) {
      iterations.impulses_before(scales, impulse);
      if (judge(problem, limits, host, result)) return Status::CONVERGED;
      if (++failures == MOST_FAILURES && sizeof(Real) < sizeof(double))
        return Status::OUT_OF_ITERATIONS;
      next_check = result.iterations + failures;
    }
    if (!suffices<Real>(passed.heaviest, tolerance)) {
      iterations.impulses(scales, impulse);
      return Status::OUT_OF_ITERATIONS;
    }
    result.round_off = UNIT_ROUND_OFF * scales.length * passed.heaviest;
    if (result.iterations % CHECK_EVERY == 0) {
      iterations.impulses_before(scales, impulse);
      const std::optional<Status> end = judge_prospects(problem, limits, host, result);
      if (end) return *end;
    }

    if (passed.uphill > 0.0)
      momentum.restart();
    else
      momentum.grow();
    iterations.finish(host, momentum.value());
  }
  iterations.impulses(scales, impulse);
  if (judge(problem, limits, host, result)) return Status::CONVERGED;
  return std::isfinite(result.residual.feasibility) ? Status::OUT_OF_ITERATIONS
                                                    : Status::NOT_FINITE;
}

SolverResult AcceleratedProjectedGradient::solve(ContactProblem &problem,
                                                 const SolverLimits &limits, Host &host)
{
  // L is let down a little between calls, so that it can follow a packing that becomes less
  // connected.
  constexpr double RELAXATION = 0.998;
  // The first L is the largest eigenvalue of a few contacts: a first step that is far too long
  // would cost more iterations than one that is too short.
  constexpr double FIRST_CURVATURE = 2.0;

  std::vector<double> &impulse = problem.contacts.impulse;
  gap_operator_.prepare(problem);
  set_diagonal(problem);
  for (double &value : impulse) value = std::max(0.0, value);

  SolverResult result;
  const FirstGuess guess = judge_first_guess(problem, host);
  result.residual = guess.residual;
  if (result.residual.largest() <= limits.tolerance)
    result.status = Status::CONVERGED;
  else if (!std::isfinite(result.residual.feasibility))
    result.status = Status::NOT_FINITE;
  if (result.status != Status::OUT_OF_ITERATIONS) return result;

  const double scale = guess.scale();
  for (double &value : impulse) value *= scale;
  curvature_ = curvature_ == 0.0 ? FIRST_CURVATURE : std::max(1.0, RELAXATION * curvature_);

  Scales scales;
  scales.length = std::exp2(std::ilogb(guess.largest_length));
  scales.impulse = scales.length / std::exp2(std::ilogb(guess.largest_diagonal));
  if (suffices<float>(guess.largest_length, limits.tolerance))
    result.status = iterate(single_, problem, limits, scales, host, result);
  const bool settled = result.status == Status::CONVERGED || result.status == Status::INFEASIBLE;
  if (!settled && result.iterations < limits.max_iterations)
    result.status = iterate(double_, problem, limits, scales, host, result);
  return result;
}

}    // namespace inelastic
