// A proof, from impulses, that no sensible velocities are admissible.
//
// Weak duality and the inequality of Cauchy and Schwarz give, for all velocities V with
// gap + h G V >= -tolerance and all impulses lambda >= 0,
//
//   h |V - V*|_M  >=  (-lambda . w(0) - tolerance sum lambda) / |G^T lambda|_(M^-1)
//
// in the notation of inelastic_contact_problem.h. With springs (inelastic_contact_set.h) lambda . C
// lambda is subtracted above, too: the bound then holds for velocities at which each spring gives
// way by no more than its C lambda. Divided by the root of the mass that the impulses act on, the
// right side is a length: the root mean square, by mass, of the distances from the predicted
// positions at which admissible velocities would leave these particles, is at least so long. It is
// not sensible to go on when this length is above SolverLimits::longest_move and above ten times
// every overlap and every predicted motion. Without admissible velocities the impulses of a solver
// grow for ever along a direction in which they balance, and the bound grows with them. With
// admissible velocities nearby the bound never gets so large.

#pragma once

#include "inelastic_solver.h"

namespace inelastic {

// Returns whether problem.contacts.impulse, whatever it is, is such a proof. `gap_operator` must be
// prepared for the problem. Collective.
bool is_infeasible(const ContactProblem &problem, GapOperator &gap_operator,
                   const SolverLimits &limits, Host &host);

// Number of iterations from one call of is_infeasible to the next; a call costs about two
// iterations.
constexpr long CHECK_EVERY = 500;

}    // namespace inelastic
