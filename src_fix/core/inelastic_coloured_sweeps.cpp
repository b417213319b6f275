#include "inelastic_coloured_sweeps.h"

#include "inelastic_checkpoints.h"
#include "inelastic_infeasibility.h"
#include "inelastic_momentum.h"
#include "inelastic_solve.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace inelastic {

namespace {

  // Sweeps of which the largest change is in half of their number no smaller by this factor are of
  // no more use, if there were so many.
  constexpr long LONG = 5000;
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
    if (!tries && !solve.may_end_on_plateau()) return std::nullopt;
    sweeps.impulses(solve.scales(), solve.impulse());
    if (solve.ends_on_plateau(tries)) return End::SOLVED;
    // Above the tolerance the next search goes on, after twice as long.
    const long most = solve.most_on_plateau(), now = solve.result.iterations;
    const bool ends = most < now && solve.plateau.lasts(now, 2 * most);
    return ends ? std::optional(End::GO_ON) : std::nullopt;
  }

}    // namespace

// What double precision says of the impulses that sweeps have come to, time after time, and the
// best ones of these.
class ColouredSweeps::Refinement {
 public:
  // The impulses of the solve have been judged, here and below.
  explicit Refinement(const Solve &solve) : solve_(solve) { keep(); }

  // Tells whether more sweeps are of use.
  bool goes_on()
  {
    constexpr double PROGRESS = 0.9;
    constexpr int MOST_IN_VAIN = 12;
    if (solve_.result.residual.largest() < residual_.largest()) keep();
    if (solve_.unsolved() > PROGRESS * least_) return ++in_vain_ < MOST_IN_VAIN;
    least_ = solve_.unsolved();
    in_vain_ = 0;
    return true;
  }

  // Whether the present impulses are no better than others.
  bool has_better() const { return !(solve_.result.residual.largest() <= residual_.largest()); }
  const std::vector<double> &best() const { return best_; }

 private:
  void keep()
  {
    best_ = solve_.problem.contacts.impulse;
    residual_ = solve_.result.residual;
  }

  const Solve &solve_;
  std::vector<double> best_;
  Residual residual_;
  double least_ = std::numeric_limits<double>::infinity();
  int in_vain_ = 0;
};

// ROUND_OFF where single precision gets no further.
template <typename Batch>
End ColouredSweeps::sweep(PackedSweeps<Batch> &sweeps, Refinement &refinement, Solve &solve)
{
  const SolverLimits &limits = solve.limits;
  Host &host = solve.host;
  SolverResult &result = solve.result;
  Momentum momentum;
  Checkpoints checkpoints(result.iterations);
  Upkeep upkeep(result.iterations);
  ResidualTrend progress;
  Settling settling(sweeps, limits.accuracy > 0.0 && limits.coarseness == 1.0, result.iterations);
  long begun = result.iterations, refined = begun;
  const double idle_gap = IDLE_GAP * limits.tolerance / solve.scales().length;
  double first = 0.0, blur = 0.0;
  while (!solve.is_out_of_iterations()) {
    const swept::Swept mine = sweeps.sweep(momentum.next().along, blur, host);
    ++result.iterations;
    double uphill = mine.uphill, maxima[3] = {mine.of_target, mine.change, mine.since_start};
    host.reduce(&uphill, 1, maxima, 3);
    const double of_target = maxima[0], change = maxima[1];
    if (first == 0.0) first = change;
    if (!std::isfinite(uphill) || !(change <= DIVERGED * first)) return End::GO_ON;
    progress.see(result.iterations - refined, of_target);
    result.trend.see(result.iterations, solve.scales().length * change);
    blur = SINGLE_ROUND_OFF * maxima[2];
    if (checkpoints.is_due(result.iterations, of_target)) {
      double unsolved = find_unsolved(sweeps, blur, host);
      checkpoints.note(result.iterations, of_target, unsolved);
      const bool near = unsolved <= 1.0;
      const bool settled = near && settling.has_settled(limits.accuracy, host);
      if (settled) unsolved = find_unsolved(sweeps, blur, host);    // the targets are new
      const bool solved = settled && unsolved <= 1.0;
      if (solved || (near && find_unsolved(sweeps, 0.0, host) > 1.0)) {
        sweeps.impulses(solve.scales(), solve.impulse());
        can_go_on_ = solve.judge() && solved;
        if (can_go_on_) return End::SOLVED;
        if (!refinement.goes_on()) return End::ROUND_OFF;
        sweeps.recentre(solve.idle_gap(), host);
        blur = 0.0;
        progress = ResidualTrend();
        refined = result.iterations;
        checkpoints.wait_until(refined + (refined - begun) / 20);
      } else if (near && !settled) {
        checkpoints.wait_until(result.iterations + std::max(3L, result.iterations / 10));
      }
    }
    if ((result.iterations - begun) % PLATEAU_EVERY == 0)
      if (const auto end = leave_plateau(sweeps, blur, solve)) return *end;
    if ((result.iterations - begun) % CHECK_EVERY == 0) {
      sweeps.impulses(solve.scales(), solve.impulse());
      if (is_infeasible(solve.problem, solve.gap_operator(), limits, host)) return End::INFEASIBLE;
      if (result.iterations - refined >= LONG && progress.least() >= STUCK * progress.earlier())
        return End::GO_ON;
    }
    momentum.see(uphill);
    upkeep.run(result.iterations, sweeps, idle_gap, host);
    settling.see(result.iterations);
  }
  return End::GO_ON;
}

template <typename Batch> End ColouredSweeps::search(PackedSweeps<Batch> &sweeps, Solve &solve)
{
  double refused = sweeps.prepare(solve.start(), solve.idle_gap(), solve.host) ? 0.0 : 1.0;
  solve.host.reduce(nullptr, 0, &refused, 1);
  if (refused > 0.0) return End::GO_ON;
  return search_on(sweeps, solve);
}

// Searches from what is packed.
template <typename Batch> End ColouredSweeps::search_on(PackedSweeps<Batch> &sweeps, Solve &solve)
{
  const std::vector<double> guess = solve.impulse();
  Refinement refinement(solve);
  const End end = sweep(sweeps, refinement, solve);
  if (end == End::SOLVED) return end;
  if (end == End::GO_ON) {
    sweeps.impulses(solve.scales(), solve.impulse());
    if (solve.judge()) return End::SOLVED;
  }
  // The next search goes on from the best impulses. Where there is no solution it begins anew: it
  // shares out what is lacking.
  const bool begins_anew = end == End::INFEASIBLE;
  if (begins_anew || refinement.has_better()) {
    solve.impulse() = begins_anew ? guess : refinement.best();
    solve.judge();
  }
  return begins_anew ? End::GO_ON : end;
}

End ColouredSweeps::run(Solve &solve)
{
  can_go_on_ = false;
  if (solve.problem.any_wall_moves()) return End::GO_ON;
  // Whether there are bodies is a matter of the scene: some ranks may have none.
  double bodies = solve.problem.bodies.empty() ? 0.0 : 1.0;
  solve.host.reduce(nullptr, 0, &bodies, 1);
  return bodies > 0.0 ? search(of_bodies_, solve) : search(of_particles_, solve);
}

End ColouredSweeps::go_on(Solve &solve, const Refined &refined)
{
  can_go_on_ = false;
  of_particles_.go_on(solve.start(), refined);
  return search_on(of_particles_, solve);
}

}    // namespace inelastic
