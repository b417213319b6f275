#include "inelastic_accelerated_gradient.h"

#include "inelastic_infeasibility.h"
#include "inelastic_settling.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace inelastic {

namespace {

  constexpr double UNIT_ROUND_OFF = 0.5 * std::numeric_limits<double>::epsilon();

  // Returns the residual at which a search ends because of its precision, in packed units: some ten
  // times the round-off of the largest change in single precision; 0 in double precision, since
  // there is no better one.
  template <typename Real> double least_residual(double largest_change)
  {
    constexpr double PART = 1.0 / 3.0e5;
    return sizeof(Real) == sizeof(double) ? 0.0 : PART * largest_change;
  }

  // So many times double precision may refuse impulses that single precision finds within the
  // targets: then round-off shows and the search is given up. (Double precision also refuses where
  // a constraint was idle for too long, once or twice in a solve.)
  constexpr long MOST_FAILURES = 8;
  // Idle constraints are looked at in every so many iterations. A constraint is idle if its gap is
  // above so many residuals, or tolerances where these are larger: gaps change by some residuals
  // until the end. (With tolerances alone a bed at rest moved up to four times as fast, measured:
  // contacts that closed in the step came in late.)
  constexpr long LOOK_EVERY = 20;
  // In every so many iterations it is looked at whether the residual has stayed on a plateau.
  constexpr long PLATEAU_EVERY = 10;
  constexpr double IDLE_GAP = 5.0;

  // The weights of inelastic_accelerated_gradient.h.
  class Momentum {
   public:
    Weights next(double curvature)
    {
      const double next_time = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * time_ * time_));
      const Weights weights = {(time_ - 1.0) / next_time, time_ / next_time,
                               (time_ - 1.0) / (next_time * curvature * length_)};
      length_ = (2.0 * time_ + next_time - 1.0) / (next_time * curvature);
      time_ = next_time;
      return weights;
    }

    void restart() { time_ = 1.0; }

   private:
    double time_ = 1.0;      // t
    double length_ = 1.0;    // g / L, of no meaning where t is 1
  };

  // Chooses the ghosts that are in constraints of this rank, and all members of a body of which one
  // is. Most ghosts are in none. Collective.
  void choose_ghosts(const ContactProblem &problem, Host &host)
  {
    if (!host.has_ghosts()) return;
    std::vector<char> chosen(problem.slots(), 0);
    for (const int i : problem.contacts.first) chosen[i] = 1;
    for (const int i : problem.contacts.second) chosen[i] = 1;
    const RigidBodies &bodies = problem.bodies;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      char any = 0;
      for (int k = bodies.start[b]; k < bodies.start[b + 1]; ++k) any |= chosen[bodies.member[k]];
      for (int k = bodies.start[b]; k < bodies.start[b + 1]; ++k) chosen[bodies.member[k]] = any;
    }
    host.choose_ghosts(chosen);
  }

  Status not_finite(SolverResult &result)
  {
    result.residual = UNSOLVED;
    return Status::NOT_FINITE;
  }

  packed::Passed over_ranks(const packed::Passed &mine, Host &host)
  {
    double sums[3] = {mine.uphill, mine.curved, mine.steep};
    double maxima[6] = {-mine.least_gap, mine.most_under_force, mine.heaviest,
                        mine.farthest,   mine.unsolved,         mine.unblurred};
    host.reduce(sums, 3, maxima, 6);
    packed::Passed all;
    all.uphill = sums[0];
    all.curved = sums[1];
    all.steep = sums[2];
    all.least_gap = -maxima[0];
    all.most_under_force = maxima[1];
    all.heaviest = maxima[2];
    all.farthest = maxima[3];
    all.unsolved = maxima[4];
    all.unblurred = maxima[5];
    return all;
  }

}    // namespace

bool AcceleratedProjectedGradient::judge(const ContactProblem &problem, const SolverLimits &limits,
                                         Host &host, SolverResult &result)
{
  const std::vector<double> &impulse = problem.contacts.impulse;
  gap_.resize(impulse.size());
  gap_operator_.apply(problem, impulse.data(), gap_.data(), host);
  result.residual = residual_over_ranks(gap_.data(), problem.contacts, host);
  result.accurate = targets_.judge(problem, limits, gap_operator_, gap_, host) <= 1.0;
  result.unresolved = targets_.unresolved();
  return result.accurate;
}

bool AcceleratedProjectedGradient::is_time_for_slow_modes(long iteration)
{
  // With a ratio of n the smallest eigenvalues of A fall to about its n-th part.
  constexpr double DIFFERENT = 30.0, VERY_DIFFERENT = 1000.0;
  return mass_ratio_ >= DIFFERENT &&
      plateau_.is_time_to_try(iteration, mass_ratio_ >= VERY_DIFFERENT);
}

