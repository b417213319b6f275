// This room tells which particles are at rest: those that their own contacts hold, in a cluster
// (inelastic_clusters.h) whose motion is nothing but errors of the solver. Their velocities are
// taken away, the contact forces of one step solve the next one without an iteration, and this
// lasts until something changes.
//
// A velocity of particle i [length / time] is small if it is small beside
//
//   u_i = min(what contacts change of its velocity, w)
//
// w is the mean speed that the particles of the cluster would have without contacts.
// The particle is held if contacts resist its motion: if the sum of lambda (n . v)^2 over its
// contacts is at least a tenth of u_i m v^2, and if none of them has still to close a gap. Others,
// which slide, roll or fly, keep their velocities. A cluster is quiet if it is supported by
// something that does not move, its held particles move little, and contacts with walls and frozen
// particles resist its motion as a whole: its velocity and angular velocity, as if it were one
// rigid body.
//
// After some quiet steps, those of most of its particles, the held particles are stopped, and some
// steps are solved more accurately. If nothing held then moves, the forces balance and the cluster
// is at rest; if not it goes on, and is looked at again later. A cluster at rest in which something
// would move is solved more accurately, too, before it is let go. Where the loads of a cluster at
// rest all change by one factor, its contact forces do.

#ifndef INELASTIC_REST_H
#define INELASTIC_REST_H

#include "inelastic_clusters.h"
#include "inelastic_projection.h"
#include "inelastic_step.h"

#include "pointers.h"

#include <array>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class AtomState;
class GhostExchange;

class Rest : protected Pointers {
 public:
  Rest(class LAMMPS *lmp, Step &step, GhostExchange &ranks, AtomState &state);

  // Looks at a step that is predicted: finds by what factors the loads of particles at rest have
  // changed. Collective.
  void compare_loads();

  // Looks at a step that is solved. Returns whether it is to be solved once more, with refined
  // contacts, which are marked in the problem; it is then looked at again. Collective.
  bool look(const inelastic::ProjectionResult &result);
  void look_again();

  // Decides after that which particles are stopped in the step, one mark per particle. Returns
  // whether any is, on any rank, and notes in the step whether the whole scene is at rest.
  // Collective.
  bool decide(std::vector<char> &stopped);

 private:
  // Of a particle, or of the body that it belongs to.
  struct Motion {
    double speed = 0.0;       // [length / time] root mean square by mass
    double taken = 0.0;       // [length / time] what contacts change of its velocity
    double resisted = 0.0;    // [length / time] sum of lambda (n . v)^2 / (m v^2)
    bool closes = false;      // a contact with a force is open by more than the tolerance
  };
  // Of a cluster, from all ranks.
  struct ClusterMotion {
    double mass = 0.0;
    double without_contacts = 0.0;                  // [length / time] the mean speed
    std::array<double, 3> centre = {};              // [length]
    std::array<double, 3> velocity = {};            // of the centre of mass
    std::array<double, 3> angular_velocity = {};    // of the motion as a rigid body
    double speed = 0.0;    // [length / time] of that motion, root mean square by mass
    double quiet_steps = 0.0;
    bool supported = false, driven = false;
    // Measured with the help of the above:
    double resisted = 0.0;      // [length / time] of the motion as a rigid body, as in Motion
    double held_speed = 0.0;    // [length / time] root mean square of the held particles
    bool held_moves = false;
  };

  void measure_resistance();
  Motion motion_of(int i) const;
  bool is_held(int i, const Motion &motion) const;
  double unit(int i, const Motion &motion) const;
  // Of a cluster: sums over its particles, and maxima over its contacts.
  enum { MASS, CENTRE, MOMENTUM = 4, ANGULAR = 7, INERTIA = 10, SPEEDS = 16, STEPS, NUMBER, SUMS };
  enum { SUPPORTED, DRIVEN, MAXIMA };
  void measure_clusters();
  void add_particle(int i, double *sums) const;
  ClusterMotion motion_of_cluster(const double *sums, const double *maxima) const;
  void measure_clusters_by_motion();
  bool is_quiet(const ClusterMotion &cluster) const;
  bool moves(const ClusterMotion &cluster) const;
  bool needs_refinement(const ClusterMotion &cluster) const;
  void forget();
  double limit() const;
  bool counts(int i) const;
  const double *velocity(int i) const { return &step_.velocity[3 * static_cast<std::size_t>(i)]; }

  Step &step_;
  GhostExchange &ranks_;
  AtomState &state_;
  Clusters clusters_;
  std::vector<double> resistance_;    // 3 per particle: the sum of lambda (n . v)^2, the number of
                                      // gaps to close, and nothing
  std::vector<ClusterMotion> motions_;
  bool looks_ = false;          // in this step
  bool any_stopped_ = false;    // in the last step, on any rank
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
