// How far the scene is from rest, by its speeds and by its forces.
//
// Speeds are compared with those that forces from outside give in a step: for a bed under gravity g
// and a time step h with g h. Where they are far below, what moves in a step is far less than what
// its contacts carry in it. Forces of walls and frozen spheres balance those from outside where
// nothing accelerates: on a bed the floor carries the weight.

#ifndef INELASTIC_UNREST_H
#define INELASTIC_UNREST_H

#include "inelastic_step.h"

#include "pointers.h"

namespace LAMMPS_NS::Inelastic_NS {

class ContactOutput;

class Unrest : protected Pointers {
 public:
  Unrest(class LAMMPS *lmp, const Step &step, const ContactOutput &output);

  // At the end of a step, which is then looked at when it is asked for.
  void end_step()
  {
    any_step_ = true;
    looked_at_ = NOT_YET;
  }
  // Looks at the step, unless that is done. Collective; call it in a run, or at its end.
  void look();

  // Tells whether forces from outside act, without which there is nothing to compare with. (This
  // and the following are those of the last look.)
  bool is_known() const { return known_; }
  // The root mean square speed / that of the velocities that forces from outside give in a step,
  // both weighted with masses.
  double speed() const { return speed_; }
  // |Sum of all forces| / |sum of those from outside|; 0 where these add up to nothing.
  double net_force() const { return net_force_; }
  bool is_at_rest() const;

 private:
  static constexpr bigint NOT_YET = -1;

  const Step &step_;
  const ContactOutput &output_;
  bigint looked_at_ = NOT_YET;
  bool any_step_ = false;    // since the fix was defined
  bool known_ = false;
  double speed_ = 0.0, net_force_ = 0.0;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
