#include "inelastic_solve.h"

#include "inelastic_search.h"

#include <algorithm>
#include <cmath>

namespace inelastic {

Solve::Solve(ContactProblem &of_problem, const SolverLimits &of_limits, const Kept &kept,
             const Guess &guess, Host &of_host) :
    problem(of_problem), limits(of_limits), host(of_host), kept_(kept),
    mass_ratio_(guess.largest_inverse_mass / guess.least_inverse_mass)
{
  result.residual = guess.residual;
  scales_.length = std::exp2(std::ilogb(guess.largest_length));
  scales_.impulse = scales_.length / std::exp2(std::ilogb(guess.largest_diagonal));
}

Start Solve::start() const
{
  return {problem,       kept_.gap,        kept_.diagonal, kept_.gap_operator.change(),
          kept_.targets, limits.tolerance, scales_};
}

double Solve::idle_gap() const
{ return IDLE_GAP * std::max(limits.tolerance, result.residual.largest()); }

double Solve::set_targets()
{
  unsolved_ = kept_.targets.judge(problem, limits, kept_.gap_operator, kept_.gap, host);
  result.accurate = unsolved_ <= 1.0;
  result.unresolved = kept_.targets.unresolved();
  return unsolved_;
}

bool Solve::judge()
{
  find_gaps();
  set_targets();
  result.residual = kept_.targets.residual();
  return result.accurate;
}

void Solve::choose_ghosts()
{
  if (chose_ghosts_ || !host.has_ghosts()) return;
  chose_ghosts_ = true;
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

bool Solve::is_time_for_slow_modes()
{
  constexpr double VERY_DIFFERENT = 1000.0;
  return plateau.is_time_to_try(result.iterations, mass_ratio_ >= VERY_DIFFERENT);
}

bool Solve::may_have_slow_modes()
{
  // With a ratio of n the smallest eigenvalues of A fall to about its n-th part.
  constexpr double DIFFERENT = 30.0;
  return mass_ratio_ >= DIFFERENT ||
      plateau.lasts(result.iterations, find_network(problem, host).enough_iterations());
}

bool Solve::ends_on_plateau(bool tries)
{
  const bool tried = tries && may_have_slow_modes();
  if (tried && solve_slow_modes()) return true;
  if (!plateau.lasts(result.iterations, most_on_plateau())) return false;
  if (judge()) return true;
  const bool will_do = result.residual.largest() <= limits.tolerance &&
      result.unresolved <= RESOLVED_ON_PLATEAU && result.unresolved > WELL_RESOLVED;
  if (!will_do || limits.to_targets) return false;
  // A few planes of a curved wall that face nearly the same way are enough for a plateau, and
  // little that is left there moves a grain far.
  if (!tried && solve_slow_modes()) return true;
  judge();    // what these have tried is no solution
  return true;
}

bool Solve::solve_slow_modes()
{
  const std::vector<double> before = impulse();
  // The searches that may go on have taken their gaps and targets from the solver's.
  ContactTargets targets = kept_.targets;
  std::vector<double> gap(before.size());
  double unsolved = 0.0;
  const auto judge_here = [&] {
    kept_.gap_operator.apply(problem, impulse().data(), gap.data(), host);
    return unsolved = targets.judge(problem, limits, kept_.gap_operator, gap, host);
  };
  judge_here();
  result.iterations +=
      kept_.conjugate_gradients.search(problem, kept_.gap_operator, kept_.diagonal, gap,
                                       limits.max_iterations - result.iterations, judge_here, host);
  if (unsolved <= 1.0 && judge()) return true;
  impulse() = before;
  return false;
}

}    // namespace inelastic
