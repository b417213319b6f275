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

 private:
  Status run(Solve &solve, bool single_precision);

  Searches searches_;
  ConjugateGradients conjugate_gradients_;
};

}    // namespace inelastic
