// The projection of one step onto ALL constraints, with only those that matter in the problem.
//
// The set is generated (for the theory see Palmer, Aktulga and Gao, arXiv 2506.14097): solve with
// the constraints at hand, let the source look at everything that can touch, add what the solution
// violates, solve again from the impulses reached, until nothing is added. A source may also
// replace the linearisation of a constraint whose gap is not convex (a concave wall) by one about
// the new end-of-step position.

#pragma once

#include "contact_problem.h"
#include "solver.h"

#include <vector>

namespace inelastic {

class ConstraintSource {
 public:
  // Given the velocities (3 per particle) that solve the problem as it stands, adds the constraints
  // that they violate by more than the tolerance and re-linearises where needed. Returns how many
  // constraints this rank added or changed.
  virtual long refine(const std::vector<double> &velocity, ContactProblem &problem) = 0;

 protected:
  ~ConstraintSource() = default;    // not virtual: sources are never owned through this interface
};

struct ProjectionResult {
  bool converged = false;     // the solver met the tolerance in every round
  bool complete = false;      // the last round left nothing to add or change
  bool infeasible = false;    // it is certain that no sensible velocities are admissible
  long iterations = 0;        // over all rounds
  int rounds = 0;
  Residual residual;         // over all constraints that came to light
  double round_off = 0.0;    // [length] of the last solve: see SolverResult
  ResidualTrend trend;       // likewise

  // Unless converged and complete, and where this rank has any: the constraint that is farthest
  // from being met, and the gap [length] that it leaves at the end of the step.
  static constexpr std::size_t NONE = static_cast<std::size_t>(-1);
  std::size_t worst = NONE;
  double worst_gap = 0.0;
};

// Solves at least once. On return `velocity` (3 per particle, copies included) holds the projection
// of problem.predicted_velocity and problem.contacts.impulse the impulses. When the result is not
// complete, `velocity` knows nothing of the constraints that were added last, and their impulses are 0.
ProjectionResult project(ContactProblem &problem, ConstraintSource &source, Solver &solver,
                         const SolverLimits &limits, int max_rounds, Host &host,
                         std::vector<double> &velocity);

}    // namespace inelastic
