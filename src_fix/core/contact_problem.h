// One step's projection problem.
//
//   minimise over V:   1/2 (V - V*)^T M (V - V*)
//   subject to         gap_c + h G_c . V >= 0      for all c
//
// V* predicted velocities, M the mass matrix, G_c V = n_c . (v_first - v_second). Its dual has one
// impulse per constraint:
//
//   V = V* + M^-1 G^T lambda,   w(lambda) = gap + h G V,   lambda >= 0,  w >= 0,  lambda w = 0
//
// and w is the gradient of the dual function 1/2 lambda^T A lambda + (gap + h G V*)^T lambda with
// A = h G M^-1 G^T. w_c is a length: the gap at the end of the step as the linearised constraint
// sees it.

#pragma once

#include "contact_set.h"
#include "host.h"
#include "rigid_bodies.h"

#include <vector>

namespace inelastic {

struct ContactProblem {
  double timestep = 0.0;
  int particles = 0;                         // owned particles and copies of other ranks' particles
  std::vector<double> predicted_velocity;    // 3 per particle, then 3 zeros for the dummy particle
  std::vector<double> inverse_mass;          // per particle, then a zero; zero = frozen; not read
                                             // for particles in bodies
  RigidBodies bodies;                        // empty in a scene of free particles
  ContactSet contacts;

  // Sets the number of particles and the dummy particle that stands for every wall.
  // Bodies are as `bodies.clear` and `bodies.add` leave them.
  void resize(int number_of_particles);

  // n . M^-1 n: velocity along a unit vector that a unit impulse along it gives. Zero = frozen.
  double mobility(int particle, const double *direction) const
  {
    return bodies.empty() || particle == particles || bodies.body[particle] < 0
        ? inverse_mass[particle]
        : bodies.mobility(particle, direction);
  }
};

// End-of-step gaps w of the linearised constraints for given impulses: the only place where the
// operator h G M^-1 G^T is applied.
class GapOperator {
 public:
  // Fixes the problem: w for zero impulses (`free_gap`) is computed here, once.
  void prepare(const ContactProblem &problem);

  // gap_at_end[c] = free_gap[c] + h (G M^-1 G^T impulse)[c]
  void apply(const ContactProblem &problem, const double *impulse, double *gap_at_end, Host &host);

  // Velocities V* + M^-1 G^T lambda of all particles, copies included.
  void velocity(const ContactProblem &problem, const double *impulse, double *velocity, Host &host);

  // The same for the impulses of the last apply().
  void velocity_applied(const ContactProblem &problem, double *velocity) const;

  // |G^T lambda|^2 in the norm of M^-1, this rank's share: twice the kinetic energy that the impulses
  // give to what is at rest. And the mass that they act on. Copies count as often as they are there.
  struct Kick {
    double squared;
    double mass;
  };
  Kick kick(const ContactProblem &problem, const double *impulse, Host &host);

  const std::vector<double> &free_gap() const { return free_gap_; }

 private:
  void velocity_change(const ContactProblem &problem, const double *impulse, Host &host);

  std::vector<double> free_gap_;
  std::vector<int> free_particles_;    // in no body, the dummy too; only where there are bodies
  std::vector<double> change_;    // impulse, then velocity change, of each particle and the dummy
};

}    // namespace inelastic
