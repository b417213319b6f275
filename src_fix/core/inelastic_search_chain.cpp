#include "inelastic_search_chain.h"

#include "inelastic_solve.h"

#include <cmath>

namespace inelastic {

// Runs the searches, of those in single precision none unless these are of use. With `refined` the
// first one goes on. Returns how the last one has ended.
Status SearchChain::run(Solve &solve, bool single_precision, const Refined *refined)
{
  End end = End::GO_ON;
  const auto has_ended = [&] {
    return end == End::SOLVED || end == End::INFEASIBLE || solve.is_out_of_iterations();
  };
  for (const std::unique_ptr<Search> &search : searches_) {
    for (int k = 0; k < search->most_runs() && !has_ended(); ++k) {
      if (search->is_single() && !single_precision) break;
      end = refined ? search->go_on(solve, *refined) : search->run(solve);
      refined = nullptr;
      if (end == End::SOLVED) solved_by_ = search.get();
      if (end == End::ROUND_OFF && search->is_single()) {
        single_precision = false;
        end = End::GO_ON;
      }
      // All other ends of a search have judged what they leave.
      if (end == End::NOT_FINITE && search->is_single()) solve.find_gaps();
    }
  }
  switch (end) {
    case End::SOLVED:
      return Status::CONVERGED;
    case End::INFEASIBLE:
      return Status::INFEASIBLE;
    case End::NOT_FINITE:
      return Status::NOT_FINITE;
    case End::ROUND_OFF:
      return Status::ROUND_OFF;
    case End::GO_ON:
      break;
  }
  return Status::OUT_OF_ITERATIONS;
}

SolverResult SearchChain::solve(ContactProblem &problem, const SolverLimits &limits, Host &host)
{
  gap_operator_.prepare(problem);
  guess_ = judge_first_guess(problem, host);
  return search(problem, limits, nullptr, host);
}

SolverResult SearchChain::go_on(ContactProblem &problem, const Refined &refined,
                                const SolverLimits &limits, Host &host)
{
  if (refined.anew || !problem.bodies.empty() || host.has_ghosts() ||
      solved_by_ != searches_.front().get() || !solved_by_->can_go_on())
    return solve(problem, limits, host);
  judge_refined(problem, refined, limits, guess_);
  return search(problem, limits, &refined, host);
}

// Searches from the first guess, or goes on after the last search.
SolverResult SearchChain::search(ContactProblem &problem, const SolverLimits &limits,
                                 const Refined *refined, Host &host)
{
  // A first guess with a residual above so many of its targets is left to double precision.
  constexpr double WITHIN_SINGLE = 1.0e12, UNSOLVED_IN_SINGLE = 0.5 * WITHIN_SINGLE;
  Solve solve(problem, limits, {gap_operator_, targets_, gap_, diagonal_, conjugate_gradients_},
              guess_, host);
  SolverResult &result = solve.result;
  solved_by_ = nullptr;
  // What was refined is not solved any more, and single precision has served until now: to find the
  // targets of all constraints again would tell no more than that.
  const double unsolved = refined ? UNSOLVED_IN_SINGLE : solve.set_targets();
  if (unsolved <= 1.0)
    result.status = Status::CONVERGED;
  else if (!std::isfinite(result.residual.feasibility))
    result.status = Status::NOT_FINITE;
  else if (limits.max_iterations > 0) {
    for (const std::unique_ptr<Search> &search : searches_) search->begin();
    result.status = run(solve, unsolved < WITHIN_SINGLE, refined);
  }
  settle_for_tolerance(limits, result.residual.largest(), result);
  return result;
}

}    // namespace inelastic
