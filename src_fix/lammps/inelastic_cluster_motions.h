// How the clusters of a step (inelastic_clusters.h) and their particles move, and what contacts
// resist of it.
//
// Along directions in which neither a wall nor a frozen particle carries a force of the cluster
// nothing outside holds it: its momentum stays, and what moves with the velocity of its centre
// there does not move within it. That common velocity is left out of all others.

#ifndef INELASTIC_CLUSTER_MOTIONS_H
#define INELASTIC_CLUSTER_MOTIONS_H

#include "inelastic_cluster_pieces.h"
#include "inelastic_clusters.h"
#include "inelastic_directions.h"
#include "inelastic_step.h"

#include "pointers.h"

#include <array>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class AtomState;
class GhostExchange;

// Of a particle, or of the body that it belongs to.
struct Motion {
  double speed = 0.0;       // [length / time] root mean square by mass
  double taken = 0.0;       // [length / time] what contacts change of its velocity
  double resisted = 0.0;    // [length / time] sum of lambda (n . v)^2 / (m v^2)
  bool touched = false;     // a contact has a force
  bool closes = false;      // a contact with a force is open by more than the tolerance
};

// Of a cluster, from all ranks.
struct ClusterMotion {
  double mass = 0.0;
  double without_contacts = 0.0;          // [length / time] the mean speed
  Directions held;                        // along which something outside carries its forces
  std::array<double, 3> common = {};      // [length / time] across them; see above
  std::array<double, 3> centre = {};      // [length]
  std::array<double, 3> velocity = {};    // of the centre of mass, without the common one
  std::array<double, 3> angular_velocity = {};    // of the motion as a rigid body
  double speed = 0.0;    // [length / time] of that motion, root mean square by mass
  double quiet_steps = 0.0;
  bool supported = false, driven = false;
  // Measured with the help of the above:
  double resisted = 0.0;      // [length / time] of the motion as a rigid body, as in Motion
  double held_speed = 0.0;    // [length / time] root mean square of the held particles
  double fastest = 0.0;       // the most of their speeds, as a part of the particle's unit()
  // Where held particles touch others with a force: their speed along the normal, which is no
  // other's if they are at rest; root mean square [length / time], and the most as a part of the
  // particle's unit. Of clusters that were quiet for long enough alone.
  double slip = 0.0, most_slip = 0.0;
};

class ClusterMotions : protected Pointers {
 public:
  ClusterMotions(class LAMMPS *lmp, const Step &step, GhostExchange &ranks, AtomState &state);

  // Finds the clusters of the step. Collective.
  void find() { clusters_.find(); }
  // Finds the pieces of clusters, by the impulses that the step has now. Collective.
  const ClusterPieces &find_pieces();
  // Measures the motions in the step as it is now. The slip is that of clusters with so many quiet
  // steps. Collective.
  void measure(double quiet_steps);

  const Clusters &clusters() const { return clusters_; }
  std::size_t size() const { return motions_.size(); }
  const ClusterMotion &operator[](std::size_t cluster) const { return motions_[cluster]; }
  const ClusterMotion &of(int i) const { return motions_[clusters_.of(i)]; }

  // Exchanges the motions of all clusters.
  void swap(std::vector<ClusterMotion> &motions) { motions_.swap(motions); }

  // Tells whether this rank judges a particle.
  bool counts(int i) const;
  // Of an owned particle that counts.
  Motion motion_of(int i) const;
  // Returns the root mean square by mass of differences between two velocities (3 per particle) of
  // a particle, or of its body.
  double speed_between(int i, const std::vector<double> &one,
                       const std::vector<double> &other) const;
  // What a speed of a particle is compared with [length / time] (inelastic_rest.h).
  double unit(int i, const Motion &motion) const;
  // Tells whether a particle is held, as one without motion is that something touches. One that
  // still has a gap to close is not: its force would stay across the gap.
  bool is_held(int i, const Motion &motion) const;

 private:
  // Of a cluster: sums over its particles and contacts, and maxima over its contacts.
  enum {
    MASS,
    CENTRE,
    MOMENTUM = 4,
    ANGULAR = 7,
    INERTIA = 10,
    SPEEDS = 16,    // without contacts; their squares, and the velocities
    SQUARES,
    PREDICTED,
    STEPS = PREDICTED + 3,
    NUMBER,
    NORMALS,    // n n^T of its contacts with what does not belong to it
    SUMS = NORMALS + Directions::SUMS
  };
  enum { SUPPORTED, DRIVEN, MAXIMA };
  void measure_clusters();
  void add_particle(int i, double *sums) const;
  void add_outer_contact(std::size_t c, double *sums, double *maxima) const;
  ClusterMotion motion_of_cluster(const double *sums, const double *maxima) const;
  void measure_resistance();
  void measure_by_motion();
  void measure_slip(double quiet_steps);
  const double *velocity(int i) const { return &step_.velocity[3 * static_cast<std::size_t>(i)]; }
  std::array<double, 3> own_velocity(int i) const;

  const Step &step_;
  GhostExchange &ranks_;
  AtomState &state_;
  Clusters clusters_;
  ClusterPieces pieces_;
  // 3 per particle: the sum of lambda (n . v)^2, the number of gaps to close, and of contacts with
  // a force
  std::vector<double> resistance_;
  std::vector<ClusterMotion> motions_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
