// This solver makes Gauss-Seidel sweeps on the dual problem of inelastic_contact_problem.h, each
// constraint after the other, with Nesterov's momentum and adaptive restart. In impulses scaled by
// the root of the diagonal of A, sweep k starts from
//
//   led_k = x_k + along_k (x_k - x_k-1),   along_k = (t_k - 1) / t_k+1
//   t_0 = 1,   t_k+1 = (1 + sqrt(1 + 4 t_k^2)) / 2
//
// and visits the constraints in the order of their colours (inelastic_packed_sweeps.h); the states
// of particles and bodies are linear in the impulses, and are led on alike. The momentum starts
// anew where the dual function rises along the last change (O'Donoghue and Candes, Found. Comput.
// Math. 15 (2015) 715).
//
// A sweep needs about half as many visits as inelastic_accelerated_gradient.h needs iterations, and
// a visit takes half the time. But no theory says that sweeps with momentum end. Where they do not,
// where impulses move walls, where so many constraints are those of one body that few can be
// visited together, and where single precision does not suffice, that solver goes on. So it judges
// all ends of a search.

#pragma once

#include "inelastic_accelerated_gradient.h"
#include "inelastic_packed_sweeps.h"
#include "inelastic_settling.h"

#include <optional>

namespace inelastic {

class ColouredSweeps final : public AcceleratedProjectedGradient {
 protected:
  bool search_first(ContactProblem &problem, const SolverLimits &limits, const Scales &scales,
                    Host &host, SolverResult &result) override;

 private:
  template <typename Group>
  bool search(PackedSweeps<Group> &sweeps, ContactProblem &problem, const SolverLimits &limits,
              const Scales &scales, Host &host, SolverResult &result);

  enum class End {
    SOLVED,
    BLURRED,    // by the round-off of single precision
    NO_PROGRESS,
    INFEASIBLE
  };

  // Sweeps until the impulses are a solution, or sweeps are of no more use.
  template <typename Group>
  End sweep(PackedSweeps<Group> &sweeps, ContactProblem &problem, const SolverLimits &limits,
            const Scales &scales, Settling<PackedSweeps<Group>> &settling, Host &host,
            SolverResult &result);

  // Returns how sweeps end because the residual no longer comes down: a few slow modes are solved
  // otherwise, or the residual is within the tolerance and the targets are not to be had, or the
  // other solver goes on. Collective.
  template <typename Group>
  std::optional<End> leave_plateau(const PackedSweeps<Group> &sweeps, ContactProblem &problem,
                                   const SolverLimits &limits, const Scales &scales, double blur,
                                   Host &host, SolverResult &result);

  PackedSweeps<swept::ParticleGroup> of_particles_;
  PackedSweeps<swept::BodyGroup> of_bodies_;
};

}    // namespace inelastic
