// The solvers by their names: the only file that knows all of them.

#pragma once

#include "inelastic_solver.h"

#include <memory>
#include <string>

namespace inelastic {

// Makes the solver with a name: "sweeps" or "apgd", chains of searches
// (inelastic_search_chain.h), or "uzawa" (inelastic_uzawa.h); returns nullptr for any other name.
std::unique_ptr<Solver> make_solver(const std::string &name);

}    // namespace inelastic
