#include "inelastic_coloured_sweeps.h"

#include "inelastic_checkpoints.h"
#include "inelastic_infeasibility.h"
#include "inelastic_momentum.h"
#include "inelastic_solve.h"

#include <algorithm>
#include <cmath>

namespace inelastic {

namespace {

  // Sweeps of which the largest change is in half of their number no smaller by this factor are of
  // no more use, if there were so many.
  constexpr long LONG = 1000;
  constexpr double STUCK = 0.8;

  // The residual is looked at in every so many sweeps at least, to see whether it comes down.
  constexpr long PLATEAU_EVERY = 50;

  // Sweeps diverge if their largest change of an impulse grows to so many times that of the first.
  constexpr double DIVERGED = 1.0e3;

  // Returns the largest residual, over all ranks, as a part of its target. Collective.
  template <typename Sweeps> double find_unsolved(const Sweeps &sweeps, double blur, Host &host)
  {
    double unsolved = sweeps.unsolved(blur);
    host.reduce(nullptr, 0, &unsolved, 1);
    return unsolved;
  }

  // Returns how sweeps end because the residual no longer comes down: a few slow modes are solved
  // otherwise, or the residual is within the tolerance and the targets are not to be had, or the
  // next search goes on. Collective.
  template <typename Sweeps>
  std::optional<End> leave_plateau(const Sweeps &sweeps, double blur, Solve &solve)
  {
    const long made = solve.result.iterations;
    solve.plateau.see(made, find_unsolved(sweeps, blur, solve.host));
    const bool tries = solve.is_time_for_slow_modes();
    if (!tries && !solve.is_on_plateau()) return std::nullopt;
    sweeps.impulses(solve.scales(), solve.impulse());
    if (solve.ends_on_plateau(tries)) return End::SOLVED;
    // Above the tolerance the next search goes on, after twice as long.
    const long most = solve.most_on_plateau(), now = solve.result.iterations;
    const bool ends = most < now && solve.plateau.lasts(now, 2 * most);
    return ends ? std::optional(End::GO_ON) : std::nullopt;
  }

}    // namespace

// ROUND_OFF where double precision refuses what is solved in single precision.
template <typename Batch>
End ColouredSweeps::sweep(PackedSweeps<Batch> &sweeps, Settling<PackedSweeps<Batch>> &settling,
                          Solve &solve)
{
  const SolverLimits &limits = solve.limits;
  const Scales &scales = solve.scales();
  Host &host = solve.host;
  SolverResult &result = solve.result;
  Momentum momentum;
  Checkpoints checkpoints(result.iterations);
  Upkeep upkeep(result.iterations);
  ResidualTrend progress;
  const long begun = result.iterations;
  double first = 0.0, blur = 0.0;
  while (!solve.is_out_of_iterations()) {
    const swept::Swept mine = sweeps.sweep(momentum.next().along, blur, host);
    ++result.iterations;
    double uphill = mine.uphill, maxima[3] = {mine.of_target, mine.change, mine.since_start};
    host.reduce(&uphill, 1, maxima, 3);
    const double of_target = maxima[0], change = maxima[1];
    if (first == 0.0) first = change;
    if (!std::isfinite(uphill) || !(change <= DIVERGED * first)) return End::GO_ON;
    progress.see(result.iterations - begun, of_target);
    result.trend.see(result.iterations, scales.length * change);
    blur = SINGLE_ROUND_OFF * maxima[2];

    if (checkpoints.is_due(result.iterations, of_target)) {
      double unsolved = find_unsolved(sweeps, blur, host);
      checkpoints.note(result.iterations, of_target, unsolved);
      const bool near = unsolved <= 1.0;
      const bool settled = near && settling.has_settled(limits.accuracy, host);
      if (settled) unsolved = find_unsolved(sweeps, blur, host);    // the targets are new
      if (settled && unsolved <= 1.0) {
        sweeps.impulses(scales, solve.impulse());
        return solve.judge() ? End::SOLVED : End::ROUND_OFF;
      }
      if (near && !settled)
        checkpoints.wait_until(result.iterations + std::max(3L, result.iterations / 10));
    }
    if ((result.iterations - begun) % PLATEAU_EVERY == 0)
      if (const auto end = leave_plateau(sweeps, blur, solve)) return *end;
    if ((result.iterations - begun) % CHECK_EVERY == 0) {
      sweeps.impulses(scales, solve.impulse());
      if (is_infeasible(solve.problem, solve.gap_operator(), limits, host)) return End::INFEASIBLE;
      if (result.iterations - begun >= LONG && progress.least() >= STUCK * progress.earlier())
        return End::GO_ON;
    }
    momentum.see(uphill);
    upkeep.run(result.iterations, sweeps, IDLE_GAP * limits.tolerance / scales.length, host);
    settling.see(result.iterations);
  }
  return End::GO_ON;
}

template <typename Batch> End ColouredSweeps::search(PackedSweeps<Batch> &sweeps, Solve &solve)
{
  const SolverLimits &limits = solve.limits;
  double refused = sweeps.prepare(solve.start(), solve.idle_gap(), solve.host) ? 0.0 : 1.0;
  solve.host.reduce(nullptr, 0, &refused, 1);
  if (refused > 0.0) return End::GO_ON;
  Settling settling(sweeps, limits.accuracy > 0.0 && limits.coarseness == 1.0,
                    solve.result.iterations);
  for (int k = 0; k < MOST_SEARCHES; ++k) {
    if (k > 0) sweeps.go_on(solve.idle_gap());
    const std::vector<double> before = solve.impulse();
    const Residual residual_before = solve.result.residual;
    const End end = sweep(sweeps, settling, solve);
    if (end == End::SOLVED) return end;
    if (end == End::ROUND_OFF) continue;
    // The next search goes on from the better one of the impulses reached and those before. Where
    // there is no solution it begins anew: it shares out what is lacking.
    if (end == End::GO_ON) {
      sweeps.impulses(solve.scales(), solve.impulse());
      if (solve.judge()) return End::SOLVED;
      if (solve.result.residual.largest() <= residual_before.largest()) return end;
    }
    solve.impulse() = before;
    solve.judge();
    return End::GO_ON;
  }
  return End::ROUND_OFF;
}

End ColouredSweeps::run(Solve &solve)
{
  if (solve.problem.any_wall_moves()) return End::GO_ON;
  // Whether there are bodies is a matter of the scene: some ranks may have none.
  double bodies = solve.problem.bodies.empty() ? 0.0 : 1.0;
  solve.host.reduce(nullptr, 0, &bodies, 1);
  return bodies > 0.0 ? search(of_bodies_, solve) : search(of_particles_, solve);
}

}    // namespace inelastic