bool AcceleratedProjectedGradient::end_on_plateau(bool tries, ContactProblem &problem,
                                                  const SolverLimits &limits, Host &host,
                                                  SolverResult &result)
{
  if (tries && solve_slow_modes(problem, limits, host, result)) return true;
  if (!plateau_.lasts(result.iterations, find_network(problem, host).most_on_plateau()))
    return false;
  const bool accurate = judge(problem, limits, host, result);
  if (limits.to_targets) return accurate;
  return accurate ||
      (result.residual.largest() <= limits.tolerance && result.unresolved <= HARDLY_RESOLVED &&
       result.unresolved > WELL_RESOLVED);
}

bool AcceleratedProjectedGradient::solve_slow_modes(ContactProblem &problem,
                                                    const SolverLimits &limits, Host &host,
                                                    SolverResult &result)
{
  const std::vector<double> before = problem.contacts.impulse;
  // The searches that may go on have taken their gaps and targets from the members.
  ContactTargets targets = targets_;
  std::vector<double> gap(before.size());
  double unsolved = 0.0;
  const auto judge_here = [&] {
    gap_operator_.apply(problem, problem.contacts.impulse.data(), gap.data(), host);
    return unsolved = targets.judge(problem, limits, gap_operator_, gap, host);
  };
  judge_here();
  result.iterations +=
      conjugate_gradients_.search(problem, gap_operator_, diagonal_, gap,
                                  limits.max_iterations - result.iterations, judge_here, host);
  if (unsolved <= 1.0 && judge(problem, limits, host, result)) {
    result.status = Status::CONVERGED;
    return true;
  }
  problem.contacts.impulse = before;
  return false;
}

std::optional<Status> AcceleratedProjectedGradient::judge_prospects(ContactProblem &problem,
                                                                    const SolverLimits &limits,
                                                                    bool single_precision,
                                                                    Host &host,
                                                                    SolverResult &result)
{
  // The residual comes down to 0.6 to 1.6 times the unit round-off of the heaviest impulse as a
  // length (measured in columns, heaps and crystals of 2 to 600 particles).
  constexpr double BELOW_ROUND_OFF = 0.5;
  // A residual that came down by less than a tenth over half of so many iterations comes down no
  // more: where there is hardly any room, the targets are not to be had, but the tolerance may be.
  constexpr long LONG = 5000;
  constexpr double STUCK = 0.9;
  const bool infeasible = is_infeasible(problem, gap_operator_, limits, host);
  const bool blurred = limits.tolerance < BELOW_ROUND_OFF * result.round_off;
  const bool stuck =
      result.iterations >= LONG && trend_of_targets_.least() > STUCK * trend_of_targets_.earlier();
  if (!infeasible && is_time_for_slow_modes(result.iterations) &&
      solve_slow_modes(problem, limits, host, result))
    return Status::CONVERGED;
  if (!infeasible && !blurred && !stuck) return std::nullopt;
  if (judge(problem, limits, host, result)) return Status::CONVERGED;
  if (infeasible) return Status::INFEASIBLE;
  if (blurred) return Status::ROUND_OFF;
  if (result.residual.largest() <= limits.tolerance && !limits.to_targets) return Status::CONVERGED;
  // Round-off of single precision may keep the residual up; double precision then goes on.
  if (!single_precision) return std::nullopt;
  is_stuck_ = true;
  result.trend = trend_of_targets_ = ResidualTrend();
  plateau_ = Plateau();
  return Status::OUT_OF_ITERATIONS;
}

void AcceleratedProjectedGradient::raise_curvature(const packed::Passed &passed)
{
  // A change of impulses that A makes nearly zero tells little of L: round-off could raise L
  // without bound.
  constexpr double MARGIN = 1.02, MOST_RAISE = 2.0;
  if (passed.steep > curvature_ * passed.curved && passed.curved > 0.0)
    curvature_ = std::min(MARGIN * passed.steep / passed.curved, MOST_RAISE * curvature_);
}

double AcceleratedProjectedGradient::see(const packed::Passed &passed, const Scales &scales,
                                         SolverResult &result)
{
  raise_curvature(passed);
  const double packed_residual = std::max(-passed.least_gap, passed.most_under_force);
  result.trend.see(result.iterations, scales.length * packed_residual);
  trend_of_targets_.see(result.iterations, passed.unsolved);
  plateau_.see(result.iterations, passed.unsolved);
  return packed_residual;
}

