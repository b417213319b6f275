#include "inelastic_gradient_search.h"

#include "inelastic_infeasibility.h"
#include "inelastic_momentum.h"
#include "inelastic_settling.h"
#include "inelastic_solve.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace inelastic {

namespace {

  constexpr double UNIT_ROUND_OFF = 0.5 * std::numeric_limits<double>::epsilon();

  // So many times double precision may refuse impulses that single precision finds within the
  // targets: then round-off shows and the search is given up. (Double precision also refuses where
  // a constraint was idle for too long, once or twice in a solve.)
  constexpr long MOST_FAILURES = 8;
  // In every so many iterations it is looked at whether the residual has stayed on a plateau.
  constexpr long PLATEAU_EVERY = 10;

  packed::Passed over_ranks(const packed::Passed &mine, Host &host)
  {
    double sums[3] = {mine.uphill, mine.curved, mine.steep};
    double maxima[6] = {-mine.least_gap,  mine.most_under_force, mine.heaviest,
                        mine.since_start, mine.unsolved,         mine.unblurred};
    host.reduce(sums, 3, maxima, 6);
    packed::Passed all;
    all.uphill = sums[0];
    all.curved = sums[1];
    all.steep = sums[2];
    all.least_gap = -maxima[0];
    all.most_under_force = maxima[1];
    all.heaviest = maxima[2];
    all.since_start = maxima[3];
    all.unsolved = maxima[4];
    all.unblurred = maxima[5];
    return all;
  }

}    // namespace

void Curvature::let_down()
{
  constexpr double RELAXATION = 0.998;
  // The first L is the largest eigenvalue of a few contacts: a first step that is far too long
  // would cost more iterations than one that is too short.
  constexpr double FIRST = 2.0;
  value_ = value_ == 0.0 ? FIRST : std::max(1.0, RELAXATION * value_);
}

void Curvature::see(const packed::Passed &passed)
{
  // A change of impulses that A makes nearly zero tells little of L: round-off could raise L
  // without bound.
  constexpr double MARGIN = 1.02, MOST_RAISE = 2.0;
  if (passed.steep > value_ * passed.curved && passed.curved > 0.0)
    value_ = std::min(MARGIN * passed.steep / passed.curved, MOST_RAISE * value_);
}

// Once for both precisions.
template <typename Real> void GradientSearch<Real>::begin()
{
  if (is_single()) curvature_->let_down();
}

template <typename Real>
std::optional<End> GradientSearch<Real>::judge_prospects(Solve &solve) const
{
  // The residual comes down to 0.6 to 1.6 times the unit round-off of the heaviest impulse as a
  // length (measured in columns, heaps and crystals of 2 to 600 particles).
  constexpr double BELOW_ROUND_OFF = 0.5;
  // A residual that came down by less than a tenth over half of so many iterations comes down no
  // more: where there is hardly any room, the targets are not to be had, but the tolerance may be.
  constexpr long LONG = 5000;
  constexpr double STUCK = 0.9;
  const SolverResult &result = solve.result;
  const double tolerance = solve.limits.tolerance;
  const ResidualTrend &trend = solve.trend_of_targets;
  const bool infeasible =
      is_infeasible(solve.problem, solve.gap_operator(), solve.limits, solve.host);
  const bool blurred = tolerance < BELOW_ROUND_OFF * result.round_off;
  const bool stuck = result.iterations >= LONG && trend.least() > STUCK * trend.earlier();
  if (!infeasible && solve.is_time_for_slow_modes() && solve.may_have_slow_modes() &&
      solve.solve_slow_modes())
    return End::SOLVED;
  if (!infeasible && !blurred && !stuck) return std::nullopt;
  if (solve.judge()) return End::SOLVED;
  if (infeasible) return End::INFEASIBLE;
  if (blurred) return is_single() ? End::GO_ON : End::ROUND_OFF;
  if (result.residual.largest() <= tolerance && !solve.limits.to_targets) return End::SOLVED;
  // Round-off of single precision may keep the residual up; double precision then goes on.
  if (!is_single()) return std::nullopt;
  solve.forget_trends();
  solve.plateau = Plateau();
  return End::ROUND_OFF;
}

