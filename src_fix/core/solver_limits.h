// How well a projection problem is to be solved, and with how much effort.

#pragma once

#include <limits>

namespace inelastic {

struct SolverLimits {
  double tolerance = 0.0;    // [length] largest residual of a solution
  long max_iterations = 0;
  // [length] Steps that move particles further than this are not sensible (infeasibility.h).
  double reach = std::numeric_limits<double>::infinity();
  // The part of what contacts change to which they are resolved (contact_targets.h); 0 = only the
  // tolerance counts.
  double accuracy = 0.0;
  // By this the targets are larger, at least 1. Above 1 velocities need not settle, either: enough
  // of a solution to tell which constraints change (projection.h).
  double coarseness = 1.0;
  // [length] Shorter lengths are round-off of positions: no target is below it, unless it is the
  // tolerance.
  double least_length = 0.0;
};

}    // namespace inelastic
