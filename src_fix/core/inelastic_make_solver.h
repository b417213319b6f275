// The solvers by their names: the only file that knows all of them.

#pragma once

#include "inelastic_solver.h"

#include <memory>
#include <string>

namespace inelastic {

// Makes the solver named "apgd" (inelastic_accelerated_gradient.h) or "uzawa" (inelastic_uzawa.h);
// returns nullptr for any other name.
std::unique_ptr<Solver> make_solver(const std::string &name);

}    // namespace inelastic
