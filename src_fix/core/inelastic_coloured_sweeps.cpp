#include "inelastic_coloured_sweeps.h"

#include "inelastic_infeasibility.h"

#include <algorithm>
#include <cmath>

namespace inelastic {

namespace {

  // Idle constraints are looked at in every so many sweeps; later, when an eighth of the sweeps
  // were made since. Gaps above five residuals, or tolerances, are idle, as in
  // inelastic_accelerated_gradient.cpp.
  constexpr long LOOK_EVERY = 20, LOOK_PART = 8;
  constexpr double IDLE_GAP = 5.0;

  // What may be round-off of single precision is this part of the largest change of an impulse
  // since the start of a search, as in inelastic_accelerated_gradient.cpp.
  constexpr double BLUR = 1.0 / 3.0e5;

  // Sweeps of which the largest change is in half of their number no smaller by this factor are of
  // no more use, if there were so many.
  constexpr long LONG = 1000;
  constexpr double STUCK = 0.8;

  // At most so many searches in single precision, each from the impulses of the one before.
  constexpr int MOST_SEARCHES = 3;

  // The states are computed anew after at most so many sweeps: the round-off of each stays in them.
  constexpr long REFRESH_EVERY = 50;

  // The residual is looked at in every so many sweeps at least, to see whether it comes down.
  constexpr long PLATEAU_EVERY = 50;

  // Sweeps diverge if their largest change of an impulse grows to so many times that of the first.
  constexpr double DIVERGED = 1.0e3;

  class Momentum {
   public:
    // Returns the weight of the next sweep.
    double next()
    {
      const double next_time = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * time_ * time_));
      const double along = (time_ - 1.0) / next_time;
      time_ = next_time;
      return along;
    }

    void restart() { time_ = 1.0; }

   private:
    double time_ = 1.0;    // t
  };

  // When the residual, which takes half a sweep, is worth a look.
  class Looks {
   public:
    explicit Looks(long sweeps) : next_(sweeps + 1) {}

    // `of_target` is that of swept::Swept.
    bool is_time(long sweep, double of_target) const
    { return sweep >= next_ && of_target <= hint_; }

    // Takes what a look has found.
    void see(long sweep, double of_target, double unsolved)
    {
      constexpr double MOST = 3.0, LEAST = 0.5;
      constexpr long PART = 40;
      if (unsolved > 0.0) hint_ = std::clamp(of_target / unsolved, LEAST, MOST);
      next_ = sweep + 2 + sweep / PART;
    }

    void wait(long until) { next_ = until; }

   private:
    long next_;
    double hint_ = 2.0;    // the largest change of a sweep at which residuals may be in the targets
  };

  // What is done between sweeps now and then.
  class Upkeep {
   public:
    explicit Upkeep(long sweeps) :
        begun_(sweeps), next_refresh_(sweeps + REFRESH_EVERY), next_look_(sweeps + LOOK_EVERY)
    {
    }

    // Collective. `idle_gap` is that of PackedSweeps::look_at_idle.
    template <typename Group>
    void run(long sweep, PackedSweeps<Group> &sweeps, double idle_gap, Host &host)
    {
      if (sweep >= next_refresh_) {
        sweeps.refresh(host);
        next_refresh_ = sweep + REFRESH_EVERY;
      }
      if (sweep >= next_look_) {
        sweeps.look_at_idle(idle_gap);
        next_look_ = sweep + std::max(LOOK_EVERY, (sweep - begun_) / LOOK_PART);
      }
    }

   private:
    long begun_, next_refresh_, next_look_;
  };

  // Returns the largest residual, over all ranks, as a part of its target. Collective.
  template <typename Group>
  double find_unsolved(const PackedSweeps<Group> &sweeps, double blur, Host &host)
  {
    double unsolved = sweeps.unsolved(blur);
    host.reduce(nullptr, 0, &unsolved, 1);
    return unsolved;
  }

}    // namespace

