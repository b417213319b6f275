// This search makes Gauss-Seidel sweeps on the dual problem of inelastic_contact_problem.h, each
// constraint after the other, with momentum and adaptive restart (inelastic_momentum.h). In
// impulses scaled by the root of the diagonal of A, sweep k starts from
//
//   led_k = x_k + along_k (x_k - x_k-1)
//
// and visits the constraints in the order of their colours (inelastic_packed_sweeps.h); the states
// of particles and bodies are linear in the impulses, and are extrapolated alike.
//
// A sweep needs about half as many visits as inelastic_gradient_search.h needs iterations, and a
// visit takes half the time. But no theory says that sweeps with momentum end. Where they do not,
// where impulses move walls, and where so many constraints are those of one body that few can be
// visited together, another search goes on.
//
// Sweeps work in single precision on the change of the impulses since a centre, whose gaps double
// precision has found. When the residual is down to what may be round-off of that change, the
// present impulses become the centre, and the sweeps go on from there with their momentum: this is
// iterative refinement (Wilkinson, Rounding Errors in Algebraic Processes, 1963, ch. 3).

#pragma once

#include "inelastic_packed_sweeps.h"
#include "inelastic_search.h"
#include "inelastic_settling.h"

#include <optional>

namespace inelastic {

class ColouredSweeps final : public Search {
 public:
  End run(Solve &solve) override;
  bool can_go_on() const override { return can_go_on_; }
  End go_on(Solve &solve, const Refined &refined) override;
  bool is_single() const override { return true; }

 private:
  class Refinement;

  template <typename Batch> End search(PackedSweeps<Batch> &sweeps, Solve &solve);
  template <typename Batch> End search_on(PackedSweeps<Batch> &sweeps, Solve &solve);

  // Sweeps until the impulses are a solution, or sweeps are of no more use.
  template <typename Batch>
  End sweep(PackedSweeps<Batch> &sweeps, Refinement &refinement, Solve &solve);

  PackedSweeps<swept::ParticleBatch> of_particles_;
  PackedSweeps<swept::BodyBatch> of_bodies_;
  bool can_go_on_ = false;
};

}    // namespace inelastic
