// Free spheres: fix nve or nve/sphere moves them.

#ifndef INELASTIC_SPHERE_MOTION_H
#define INELASTIC_SPHERE_MOTION_H

#include "inelastic_mover.h"
#include "inelastic_step.h"

#include "pointers.h"

namespace LAMMPS_NS::Inelastic_NS {

class AtomState;
class GhostExchange;

class SphereMotion final : public Mover, protected Pointers {
 public:
  SphereMotion(class LAMMPS *lmp, Step &step, GhostExchange &ranks, AtomState &state);

  void predict() override;
  void find_velocity_before(std::vector<double> &velocity) override;
  void apply(const double *contact_force) override;

 private:
  void predict_after(double kick, std::vector<double> &velocity);

  Step &step_;
  GhostExchange &ranks_;
  AtomState &state_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
