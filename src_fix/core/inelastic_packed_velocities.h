// What impulses move, in packed units (inelastic_packed_kernels.h): the velocities of all slots, by
// the sums of the impulses on them.

#pragma once

#include "inelastic_contact_problem.h"
#include "inelastic_host.h"
#include "inelastic_packed_kernels.h"

#include <vector>

namespace inelastic {

template <typename Real> class PackedVelocities {
 public:
  using Vector = packed::Vector<Real>;

  // Packs masses and bodies. All velocities are zero. A mobility, 1 / mass, is in these units.
  void prepare(const ContactProblem &problem, double mobility_unit);

  // Per slot (inelastic_unknowns.h): the sums of impulses, which `move` leaves at zero, and the
  // changes of velocity.
  Vector *sum() { return sum_.data(); }
  const std::vector<Vector> &velocity() const { return velocity_; }

  // Computes the changes of velocity by the sums. Collective. The host must know which ghosts are
  // in constraints (Host::choose_ghosts).
  void move(Host &host);

 private:
  void add_up_walls(Host &host);
  void pack_bodies(const RigidBodies &bodies, double mobility_unit);
  bool pack_rod(const RigidBodies &bodies, std::size_t b, double mobility_unit);
  void pack_body(const RigidBodies &bodies, std::size_t b, double mobility_unit);

  std::vector<Real> inverse_mass_;    // per slot; 1 for particles in bodies
  std::vector<Vector> sum_, velocity_;
  int first_wall_ = 0;         // the slot of the first wall
  bool walls_move_ = false;    // by impulses
  std::vector<packed::Rod<Real>> rods_;
  std::vector<packed::Body<Real>> bodies_;       // bodies that are no rods
  std::vector<packed::Member<Real>> members_;    // of all bodies, as in RigidBodies::member
};

}    // namespace inelastic
