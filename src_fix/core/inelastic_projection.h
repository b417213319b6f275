// The projection of one step's velocities onto ALL constraints, of which only those that matter are
// in the problem.
//
// The set of constraints is generated (for the theory see Palmer, Aktulga and Gao, arXiv
// 2506.14097). One round solves the problem with the constraints at hand; then the source of
// constraints looks at everything that can touch and adds what the solution violates. The next
// round starts from the impulses reached, until nothing is added. A source may also replace the
// linearisation of a constraint whose gap is not convex (a concave wall) by one about the new
// position at the end of the step.

#pragma once

#include "inelastic_contact_problem.h"
#include "inelastic_refined.h"
#include "inelastic_solver.h"

#include <algorithm>
#include <vector>

namespace inelastic {

class ConstraintSource {
 public:
  // Takes the velocities (3 per slot) that solve the problem as it stands, adds the constraints
  // that they violate by more than the tolerance, and linearises constraints again where needed.
  // Tells what this rank added or changed.
  virtual Refined refine(const std::vector<double> &velocity, ContactProblem &problem) = 0;

 protected:
  ~ConstraintSource() = default;    // not virtual: sources are never owned through this interface
};

struct ProjectionResult {
  // CONVERGED if the last round converged and left nothing to add or change; OUT_OF_ROUNDS if it
  // converged and left something; otherwise the reason why the last round did not converge.
  Status status = Status::OUT_OF_ITERATIONS;
  long iterations = 0;    // over all rounds
  int rounds = 0;
  Residual residual;         // over all constraints that came to light, on all ranks
  double round_off = 0.0;    // [length] of the last solve: see SolverResult
  // Of the last solve: see SolverResult.
  bool accurate = false;
  double unresolved = 0.0;
  ResidualTrend trend;    // of the last solve

  // The constraint of this rank that is farthest from being met, and the gap [length] that it
  // leaves at the end of the step. NONE if the status is CONVERGED or this rank has no such
  // constraint.
  static constexpr std::size_t NONE = static_cast<std::size_t>(-1);
  std::size_t worst = NONE;
  double worst_gap = 0.0;
};

// Returns the status of two projections together: CONVERGED if both have converged, INFEASIBLE if
// either is, and otherwise the later of the two in the order of the enumeration.
inline Status worse(Status a, Status b)
{ return std::max(a, b); }

// Projects problem.predicted_velocity in one to `max_rounds` rounds. On return `velocity` (3 per
// slot) holds the projection and problem.contacts.impulse the impulses. If the last round added
// constraints, `velocity` knows nothing of them and their impulses are 0. Coarse limits are coarse
// until a round has left nothing to add or change; the rounds after it are solved to the targets.
// Collective.
ProjectionResult project(ContactProblem &problem, ConstraintSource &source, Solver &solver,
                         const SolverLimits &limits, int max_rounds, Host &host,
                         std::vector<double> &velocity);

}    // namespace inelastic
