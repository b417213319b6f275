// Solvers of the projection problem (contact_problem.h). All work on the dual: they look for the
// impulses, and are judged by the same residual, in units of length:
//
//   feasibility       max over all constraints of       -w_c      (overlap left at the end of the
// step)
//   complementarity   max over constraints with impulse of w_c    (gap left where a force acts)
//
// A solver takes its first guess from ContactSet::impulse if it warm-starts (what is negative there
// counts as zero), and leaves its result there.

#pragma once

#include "contact_problem.h"

#include <memory>
#include <string>

namespace inelastic {

struct Residual {
  double feasibility = 0.0;        // [length], >= 0
  double complementarity = 0.0;    // [length], >= 0
};

// Local to this rank unless a host reduces it. Infinite when a number is not finite.
Residual residual(const double *gap_at_end, const double *impulse, std::size_t count);

struct SolverLimits {
  double tolerance = 0.0;    // [length], both residuals must come down to it
  long max_iterations = 0;
};

struct SolverResult {
  bool converged = false;
  long iterations = 0;
  Residual residual;
};

class Solver {
 public:
  virtual ~Solver() = default;
  virtual SolverResult solve(ContactProblem &problem, const SolverLimits &limits, Host &host) = 0;
};

// The paper's solver: projected gradient with a fixed step from zero impulses, which stops on
// feasibility alone. The step is 1 over the largest eigenvalue of A, from power iteration that is
// not counted among the iterations.
class Uzawa final : public Solver {
 public:
  SolverResult solve(ContactProblem &problem, const SolverLimits &limits, Host &host) override;

 private:
  GapOperator gap_operator_;
  std::vector<double> gap_, product_;
};

// Largest eigenvalue of A = h G M^-1 G^T [time / mass] by power iteration, from below and mostly to
// 1e-3.
double largest_eigenvalue(const ContactProblem &problem, Host &host);

// "apgd" or "uzawa"; nullptr for any other name.
std::unique_ptr<Solver> make_solver(const std::string &name);

}    // namespace inelastic
