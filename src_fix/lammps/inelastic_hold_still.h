// This room takes the velocities of particles at rest away (inelastic_rest.h). The moving particles
// beside them were solved for with these velocities: they are projected once more, with the
// particles at rest as obstacles, so that nothing moves into these. The solver is `apgd`'s: what is
// to change is little, and searches of another one would end at other bits.

#ifndef INELASTIC_HOLD_STILL_H
#define INELASTIC_HOLD_STILL_H

#include "inelastic_solver.h"
#include "inelastic_step.h"

#include <functional>
#include <memory>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class GhostExchange;
class Movers;

class HoldStill {
 public:
  HoldStill(Step &step, GhostExchange &ranks, Movers &movers,
            std::unique_ptr<inelastic::Solver> solver);

  // What particles are to do, ghosts included: one mark per particle that is held, and the velocity
  // that it is to have, 3 per particle [length / time].
  struct Held {
    std::vector<char> particles;
    std::vector<double> velocity;
  };
  // `add_violated` adds constraints that the step's velocities violate, and returns how many all
  // ranks added; `excess` finds the excess that they leave (StepState).
  struct Constraints {
    std::function<long()> add_violated;
    std::function<double()> excess;
  };

  // Keeps the velocities, impulses and the excess of the step, which is solved.
  void begin();

  // Changes velocities and impulses of the step. Returns false where the moving particles find no
  // room, or would leave more excess: go_back() must follow then. Collective.
  bool run(const Held &held, const Constraints &constraints);

  // The velocities that the forces of all contacts give, 3 per slot [length / time]: of what is
  // held they differ from the velocities of the step by what does not balance. Collective.
  const std::vector<double> &find_by_contacts();

  // Takes the velocities of what is held from these on, and tells the movers. Collective.
  void stop(const Held &held);

  // Gives the step again what was kept of it.
  void go_back();

  // The impulses of the step when begin() kept them, by constraint.
  const std::vector<double> &impulse_before() const { return impulse_before_; }
  // The velocities of the step when run() began, 3 per slot [length / time].
  const std::vector<double> &solved() const { return solved_; }

  long iterations() const { return iterations_; }    // since begin()

 private:
  enum class Of { HELD, ALL };    // contacts: those of held particles, or all
  void set_up(const Held &held);
  inelastic::SolverResult project(const Held &held, Of of, long most_iterations);
  bool has_room(const Held &held) const;
  bool opens_under_force(const Held &held) const;
  bool is_held(const Held &held, int slot) const;
  bool is_still(const Held &held, int slot) const;
  void turn_bodies();

  Step &step_;
  GhostExchange &ranks_;
  Movers &movers_;
  // Not the solver of the steps, which learns from them.
  std::unique_ptr<inelastic::Solver> solver_;
  inelastic::ContactProblem moving_;
  std::vector<double> velocity_before_, impulse_before_, solved_, by_contacts_;
  double excess_before_ = 0.0;
  long iterations_ = 0;
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
