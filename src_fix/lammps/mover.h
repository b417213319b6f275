// Those who know how particles move: free spheres, and bodies.

#ifndef INELASTIC_MOVER_H
#define INELASTIC_MOVER_H

namespace LAMMPS_NS {

class Mover {
 public:
  // Sets the predicted velocities of the step's problem, ghosts included: those that the step would
  // end with if there were no contacts. Collective.
  virtual void predict() = 0;

  // Adds forces to LAMMPS's, so that the next move is the projected one, and keeps what the next
  // step and its check need. `contact_force` is 3 per particle.
  virtual void apply(const double *contact_force) = 0;

 protected:
  ~Mover() = default;    // not virtual: movers are never owned through this interface
};

}    // namespace LAMMPS_NS

#endif
