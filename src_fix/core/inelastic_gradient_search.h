// This search is the proximal optimized gradient method (Taylor, Hendrickx and Glineur, SIAM J.
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
// D is the diagonal of A: in impulses scaled by its root A has a unit diagonal. The weights are
// those of inelastic_momentum.h (L as of iteration k; g is L times the length of the step that
// unbound_k made). L must not be below the largest eigenvalue of the scaled A, of the constraints
// with impulses: with a smaller one this method diverges at once, where Nesterov's goes on for a
// while. Therefore L is raised to |A u|^2 / u.A u over these constraints where that is more, with u
// the last change: this costs no product with A. L is remembered from one solve to the next.
//
// In an impact most constraints never have an impulse. An iteration reads only those that have one
// or whose gap is near closed; every twentieth looks at the others, which are idle, as support
// vector machines are trained ("shrinking": Joachims, in Advances in Kernel Methods, MIT Press
// 1999, p. 169). Iterations look for the change of the impulses (inelastic_packed_iterations.h).

#pragma once

#include "inelastic_packed_iterations.h"
#include "inelastic_search.h"

#include <memory>
#include <optional>

namespace inelastic {

// L, which searches in both precisions have in common.
class Curvature {
 public:
  double value() const { return value_; }
  // L is let down a little from one solve to the next, so that it can follow a packing that becomes
  // less connected.
  void let_down();
  // Raises L if the last change of the impulses shows it too small.
  void see(const packed::Passed &passed);

 private:
  double value_ = 0.0;    // 0 = not yet known
};

template <typename Real> class GradientSearch final : public Search {
 public:
  explicit GradientSearch(std::shared_ptr<Curvature> curvature) : curvature_(std::move(curvature))
  {
  }

  void begin() override;
  End run(Solve &solve) override;
  bool is_single() const override { return sizeof(Real) < sizeof(double); }
  int most_runs() const override { return is_single() ? MOST_SEARCHES : 1; }

 private:
  // Takes note of how an iteration went. Returns its largest residual, in packed units.
  double see(const packed::Passed &passed, Solve &solve);

  // Returns how the search ends if more iterations from the impulses, in this precision, are of no
  // use.
  std::optional<End> judge_prospects(Solve &solve) const;

  bool ends_on_plateau(Solve &solve) const;

  std::shared_ptr<Curvature> curvature_;
  PackedIterations<Real> iterations_;
};

}    // namespace inelastic
