// How well a projection problem is to be solved, and with how much effort.

#pragma once

#include <limits>

namespace inelastic {

struct SolverLimits {
  double tolerance = 0.0;    // [length] largest residual of a solution
  long max_iterations = 0;
  // [length] Steps that move particles further than this are not sensible
  // (inelastic_infeasibility.h).
  double longest_move = std::numeric_limits<double>::infinity();
  // Contacts are resolved to this part of the changes of velocity that they make
  // (inelastic_contact_targets.h); 0 = only the tolerance counts.
  double accuracy = 0.0;
  // At least 1: targets are larger by this factor. Above 1 velocities need not settle, either; such
  // a solution is good enough to tell which constraints change (inelastic_projection.h).
  double coarseness = 1.0;
  // A search goes on to its targets, also where that takes many iterations more than the tolerance.
  bool to_targets = false;
  // [length] Shorter lengths are round-off of positions: no target is below it, unless it is the
  // tolerance.
  double least_length = 0.0;
};

}    // namespace inelastic
