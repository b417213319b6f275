// This solver is the proximal optimized gradient method (Taylor, Hendrickx and Glineur, SIAM J.
// Optim. 27 (2017) 1283), an accelerated projected gradient, with adaptive restart (Kim and
// Fessler, J. Optim. Theory Appl. 178 (2018) 240) on the dual problem of
// inelastic_contact_problem.h. It needs about 0.7 times as many iterations as Nesterov's method
// with the same L. From the impulses lambda_k of m constraints [mass length / time] iteration k
// makes
//
//   down_k       = -w(lambda_k) / (L D)
//   led_k        = lambda_k + down_k
//   unbound_k+1  = led_k + along_k (led_k - led_k-1) + beyond_k down_k
//                  + back_k (unbound_k - lambda_k)
//   lambda_k+1   = max(l, unbound_k+1),   l the least impulses
//
// D is the diagonal of A: in impulses scaled by its root A has a unit diagonal. The weights follow
// from t_0 = 1 and t_k+1 = (1 + sqrt(1 + 4 t_k^2)) / 2:
//
//   along_k  = (t_k - 1) / t_k+1
//   beyond_k = t_k / t_k+1
//   back_k   = (t_k - 1) / (t_k+1 g_k),   g_0 = 1,   g_k+1 = (2 t_k + t_k+1 - 1) / t_k+1
//
// (L as of iteration k; g is L times the length of the step that unbound_k made), and t is 1 again
// where the dual function rises along the last change. L must not be below the largest eigenvalue
// of the scaled A, of the constraints with impulses: with a smaller one this method diverges at
// once, where Nesterov's goes on for a while. Therefore L is raised to |A u|^2 / u.A u over these
// constraints where that is more, with u the last change: this costs no product with A. L is
// remembered from one call to the next.
//
// In an impact most constraints never have an impulse. An iteration reads only those that have one
// or whose gap is near closed; every twentieth looks at the others, which are idle, as support
// vector machines are trained ("shrinking": Joachims, in Advances in Kernel Methods, MIT Press
// 1999, p. 169). Iterations look for the change of the impulses in single precision. Where the
// round-off of that shows, they start again from the impulses reached, and in the end go on in
// double precision (inelastic_packed_iterations.h). The verdict whether impulses are a solution is
// always in double precision, by inelastic_gap_operator.h.

#pragma once

#include "inelastic_conjugate_gradients.h"
#include "inelastic_packed_iterations.h"
#include "inelastic_solver.h"

#include <optional>
#include <vector>

namespace inelastic {

class AcceleratedProjectedGradient : public Solver {
 public:
  SolverResult solve(ContactProblem &problem, const SolverLimits &limits, Host &host) override;

 protected:
  // Searches before the searches of this solver do, which go on from the impulses that it leaves if
  // `result` is not yet settled. The first guess is judged, and the ghosts are chosen. Returns
  // whether another search in single precision may be of use. Collective.
  virtual bool search_first(ContactProblem &, const SolverLimits &, const Scales &, Host &,
                            SolverResult &)
  { return true; }

  // Sets the gaps gap_, the residual and the targets of the impulses in `problem`. Returns whether
  // every residual is at most its target.
  bool judge(const ContactProblem &problem, const SolverLimits &limits, Host &host,
             SolverResult &result);

  // Tells whether masses are so different that a few slow modes may be what keeps the residual up,
  // and these are to be solved otherwise now.
  bool is_time_for_slow_modes(long iteration);

  // Tries conjugate gradients (inelastic_conjugate_gradients.h) on the impulses in `problem`. If
  // they solve the problem, the result is settled and this returns true. Otherwise all stays as it
  // was but the number of iterations. Collective.
  bool solve_slow_modes(ContactProblem &problem, const SolverLimits &limits, Host &host,
                        SolverResult &result);

  // Tells whether the residual has not come down for so long that it is worth to look why.
  bool is_on_plateau(long iteration) const
  { return plateau_.lasts(iteration, Network::LEAST_ON_PLATEAU); }

  // Ends a search on a plateau, if it can: with `tries` slow modes are tried first. Otherwise the
  // impulses in `problem`, which are judged here, will do if their residual has not come down for
  // long and is within the tolerance, and little is left of what contacts change, but more than the
  // default accuracy leaves: the targets are not to be had. Collective.
  bool end_on_plateau(bool tries, ContactProblem &problem, const SolverLimits &limits, Host &host,
                      SolverResult &result);

  // Returns how the search ends if more iterations from the impulses in `problem` are of no use, in
  // the precision that it has.
  std::optional<Status> judge_prospects(ContactProblem &problem, const SolverLimits &limits,
                                        bool single_precision, Host &host, SolverResult &result);

  ResidualTrend trend_of_targets_;    // of the largest residual as a part of its target
  Plateau plateau_;
  bool is_stuck_ = false;      // single precision gets no further
  double mass_ratio_ = 1.0;    // of the heaviest to the lightest that can move

 private:
  // Iterates from the impulses in `problem`, whose gaps are gap_, until all residuals, judged in
  // double precision, are at most their targets and velocities settle, or more iterations in this
  // precision are of no use. Returns OUT_OF_ITERATIONS also if iterations are left and this
  // precision does not suffice.
  template <typename Real>
  Status iterate(PackedIterations<Real> &iterations, ContactProblem &problem,
                 const SolverLimits &limits, const Scales &scales, Host &host,
                 SolverResult &result);

  // Takes note of how an iteration went. Returns its largest residual, in packed units.
  double see(const packed::Passed &passed, const Scales &scales, SolverResult &result);

  // Raises L if the last change of the impulses shows it too small.
  void raise_curvature(const packed::Passed &passed);

  double curvature_ = 0.0;    // L; 0 = not yet known
  ConjugateGradients conjugate_gradients_;
  PackedIterations<float> single_;
  PackedIterations<double> double_;
};

}    // namespace inelastic
