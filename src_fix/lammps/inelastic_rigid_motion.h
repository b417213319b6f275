// The bodies of a fix rigid/small, as the projection needs them: their momenta with all forces that
// are not contacts, and where exactly a step takes them.
//
// LAMMPS's fix moves the bodies. Here its step is computed beforehand: angular momentum L in the
// space frame, angular velocity w = I^-1 L at the present orientation, and the orientation after
// the step by LAMMPS's Richardson iteration,
//
//   u_1 = |1 + h/2 w|,   u_2 = |1 + h/4 w'| |1 + h/4 w|,   turn = |2 u_2 - u_1|      (quaternions)
//
// where |.| normalises and w' = I^-1 L at the half turn |1 + h/4 w|. After the step LAMMPS's atoms
// have the velocity v + w' x r, so that L cannot be read from them when the three moments differ:
// it is carried along from step to step.

#ifndef INELASTIC_RIGID_MOTION_H
#define INELASTIC_RIGID_MOTION_H

#include "inelastic_body_inertia.h"
#include "inelastic_body_members.h"
#include "inelastic_carried_momenta.h"
#include "inelastic_mover.h"
#include "inelastic_step.h"

#include "pointers.h"

#include <string>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class AtomState;
class GhostExchange;

class RigidMotion final : public Mover, protected Pointers {
 public:
  RigidMotion(class LAMMPS *lmp, Step &step, GhostExchange &ranks, AtomState &state);

  void find_fix() { members_.find_fix(); }

  bool turns() const override { return true; }
  void begin_run() override { members_.begin_run(); }
  Fix *fix() const override { return members_.fix(); }

  // Finds the bodies. See inelastic_body_members.h for the errors.
  std::string find() override;

  // Measures arms and inertia at the present positions. Says which of LAMMPS's bodies have other
  // masses or moments.
  std::string measure() override;

  bool is_incomplete(int i) const override { return members_.is_incomplete(i); }

  // At the start of a run, and of a body that is new, momenta are those of the atoms.
  void predict() override;
  void find_velocity_before(std::vector<double> &velocity) override;
  void apply(const double *contact_force) override;

  void turn(const inelastic::ContactProblem &problem, const std::vector<double> &velocity,
            std::vector<double> &motion) override;

  // 0 for a free particle.
  double angle_turned(const inelastic::ContactProblem &problem, int i) const override;
  double angle_predicted(const inelastic::ContactProblem &problem, int i) const override;
  double energy_of_turning(const inelastic::ContactProblem &problem, int i) const override;

  void note_push(const inelastic::ContactProblem &problem,
                 const std::vector<double> &velocity) override;
  void note_stop(const inelastic::ContactProblem &problem, const std::vector<double> &by_contacts,
                 const std::vector<double> &wanted) override;

 private:
  struct Body {
    double velocity[3];            // of the centre of mass, predicted
    double angular_momentum[3];    // predicted
    double turned[4];              // by the step, a quaternion
    double velocity_end[3];        // of the centre of mass
    double angular_momentum_end[3];
    double angular_velocity_end[3];    // as LAMMPS has it after the step
    Push push;
    Push stop;    // beyond what contacts do; see note_stop()
  };

  void measure_inertia() { inertias_.measure(step_.problem, members_.original_of()); }
  bool carries(int i) const;
  void gather_momenta(double kick);
  void take_carried(int i);
  void predict_bodies(double kick, std::vector<double> &velocity);
  void predict_body(std::size_t b, std::vector<double> &velocity);
  Push replace_push(int i, double *force);
  void keep(int i, const Push &push, const double *contact_force);
  double angle_of_first_momentum(int b) const;
  void velocity_after(int i, double *velocity) const;
  Push difference(const inelastic::RigidBodies &bodies, std::size_t b, const double *velocity,
                  const double *reference) const;

  Step &step_;
  GhostExchange &ranks_;
  AtomState &state_;
  BodyMembers members_;
  BodyInertias inertias_;
  std::vector<Body> bodies_;    // beside those of the problem
  // 3 per particle: momentum, the part of the angular momentum that acts at the particle's arm, and
  // the part that its body carries along.
  std::vector<double> linear_, change_, carried_part_;
  std::vector<double> predicted_;    // 3 per particle
  bool pushing_ = false;
  bool stopping_ = false;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