template <typename Real>
double GradientSearch<Real>::see(const packed::Passed &passed, Solve &solve)
{
  curvature_->see(passed);
  const double packed_residual = std::max(-passed.least_gap, passed.most_under_force);
  SolverResult &result = solve.result;
  result.trend.see(result.iterations, solve.scales().length * packed_residual);
  solve.trend_of_targets.see(result.iterations, passed.unsolved);
  solve.plateau.see(result.iterations, passed.unsolved);
  return packed_residual;
}

template <typename Real> bool GradientSearch<Real>::ends_on_plateau(Solve &solve) const
{
  if (!solve.is_on_plateau()) return false;
  iterations_.impulses_before(solve.scales(), solve.impulse());
  return solve.ends_on_plateau(solve.is_time_for_slow_modes());
}

// Iterates until all residuals, judged in double precision, are at most their targets and
// velocities settle, or more iterations in this precision are of no use.
template <typename Real> End GradientSearch<Real>::run(Solve &solve)
{
  const SolverLimits &limits = solve.limits;
  const Scales &scales = solve.scales();
  Host &host = solve.host;
  SolverResult &result = solve.result;
  std::vector<double> &impulse = solve.impulse();
  solve.choose_ghosts();
  iterations_.prepare(solve.start(), solve.idle_gap());
  Momentum momentum;
  Settling settling(iterations_, limits.accuracy > 0.0 && limits.coarseness == 1.0,
                    result.iterations);
  long next_check = 0, failures = 0;
  double blur = 0.0;
  while (!solve.is_out_of_iterations()) {
    const double curvature = curvature_->value();
    const packed::Passed passed =
        over_ranks(iterations_.advance(momentum.next(curvature), 1.0 / curvature, blur), host);
    ++result.iterations;
    if (!std::isfinite(passed.steep)) {
      result.residual = UNSOLVED;
      return End::NOT_FINITE;
    }
    const double packed_residual = see(passed, solve);
    if (result.iterations % PLATEAU_EVERY == 0 &&
        scales.length * packed_residual <= limits.tolerance && ends_on_plateau(solve))
      return End::SOLVED;

    // There is no better precision than double.
    blur = is_single() ? SINGLE_ROUND_OFF * passed.since_start : 0.0;
    bool solved = passed.unblurred <= 1.0 && result.iterations >= next_check;
    if (solved && !settling.has_settled(limits.accuracy, host)) {
      solved = false;
      next_check = result.iterations + std::max(3L, result.iterations / 10);
    }
    if (solved) {
      iterations_.impulses_before(scales, impulse);
      if (solve.judge()) return End::SOLVED;
      if (passed.unsolved > 1.0) return End::GO_ON;
      iterations_.join(solve.gap(), scales);
      // The residuals so far were not those of all constraints.
      solve.forget_trends();
      if (++failures == MOST_FAILURES && is_single()) return End::GO_ON;
      next_check = result.iterations + failures;
    }
    result.round_off = UNIT_ROUND_OFF * scales.length * passed.heaviest;
    if (result.iterations % CHECK_EVERY == 0) {
      iterations_.impulses_before(scales, impulse);
      if (const auto end = judge_prospects(solve)) return *end;
    }
    momentum.see(passed.uphill);
    iterations_.finish(host);
    settling.see(result.iterations);
    if (result.iterations % LOOK_EVERY == 0)
      iterations_.look(IDLE_GAP * std::max(limits.tolerance / scales.length, packed_residual));
  }
  iterations_.impulses(scales, impulse);
  if (solve.judge()) return End::SOLVED;
  return std::isfinite(result.residual.feasibility) ? End::GO_ON : End::NOT_FINITE;
}

template class GradientSearch<float>;
template class GradientSearch<double>;

}    // namespace inelastic
