#include "accelerated_gradient.h"

#include "infeasibility.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace inelastic {

namespace {

  constexpr double UNIT_ROUND_OFF = 0.5 * std::numeric_limits<double>::epsilon();

  // Returns whether round-off, a few 1e-7 of the largest length in single precision, is far below
  // the target. Double precision is the best there is.
  template <typename Real> bool suffices(double largest_length, double target)
  {
    constexpr double MOST_TARGETS = 3.0e5;
    return sizeof(Real) == sizeof(double) || largest_length < MOST_TARGETS * target;
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

  // The first guess is first made as large as the dual function likes it along its own direction.
  // This costs no product with A, since w is affine: the minimum over s of the dual function at s
  // lambda is at s = -lambda . w(0) / lambda . (w(lambda) - w(0)). It saves a tenth of the
  // iterations (measured), within these bounds.
  double scale(const Guess &guess)
  {
    constexpr double LEAST_SCALE = 0.9, MOST_SCALE = 1.1;
    const double curved_along = guess.along - guess.along_free;
    return curved_along > 0.0
        ? std::clamp(-guess.along_free / curved_along, LEAST_SCALE, MOST_SCALE)
        : 1.0;
  }

}    // namespace

bool AcceleratedProjectedGradient::judge(const ContactProblem &problem, Host &host,
                                         SolverResult &result)
{
  const std::vector<double> &impulse = problem.contacts.impulse;
  gap_.resize(impulse.size());
  gap_operator_.apply(problem, impulse.data(), gap_.data(), host);
  result.residual = residual_over_ranks(gap_.data(), impulse.data(), impulse.size(), host);
  return result.residual.largest() <= result.target;
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
  if (!infeasible && !(result.target < BELOW_ROUND_OFF * result.round_off)) return std::nullopt;
  if (judge(problem, host, result)) return Status::CONVERGED;
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
  // round-off shows and single precision is given up. (It also refuses where a constraint was idle
  // for too long, once or twice in a solve.)
  constexpr long MOST_FAILURES = 8;
  // Idle constraints are looked at in every so many iterations. A constraint is idle above so many
  // residuals, or tolerances where they are more: gaps change by some residuals until the end. (With
  // tolerances alone a bed at rest moved up to four times as fast, measured: contacts that closed in
  // the step came in late.)
  constexpr long LOOK_EVERY = 20;
  constexpr double IDLE_GAP = 5.0;

  iterations.prepare(problem, gap_operator_.free_gap(), diagonal_, gap_,
                     IDLE_GAP * std::max(limits.tolerance, result.residual.largest()), scales,
                     host);
  std::vector<double> &impulse = problem.contacts.impulse;
  const double target = result.target / scales.length;
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

    if (packed_residual <= target && result.iterations >= next_check) {
      iterations.impulses_before(scales, impulse);
      if (judge(problem, host, result)) return Status::CONVERGED;
      iterations.join(gap_, scales);
      if (++failures == MOST_FAILURES && sizeof(Real) < sizeof(double))
        return Status::OUT_OF_ITERATIONS;
      next_check = result.iterations + failures;
    }
    if (!suffices<Real>(passed.heaviest, target)) {
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
    if (result.iterations % LOOK_EVERY == 0)
      iterations.look(IDLE_GAP * std::max(limits.tolerance / scales.length, packed_residual));
  }
  iterations.impulses(scales, impulse);
  if (judge(problem, host, result)) return Status::CONVERGED;
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

  SolverResult result;
  const Guess guess = judge_first_guess(problem, host);
  result.residual = guess.residual;
  result.target = target_residual(limits, guess);
  result.change = guess.change();
  if (result.residual.largest() <= result.target)
    result.status = Status::CONVERGED;
  else if (!std::isfinite(result.residual.feasibility))
    result.status = Status::NOT_FINITE;
  if (result.status != Status::OUT_OF_ITERATIONS) return result;

  const double factor = scale(guess);
  for (double &value : impulse) value *= factor;
  curvature_ = curvature_ == 0.0 ? FIRST_CURVATURE : std::max(1.0, RELAXATION * curvature_);

  Scales scales;
  scales.length = std::exp2(std::ilogb(guess.largest_length));
  scales.impulse = scales.length / std::exp2(std::ilogb(guess.largest_diagonal));
  if (suffices<float>(guess.largest_length, result.target))
    result.status = iterate(single_, problem, limits, scales, host, result);
  const bool settled = result.status == Status::CONVERGED || result.status == Status::INFEASIBLE;
  if (!settled && result.iterations < limits.max_iterations) {
    gap_operator_.apply(problem, impulse.data(), gap_.data(), host);
    result.status = iterate(double_, problem, limits, scales, host, result);
  }
  settle_for_tolerance(limits, result.residual.largest(), result);
  return result;
}

}    // namespace inelastic
