// This solver is accelerated projected gradient (Nesterov, Soviet Math. Dokl. 27 (1983) 372) with
// adaptive restart (O'Donoghue and Candes, Found. Comput. Math. 15 (2015) 715) on the dual problem
// of contact_problem.h. Iteration k makes the impulses lambda_(k+1) of m constraints [mass length /
// time] from the two before:
//
//   ahead        = lambda_k + beta_k (lambda_k - lambda_(k-1))
//   lambda_(k+1) = max(0, ahead - w(ahead) / (L D))
//
// D is the diagonal of A: in impulses scaled by its root A has a unit diagonal. The momentum beta_k
// follows Nesterov's sequence and starts again at 0 when it points uphill. L is an estimate of the
// largest eigenvalue of the scaled A. It follows the curvature met on the way, which costs no extra
// product with A, and is remembered from one call to the next.
//
// In an impact most constraints never have an impulse. An iteration reads only those that have one or
// whose gap is near closed; the idle ones are looked at in every twentieth, as support vector
// machines are trained ("shrinking": Joachims, in Advances in Kernel Methods, MIT Press 1999, p.
// 169). It does so in single precision if its round-off is far below the target, and otherwise in
// double precision (packed_iterations.h). The verdict whether impulses
// are a solution is always in double precision, by gap_operator.h.

#pragma once

#include "packed_iterations.h"
#include "solver.h"

#include <optional>
#include <vector>

namespace inelastic {

class AcceleratedProjectedGradient final : public Solver {
 public:
  SolverResult solve(ContactProblem &problem, const SolverLimits &limits, Host &host) override;

 private:
  // Iterates until the residual, judged in double precision, is at most the target, or more
  // iterations in this precision are of no use. Returns OUT_OF_ITERATIONS also if iterations are
  // left and single precision does not suffice.
  template <typename Real>
  Status iterate(PackedIterations<Real> &iterations, ContactProblem &problem,
                 const SolverLimits &limits, const Scales &scales, Host &host,
                 SolverResult &result);

  // Sets the residual of the impulses in `problem`. Returns whether it is at most the target.
  bool judge(const ContactProblem &problem, Host &host, SolverResult &result);

  // Returns how the search ends if more iterations from the impulses in `problem` are of no use.
  std::optional<Status> judge_prospects(const ContactProblem &problem, const SolverLimits &limits,
                                        Host &host, SolverResult &result);

  // Raises L if a change of the impulses shows it too small: change^T A change is `curved`, and
  // change^T D change is `change_squared`.
  void raise_curvature(double curved, double change_squared);

  double curvature_ = 0.0;    // L; 0 = not yet known
  PackedIterations<float> single_;
  PackedIterations<double> double_;
};

}    // namespace inelastic
