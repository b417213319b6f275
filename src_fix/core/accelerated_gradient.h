// Accelerated projected gradient on the dual (Nesterov 1983; restarts after O'Donoghue and Candes,
// Found. Comput. Math. 15 (2015) 715), in impulses scaled so that A has a unit diagonal. The step
// 1/L follows the curvature met on the way, which costs no extra product with A; L is remembered
// from one call to the next.
//
// An iteration reads every constraint once, in single precision where its round-off is far below
// the tolerance. Whether a solution is one is always judged in double precision, by the operator
// of contact_problem.h.

#pragma once

#include "solver.h"

#include <memory>

namespace inelastic {

class AcceleratedProjectedGradient final : public Solver {
 public:
  AcceleratedProjectedGradient();
  ~AcceleratedProjectedGradient() override;
  SolverResult solve(ContactProblem &problem, const SolverLimits &limits, Host &host) override;

 private:
  template <typename Real> class Iterations;
  struct Scales;

  // Iterates until the residual, judged in double precision, is within the limits. Gives up where
  // the precision of `Real` does not suffice.
  template <typename Real>
  void iterate(Iterations<Real> &iterations, ContactProblem &problem, const SolverLimits &limits,
               const Scales &scales, Host &host, SolverResult &result);

  // Residual of the impulses in `problem`, over all ranks, and whether it is within the limits.
  void judge(const ContactProblem &problem, const SolverLimits &limits, Host &host,
             SolverResult &result);

  // L, an estimate of the largest eigenvalue of the scaled A; 0 = unknown
  double curvature_ = 0.0;
  std::vector<double> diagonal_;    // of A
  std::vector<double> gap_;
  std::unique_ptr<Iterations<float>> single_;
  std::unique_ptr<Iterations<double>> double_;
};

}    // namespace inelastic