template <typename Group>
ColouredSweeps::End ColouredSweeps::sweep(PackedSweeps<Group> &sweeps, ContactProblem &problem,
                                          const SolverLimits &limits, const Scales &scales,
                                          Settling<PackedSweeps<Group>> &settling, Host &host,
                                          SolverResult &result)
{
  std::vector<double> &impulse = problem.contacts.impulse;
  Momentum momentum;
  Looks looks(result.iterations);
  Upkeep upkeep(result.iterations);
  ResidualTrend progress;
  const long begun = result.iterations;
  double first = 0.0, blur = 0.0;
  while (result.iterations < limits.max_iterations) {
    const swept::Swept mine = sweeps.sweep(momentum.next(), blur, host);
    ++result.iterations;
    double uphill = mine.uphill, maxima[3] = {mine.of_target, mine.change, mine.farthest};
    host.reduce(&uphill, 1, maxima, 3);
    const double of_target = maxima[0], change = maxima[1];
    if (first == 0.0) first = change;
    if (!std::isfinite(uphill) || !(change <= DIVERGED * first)) return End::NO_PROGRESS;
    progress.see(result.iterations - begun, of_target);
    result.trend.see(result.iterations, scales.length * change);
    blur = BLUR * maxima[2];

    if (looks.is_time(result.iterations, of_target)) {
      double unsolved = find_unsolved(sweeps, blur, host);
      looks.see(result.iterations, of_target, unsolved);
      const bool near = unsolved <= 1.0;
      const bool settled = near && settling.has_settled(limits.accuracy, host);
      if (settled) unsolved = find_unsolved(sweeps, blur, host);    // the targets are new
      if (settled && unsolved <= 1.0) {
        sweeps.impulses(scales, impulse);
        if (!judge(problem, limits, host, result)) return End::BLURRED;
        result.status = Status::CONVERGED;
        return End::SOLVED;
      }
      if (near && !settled) looks.wait(result.iterations + std::max(3L, result.iterations / 10));
    }
    if ((result.iterations - begun) % PLATEAU_EVERY == 0) {
      const auto end = leave_plateau(sweeps, problem, limits, scales, blur, host, result);
      if (end) return *end;
    }
    if ((result.iterations - begun) % CHECK_EVERY == 0) {
      sweeps.impulses(scales, impulse);
      if (is_infeasible(problem, gap_operator_, limits, host)) return End::INFEASIBLE;
      if (result.iterations - begun >= LONG && progress.least() >= STUCK * progress.earlier())
        return End::NO_PROGRESS;
    }
    if (uphill > 0.0) momentum.restart();
    upkeep.run(result.iterations, sweeps, IDLE_GAP * limits.tolerance / scales.length, host);
    settling.see(result.iterations);
  }
  return End::NO_PROGRESS;
}

template <typename Group>
std::optional<ColouredSweeps::End>
ColouredSweeps::leave_plateau(const PackedSweeps<Group> &sweeps, ContactProblem &problem,
                              const SolverLimits &limits, const Scales &scales, double blur,
                              Host &host, SolverResult &result)
{
  plateau_.see(result.iterations, find_unsolved(sweeps, blur, host));
  const bool tries = is_time_for_slow_modes(result.iterations);
  if (!tries && !is_on_plateau(result.iterations)) return std::nullopt;
  sweeps.impulses(scales, problem.contacts.impulse);
  if (end_on_plateau(tries, problem, limits, host, result)) {
    result.status = Status::CONVERGED;
    return End::SOLVED;
  }
  // Above the tolerance the other solver goes on, after twice as long.
  const long most = find_network(problem, host).most_on_plateau();
  const bool ends = most < result.iterations && plateau_.lasts(result.iterations, 2 * most);
  return ends ? std::optional(End::NO_PROGRESS) : std::nullopt;
}

template <typename Group>
bool ColouredSweeps::search(PackedSweeps<Group> &sweeps, ContactProblem &problem,
                            const SolverLimits &limits, const Scales &scales, Host &host,
                            SolverResult &result)
{
  std::vector<double> &impulse = problem.contacts.impulse;
  const auto idle_gap = [&] {
    return IDLE_GAP * std::max(limits.tolerance, result.residual.largest());
  };
  double refused = sweeps.prepare(problem, diagonal_, gap_, idle_gap(), scales, targets_,
                                  gap_operator_.change(), limits.tolerance, host)
      ? 0.0
      : 1.0;
  host.reduce(nullptr, 0, &refused, 1);
  if (refused > 0.0) return true;
  Settling settling(sweeps, limits.accuracy > 0.0 && limits.coarseness == 1.0, result.iterations);
  for (int k = 0; k < MOST_SEARCHES; ++k) {
    if (k > 0) sweeps.go_on(idle_gap(), gap_operator_.change(), limits.tolerance);
    const std::vector<double> before = impulse;
    const Residual residual_before = result.residual;
    const End end = sweep(sweeps, problem, limits, scales, settling, host, result);
    if (end == End::SOLVED) return true;
    if (end == End::BLURRED) continue;
    // The other solver goes on, from the better one of the impulses reached and those before. Where
    // there is no solution it begins anew: it shares out what is lacking.
    if (end == End::NO_PROGRESS) {
      sweeps.impulses(scales, impulse);
      if (judge(problem, limits, host, result)) result.status = Status::CONVERGED;
      if (result.residual.largest() <= residual_before.largest()) return true;
    }
    impulse = before;
    judge(problem, limits, host, result);
    return true;
  }
  return false;
}

bool ColouredSweeps::search_first(ContactProblem &problem, const SolverLimits &limits,
                                  const Scales &scales, Host &host, SolverResult &result)
{
  if (problem.any_wall_moves()) return true;
  // Whether there are bodies is a matter of the scene: some ranks may have none.
  double bodies = problem.bodies.empty() ? 0.0 : 1.0;
  host.reduce(nullptr, 0, &bodies, 1);
  return bodies > 0.0 ? search(of_bodies_, problem, limits, scales, host, result)
                      : search(of_particles_, problem, limits, scales, host, result);
}

}    // namespace inelastic
