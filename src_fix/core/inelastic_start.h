// What a search for impulses begins from (inelastic_search.h), and the units of packed numbers.

#pragma once

#include "inelastic_contact_problem.h"
#include "inelastic_contact_targets.h"

#include <vector>

namespace inelastic {

// The units of packed numbers. Both are powers of two, so that a scene in other units takes the
// same steps bit by bit.
struct Scales {
  double length = 1.0;     // [length]
  double impulse = 1.0;    // [mass length / time]
};

// A problem whose impulses double precision has judged; all of it outlives the search.
struct Start {
  const ContactProblem &problem;
  // The gaps w at the end of the step [length] and the diagonal of A [time / mass], one number per
  // constraint each (inelastic_contact_problem.h).
  const std::vector<double> &gap, &diagonal;
  // The changes of velocity by the impulses (GapOperator::change), with which the targets were set.
  const std::vector<double> &change;
  const ContactTargets &targets;
  double tolerance;    // [length] No target is above it.
  Scales scales;
};

}    // namespace inelastic
