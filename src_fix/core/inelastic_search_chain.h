// A solver that is a chain of searches (inelastic_search.h), which run one after the other until
// one has solved the problem, or nothing more is to be had. The verdict whether impulses are a
// solution is always in double precision, by inelastic_gap_operator.h.

#pragma once

#include "inelastic_conjugate_gradients.h"
#include "inelastic_search.h"
#include "inelastic_solver.h"

#include <memory>
#include <vector>

namespace inelastic {

class SearchChain final : public Solver {
 public:
  using Searches = std::vector<std::unique_ptr<Search>>;

  // The last search works in double precision.
  explicit SearchChain(Searches searches) : searches_(std::move(searches)) {}

  SolverResult solve(ContactProblem &problem, const SolverLimits &limits, Host &host) override;
  // Where the first search has solved the problem it goes on with what it has packed; where the
  // first guess or another search has, that is not of this problem. The solve begins anew with
  // ghosts, too, since what ranks share may have changed, and with bodies, whose rounds follow
  // their turns and are more without that.
  SolverResult go_on(ContactProblem &problem, const Refined &refined, const SolverLimits &limits,
                     Host &host) override;

 private:
  SolverResult search(ContactProblem &problem, const SolverLimits &limits, const Refined *refined,
                      Host &host);
  Status run(Solve &solve, bool single_precision, const Refined *refined);

  Searches searches_;
  ConjugateGradients conjugate_gradients_;
  Guess guess_;
  // The search that has solved the last problem. What the others hold may be of an earlier one.
  const Search *solved_by_ = nullptr;
};

}    // namespace inelastic
