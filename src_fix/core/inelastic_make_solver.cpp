#include "inelastic_make_solver.h"

#include "inelastic_coloured_sweeps.h"
#include "inelastic_gradient_search.h"
#include "inelastic_search_chain.h"
#include "inelastic_uzawa.h"

#include <utility>

namespace inelastic {

std::unique_ptr<Solver> make_solver(const std::string &name)
{
  if (name == "uzawa") return std::make_unique<Uzawa>();
  if (name != "sweeps" && name != "apgd") return nullptr;
  SearchChain::Searches searches;
  if (name == "sweeps") searches.push_back(std::make_unique<ColouredSweeps>());
  const auto curvature = std::make_shared<Curvature>();
  searches.push_back(std::make_unique<GradientSearch<float>>(curvature));
  searches.push_back(std::make_unique<GradientSearch<double>>(curvature));
  return std::make_unique<SearchChain>(std::move(searches));
}

}    // namespace inelastic
