// The operator that gives the gaps at the end of the step for given impulses:
//
//   w(lambda) = gap + h G V* + A lambda,   A = h G M^-1 G^T + C
//
// in the notation of inelastic_contact_problem.h. Every verdict on impulses applies A through this
// class, in double precision. (The iterations of inelastic_gradient_search.h have a fast form
// of their own.)

#pragma once

#include "inelastic_contact_problem.h"
#include "inelastic_host.h"
#include "inelastic_refined.h"

#include <vector>

namespace inelastic {

class GapOperator {
 public:
  // Computes free_gap(). Call it whenever the problem has changed; impulses may change without it.
  void prepare(const ContactProblem &problem);

  // w(0) = gap + h G V* [length], one per constraint: the gaps at the end of a step without
  // impulses.
  const std::vector<double> &free_gap() const { return free_gap_; }

  // Writes w(impulse) [length], one per constraint.
  void apply(const ContactProblem &problem, const double *impulse, double *gap_at_end, Host &host);

  // Writes A impulse [length], one per constraint.
  void product(const ContactProblem &problem, const double *impulse, double *opened, Host &host);

  // Writes V* + M^-1 G^T impulse, 3 per slot [length / time].
  void velocity(const ContactProblem &problem, const double *impulse, double *velocity, Host &host);

  // M^-1 G^T impulse for the impulses of the last call of apply(): by how much contacts change the
  // velocity of each slot; 3 numbers per slot [length / time].
  const std::vector<double> &change() const { return change_; }

  // Does the same as prepare() for a problem that was refined, and not anew. Sets `gap_at_end` of
  // what is new in it, for the impulses of the last call of apply(); those of new constraints are
  // 0.
  void refine(const ContactProblem &problem, const Refined &refined,
              std::vector<double> &gap_at_end);

  // Writes the same as velocity() for the impulses of the last call of apply(), without
  // communication.
  void velocity_applied(const ContactProblem &problem, double *velocity) const;

  struct ImpulseNorm {
    // |G^T lambda|^2 in the norm of M^-1 [mass length^2 / time^2]: twice the kinetic energy that
    // the impulses give to particles and bodies at rest.
    double squared;
    // [mass] Of all particles, bodies and walls on which an impulse acts.
    double mass;
  };

  // Returns this rank's share. Every ghost of a particle counts like the particle itself, and so
  // does a wall on every rank.
  ImpulseNorm impulse_norm(const ContactProblem &problem, const double *impulse, Host &host);

 private:
  void find_change(const ContactProblem &problem, const double *impulse, Host &host);

  std::vector<double> free_gap_;
  std::vector<double> change_;    // 3 per slot: the sums of impulses, then the changes of velocity
};

// Returns the largest eigenvalue of A [time / mass] by power iteration. The estimate comes from
// below and is mostly within a relative 1e-3.
double largest_eigenvalue(const ContactProblem &problem, Host &host);

}    // namespace inelastic
