// Solvers of the projection problem (contact_problem.h). All work on the dual: they look for the
// impulses, and are judged by the same residual, in units of length:
//
//   feasibility       max over all constraints of       -w_c    (overlap at the end of the step)
//   complementarity   max over constraints with impulse of w_c  (gap left where a force acts)
//
// A solver takes its first guess from ContactSet::impulse if it warm-starts (what is negative there
// counts as zero), and leaves its result there.

#pragma once

#include "contact_problem.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <string>

namespace inelastic {

struct Residual {
  double feasibility = 0.0;        // [length], >= 0
  double complementarity = 0.0;    // [length], >= 0
};

// Local to this rank unless a host reduces it. Infinite when a number is not finite.
Residual residual(const double *gap_at_end, const double *impulse, std::size_t count);

// How the larger of the two residuals comes down while a solver iterates. Where it no longer does,
// more iterations are of no use.
class ResidualTrend {
 public:
  // Iterations count from 1.
  void see(long iteration, double residual)
  {
    least_ = std::min(least_, residual);
    if (iteration < 2 * mark_) return;
    before_mark_ = at_mark_;
    at_mark_ = least_;
    mark_ = iteration;
  }

  double least() const { return least_; }
  // The least one after a quarter to a half of the iterations; infinite where those were too few.
  double earlier() const { return before_mark_; }

 private:
  static constexpr double NONE = std::numeric_limits<double>::infinity();
  long mark_ = 1;
  double least_ = NONE, at_mark_ = NONE, before_mark_ = NONE;
};

struct SolverLimits {
  double tolerance = 0.0;    // [length], both residuals must come down to it
  long max_iterations = 0;
  // [length] no step is to move particles further: see is_infeasible
  double reach = std::numeric_limits<double>::infinity();
};

struct SolverResult {
  bool converged = false;
  bool infeasible = false;    // it is certain that no sensible velocities are admissible
  long iterations = 0;
  Residual residual;
  double round_off = 0.0;    // [length] of the gaps where impulses act; no residual goes below it
  ResidualTrend trend;
};

// Whether the impulses at hand, whatever they are, prove that there are no admissible velocities.
// For every V with gap + h G V >= -tolerance, lambda >= 0 gives (weak duality, Cauchy-Schwarz)
//
//   h |V - V*|_M  >=  (-lambda . w(0) - tolerance sum lambda) / |G^T lambda|_(M^-1)
//
// Where that is more than `reach`, and ten times as far as any overlap or predicted motion, in the
// mean over the masses that the impulses act on, there is no sense in going on. Without admissible
// velocities the impulses of a solver grow for ever along a direction in which they balance, and the
// bound grows with them. With velocities nearby it is never reached.
// Collective. Costs about two iterations: call it every CHECK_EVERY of them.
bool is_infeasible(const ContactProblem &problem, GapOperator &gap_operator,
                   const SolverLimits &limits, Host &host);
constexpr long CHECK_EVERY = 500;

class Solver {
 public:
  virtual ~Solver() = default;
  virtual SolverResult solve(ContactProblem &problem, const SolverLimits &limits, Host &host) = 0;

  // Prepared for the problem of the last solve; if that has converged, its result is what the operator
  // was last applied to.
  GapOperator &gap_operator() { return gap_operator_; }

 protected:
  GapOperator gap_operator_;
};

// The paper's solver: projected gradient with a fixed step from zero impulses, which stops on
// feasibility alone. The step is 1 over the largest eigenvalue of A, from power iteration that is
// not counted among the iterations.
class Uzawa final : public Solver {
 public:
  SolverResult solve(ContactProblem &problem, const SolverLimits &limits, Host &host) override;

 private:
  std::vector<double> gap_;
};

// Largest eigenvalue of A = h G M^-1 G^T [time / mass] by power iteration, from below and mostly to
// 1e-3.
double largest_eigenvalue(const ContactProblem &problem, Host &host);

// "apgd" or "uzawa"; nullptr for any other name.
std::unique_ptr<Solver> make_solver(const std::string &name);

}    // namespace inelastic
