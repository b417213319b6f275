#include "inelastic_search_chain.h"

#include "inelastic_solve.h"

#include <cmath>

namespace inelastic {

// Runs the searches, of those in single precision none unless these are of use. Returns how the
// last one has ended.
Status SearchChain::run(Solve &solve, bool single_precision)
{
  End end = End::GO_ON;
  const auto has_ended = [&] {
    return end == End::SOLVED || end == End::INFEASIBLE || solve.is_out_of_iterations();
  };
  for (const std::unique_ptr<Search> &search : searches_) {
    for (int k = 0; k < search->most_runs() && !has_ended(); ++k) {
      if (search->is_single() && !single_precision) break;
      end = search->run(solve);
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
  // A first guess with a residual above so many of its targets is left to double precision.
  constexpr double WITHIN_SINGLE = 1.0e12;
  gap_operator_.prepare(problem);
  const Guess guess = judge_first_guess(problem, host);
  Solve solve(problem, limits, {gap_operator_, targets_, gap_, diagonal_, conjugate_gradients_},
              guess, host);
  SolverResult &result = solve.result;
  const double unsolved = solve.set_targets();
  if (unsolved <= 1.0)
    result.status = Status::CONVERGED;
  else if (!std::isfinite(result.residual.feasibility))
    result.status = Status::NOT_FINITE;
  else if (limits.max_iterations > 0) {
    for (const std::unique_ptr<Search> &search : searches_) search->begin();
    result.status = run(solve, unsolved < WITHIN_SINGLE);
  }
  settle_for_tolerance(limits, result.residual.largest(), result);
  return result;
}

}    // namespace inelastic