template <typename Real>
Status AcceleratedProjectedGradient::iterate(PackedIterations<Real> &iterations,
                                             ContactProblem &problem, const SolverLimits &limits,
                                             const Scales &scales, Host &host, SolverResult &result)
{
  constexpr bool SINGLE = sizeof(Real) < sizeof(double);
  iterations.prepare(problem, diagonal_, gap_,
                     IDLE_GAP * std::max(limits.tolerance, result.residual.largest()), scales,
                     targets_, gap_operator_.change(), limits.tolerance);
  std::vector<double> &impulse = problem.contacts.impulse;
  Momentum momentum;
  Settling settling(iterations, limits.accuracy > 0.0 && limits.coarseness == 1.0,
                    result.iterations);
  long next_check = 0, failures = 0;
  double blur = 0.0;
  while (result.iterations < limits.max_iterations) {
    const packed::Passed passed =
        over_ranks(iterations.advance(momentum.next(curvature_), 1.0 / curvature_, blur), host);
    ++result.iterations;
    if (!std::isfinite(passed.steep)) return not_finite(result);
    const double packed_residual = see(passed, scales, result);
    if (result.iterations % PLATEAU_EVERY == 0 && is_on_plateau(result.iterations) &&
        scales.length * packed_residual <= limits.tolerance) {
      iterations.impulses_before(scales, impulse);
      const bool tries = is_time_for_slow_modes(result.iterations);
      if (end_on_plateau(tries, problem, limits, host, result)) return Status::CONVERGED;
    }

    blur = least_residual<Real>(passed.farthest);
    bool solved = passed.unblurred <= 1.0 && result.iterations >= next_check;
    if (solved && !settling.has_settled(limits.accuracy, host)) {
      solved = false;
      next_check = result.iterations + std::max(3L, result.iterations / 10);
    }
    if (solved) {
      iterations.impulses_before(scales, impulse);
      if (judge(problem, limits, host, result)) return Status::CONVERGED;
      if (passed.unsolved > 1.0) return Status::OUT_OF_ITERATIONS;
      iterations.join(gap_, scales);
      // The residuals so far were not those of all constraints.
      result.trend = trend_of_targets_ = ResidualTrend();
      if (++failures == MOST_FAILURES && SINGLE) return Status::OUT_OF_ITERATIONS;
      next_check = result.iterations + failures;
    }
    result.round_off = UNIT_ROUND_OFF * scales.length * passed.heaviest;
    if (result.iterations % CHECK_EVERY == 0) {
      iterations.impulses_before(scales, impulse);
      if (const auto end = judge_prospects(problem, limits, SINGLE, host, result)) return *end;
    }
    if (passed.uphill > 0.0) momentum.restart();
    iterations.finish(host);
    settling.see(result.iterations);
    if (result.iterations % LOOK_EVERY == 0)
      iterations.look(IDLE_GAP * std::max(limits.tolerance / scales.length, packed_residual));
  }
  iterations.impulses(scales, impulse);
  if (judge(problem, limits, host, result)) return Status::CONVERGED;
  return std::isfinite(result.residual.feasibility) ? Status::OUT_OF_ITERATIONS
                                                    : Status::NOT_FINITE;
}

SolverResult AcceleratedProjectedGradient::solve(ContactProblem &problem,
                                                 const SolverLimits &limits, Host &host)
{
  // A first guess with a residual above so many of its targets is left to double precision.
  // Otherwise at most so many searches in single precision come first.
  constexpr double WITHIN_SINGLE = 1.0e12;
  constexpr int MOST_SEARCHES = 3;
  // L is let down a little between calls, so that it can follow a packing that becomes less
  // connected.
  constexpr double RELAXATION = 0.998;
  // The first L is the largest eigenvalue of a few contacts: a first step that is far too long
  // would cost more iterations than one that is too short.
  constexpr double FIRST_CURVATURE = 2.0;

  std::vector<double> &impulse = problem.contacts.impulse;
  gap_operator_.prepare(problem);

  SolverResult result;
  trend_of_targets_ = ResidualTrend();
  plateau_ = Plateau();
  is_stuck_ = false;
  const Guess guess = judge_first_guess(problem, host);
  result.residual = guess.residual;
  mass_ratio_ = guess.largest_inverse_mass / guess.least_inverse_mass;
  const double unsolved = targets_.judge(problem, limits, gap_operator_, gap_, host);
  result.accurate = unsolved <= 1.0;
  result.unresolved = targets_.unresolved();
  if (unsolved <= 1.0)
    result.status = Status::CONVERGED;
  else if (!std::isfinite(result.residual.feasibility))
    result.status = Status::NOT_FINITE;
  if (limits.max_iterations <= 0) settle_for_tolerance(limits, result.residual.largest(), result);
  if (result.status != Status::OUT_OF_ITERATIONS || limits.max_iterations <= 0) return result;

  curvature_ = curvature_ == 0.0 ? FIRST_CURVATURE : std::max(1.0, RELAXATION * curvature_);

  Scales scales;
  scales.length = std::exp2(std::ilogb(guess.largest_length));
  scales.impulse = scales.length / std::exp2(std::ilogb(guess.largest_diagonal));
  choose_ghosts(problem, host);
  const auto settled = [&] {
    return result.status == Status::CONVERGED || result.status == Status::INFEASIBLE ||
        result.iterations >= limits.max_iterations;
  };
  bool of_use = unsolved < WITHIN_SINGLE;
  if (of_use) of_use = search_first(problem, limits, scales, host, result);
  for (int search = 0; of_use && search < MOST_SEARCHES && !settled() && !is_stuck_; ++search) {
    result.status = iterate(single_, problem, limits, scales, host, result);
    // All other ends of a search have judged what they leave.
    if (result.status == Status::NOT_FINITE)
      gap_operator_.apply(problem, impulse.data(), gap_.data(), host);
  }
  if (!settled()) result.status = iterate(double_, problem, limits, scales, host, result);
  settle_for_tolerance(limits, result.residual.largest(), result);
  return result;
}

}    // namespace inelastic
