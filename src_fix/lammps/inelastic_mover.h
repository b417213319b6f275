// The interface of the rooms that know how particles move, free spheres or bodies: other rooms ask
// all of them together, and know none of them by name.

#ifndef INELASTIC_MOVER_H
#define INELASTIC_MOVER_H

#include "inelastic_contact_problem.h"

#include <string>
#include <vector>

namespace LAMMPS_NS {
class Fix;
}

namespace LAMMPS_NS::Inelastic_NS {

class Mover {
 public:
  // Sets the predicted velocities of the step's problem, ghosts included: those that the step would
  // end with if there were no contacts. Collective.
  virtual void predict() = 0;

  // Sets the velocities of the step's particles before its forces, those of a push left out, ghosts
  // included; 3 per particle. predict() must follow. Collective.
  virtual void find_velocity_before(std::vector<double> &velocity) = 0;

  // Adds forces to LAMMPS's, so that the next move is the projected one, and keeps what the next
  // step and its check need. `contact_force` is 3 per particle.
  virtual void apply(const double *contact_force) = 0;

  // Tells whether particles turn about one another in a step. The particles of movers that turn
  // nothing go along straight lines, and the functions below are not called for them.
  virtual bool turns() const { return false; }

  // At the start of a run.
  virtual void begin_run() {}

  // Finds what turns after atoms or ghosts have changed, and returns what is wrong on this rank.
  // Collective.
  virtual std::string find() { return ""; }

  // Measures what turns as it is now, and returns what is wrong with it on this rank.
  virtual std::string measure() { return ""; }

  // The fix of LAMMPS that moves what turns, whose setup knows nothing of contacts; else null.
  virtual Fix *fix() const { return nullptr; }

  // Tells whether this rank sees only a part of what a particle turns with.
  virtual bool is_incomplete(int /*particle*/) const { return false; }

  // Follows the particles to where the velocities (3 per particle) that solve the problem take
  // them: `motion`, which has these velocities, becomes their mean velocities during the step.
  virtual void turn(const inelastic::ContactProblem & /*problem*/,
                    const std::vector<double> & /*velocity*/, std::vector<double> & /*motion*/)
  {
  }

  // [radians] By how much the step of the last turn() turns a particle; the same without the
  // contacts, after predict().
  virtual double angle_turned(const inelastic::ContactProblem & /*problem*/, int /*particle*/) const
  { return 0.0; }
  virtual double angle_predicted(const inelastic::ContactProblem & /*problem*/,
                                 int /*particle*/) const
  { return 0.0; }

  // The part by which the step of the last turn() raises the energy of rotation of what a particle
  // turns with, where nothing acts: angular momentum is kept exactly, orientations are not.
  virtual double energy_of_turning(const inelastic::ContactProblem & /*problem*/,
                                   int /*particle*/) const
  { return 0.0; }

  // Takes the part of velocities beyond the predicted ones as a push, which is no momentum.
  virtual void note_push(const inelastic::ContactProblem & /*problem*/,
                         const std::vector<double> & /*velocity*/)
  {
  }

  // Takes note that particles are to have the velocities `wanted` in place of those that contact
  // forces give them (inelastic_hold_still.h).
  virtual void note_stop(const inelastic::ContactProblem & /*problem*/,
                         const std::vector<double> & /*by_contacts*/,
                         const std::vector<double> & /*wanted*/)
  {
  }

 protected:
  ~Mover() = default;    // not virtual: movers are never owned through this interface
};

// All movers of a scene, asked together.
class Movers {
 public:
  void add(Mover *mover);

  void predict();
  void find_velocity_before(std::vector<double> &velocity);
  void apply(const double *contact_force);

  // The movers that turn particles. See Mover.
  bool any_turns() const { return !turning_.empty(); }
  void begin_run();
  std::string find();
  std::string measure();
  // The fix that moves what turns; null if nothing does.
  Fix *fix() const { return any_turns() ? turning_.front()->fix() : nullptr; }
  bool is_incomplete(int particle) const;
  void turn(const inelastic::ContactProblem &problem, const std::vector<double> &velocity,
            std::vector<double> &motion);
  double angle_turned(const inelastic::ContactProblem &problem, int particle) const;
  double angle_predicted(const inelastic::ContactProblem &problem, int particle) const;
  double energy_of_turning(const inelastic::ContactProblem &problem, int particle) const;
  void note_push(const inelastic::ContactProblem &problem, const std::vector<double> &velocity);
  void note_stop(const inelastic::ContactProblem &problem, const std::vector<double> &by_contacts,
                 const std::vector<double> &wanted);

 private:
  std::vector<Mover *> all_, turning_;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
