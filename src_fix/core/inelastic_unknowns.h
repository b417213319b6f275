// The unknowns of a step: the velocities of everything that contacts may move, and the masses that
// resist them.
//
// Slots number what has a velocity: first the particles, owned ones and then ghosts
// (inelastic_host.h), then the walls. A wall belongs to all ranks together, and each of them has
// the same walls. Particles move alone, or with their rigid body (inelastic_rigid_bodies.h). A slot
// with the inverse mass zero is moved by no impulse: a frozen particle, or a wall that stands still
// or whose motion is prescribed and is in the gaps of its contacts (inelastic_contact_set.h).

#pragma once

#include "inelastic_rigid_bodies.h"

#include <cstddef>
#include <vector>

namespace inelastic {

class Host;

struct Unknowns {
  int particles = 0;
  int walls = 0;
  std::vector<double> predicted_velocity;    // 3 per slot [length / time]
  // One number per slot [1 / mass]; those of particles in bodies are not read.
  std::vector<double> inverse_mass;
  RigidBodies bodies;    // empty in a scene of free particles

  // Sets the numbers of particles and walls. All walls get the velocity and the inverse mass zero.
  // The bodies stay as they are.
  void resize(int number_of_particles, int number_of_walls);

  int slots() const { return particles + walls; }
  bool is_wall(int slot) const { return slot >= particles; }
  // Walls count from 0 here.
  int slot_of_wall(int wall) const { return particles + wall; }

  // Tells whether a slot is a particle in a rigid body.
  bool is_member(int slot) const
  { return !bodies.empty() && slot < particles && bodies.body[slot] >= 0; }

  // Tells whether impulses move a slot.
  bool is_mobile(int slot) const { return inverse_mass_of(slot) > 0.0; }

  // Returns the inverse mass of a slot, or of the body that it belongs to [1 / mass].
  double inverse_mass_of(int slot) const
  { return is_member(slot) ? bodies.inverse_mass[bodies.body[slot]] : inverse_mass[slot]; }

  // Tells whether impulses move any wall.
  bool any_wall_moves() const;

  // Returns n . M^-1 n [1 / mass]: the velocity along a unit vector n that a unit impulse along n
  // gives to a slot.
  double mobility(int slot, const double *direction) const
  { return is_member(slot) ? bodies.mobility(slot, direction) : inverse_mass[slot]; }

  // Replaces the sums of the impulses on each slot of this rank [mass length / time], 3 per slot,
  // by the changes of velocity that the impulses of all ranks make [length / time]. Collective.
  void velocity_change(double *per_slot, Host &host) const;
};

}    // namespace inelastic
