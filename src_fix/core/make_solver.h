// The solvers by their names: the only file that knows all of them.

#pragma once

#include "solver.h"

#include <memory>
#include <string>

namespace inelastic {

// Makes the solver named "apgd" (accelerated_gradient.h) or "uzawa" (uzawa.h); returns nullptr for
// any other name.
std::unique_ptr<Solver> make_solver(const std::string &name);

}    // namespace inelastic
