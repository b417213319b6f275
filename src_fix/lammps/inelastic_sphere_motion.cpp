#include "inelastic_sphere_motion.h"

#include "inelastic_atom_state.h"
#include "inelastic_ghost_exchange.h"

#include "atom.h"

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

SphereMotion::SphereMotion(LAMMPS *lmp, Step &step, GhostExchange &ranks, AtomState &state) :
    Pointers(lmp), step_(step), ranks_(ranks), state_(state)
{
}

void SphereMotion::predict()
{ predict_after(step_.impulse_per_force, step_.problem.predicted_velocity); }

void SphereMotion::find_velocity_before(std::vector<double> &velocity)
{ predict_after(0.0, velocity); }

// Sets the velocities after forces have acted for a time, in units that turn a force into a
// momentum.
void SphereMotion::predict_after(double kick, std::vector<double> &velocity)
{
  const bool whole = step_.kick == Kick::WHOLE;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (step_.is_member(i)) continue;
    const double kick_per_force = kick * step_.problem.inverse_mass[i];
    // The push that took overlaps apart is no momentum; between runs it is not in the velocity.
    const double *const push = state_.push_next(i);
    for (int d = 0; d < 3; ++d) {
      const double before = atom->v[i][d] - (whole ? push[d] : 0.0);
      velocity[3 * i + d] = before + kick_per_force * atom->f[i][d];
    }
  }
  ranks_.share_with_ghosts(velocity.data(), 3);
}

void SphereMotion::apply(const double *)
{
  const inelastic::ContactProblem &problem = step_.problem;
  const double h = problem.timestep;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!step_.in_group(atom, i) || step_.is_member(i)) continue;
    const bool moves = problem.inverse_mass[i] > 0.0;
    double *const included = state_.push_included(i);
    double *const next = state_.push_next(i);
    for (int d = 0; d < 3; ++d) {
      const double v = step_.velocity[3 * i + d];
      const double kick_per_force = step_.impulse_per_force * problem.inverse_mass[i];
      if (moves) {
        const double without = atom->v[i][d] + kick_per_force * atom->f[i][d];
        atom->f[i][d] += (v - without) / kick_per_force;
      }
      const double push = step_.bad_start && moves ? v - problem.predicted_velocity[3 * i + d]
                                                   : 0.0;
      if (step_.kick == Kick::WHOLE) included[d] = 0.5 * (next[d] + push);
      next[d] = push;
      state_.expected_velocity(i)[d] = v;
      state_.expected_position(i)[d] = atom->x[i][d] + h * v;
    }
  }
}
