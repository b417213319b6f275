#include "inelastic_prediction.h"

#include "inelastic_law_contacts.h"
#include "inelastic_mover.h"
#include "inelastic_phase_clock.h"
#include "inelastic_rest.h"
#include "inelastic_step.h"
#include "inelastic_walls.h"

#include "atom.h"
#include "force.h"
#include "update.h"

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

Prediction::Prediction(LAMMPS *lmp, Step &step, const Walls &walls, const LawContacts &laws,
                       Movers &movers, Rest &rest, PhaseClock &clock) :
    Pointers(lmp), step_(step), walls_(walls), laws_(laws), movers_(movers), rest_(rest),
    clock_(clock)
{
}

void Prediction::run()
{
  const PhaseClock::Within within(clock_, PhaseClock::COLLECT);
  const int nall = atom->nlocal + atom->nghost;
  inelastic::ContactProblem &problem = step_.problem;
  step_.impulse_per_force = step_.kicks() * update->dt * force->ftm2v;
  problem.timestep = update->dt;
  problem.resize(nall, walls_.number_of_walls());
  for (int i = 0; i < nall; ++i)
    problem.inverse_mass[i] = step_.is_mobile(atom, i) ? 1.0 / mass_of(atom, i) : 0.0;
  if (laws_.has_law()) {
    step_.velocity_before.assign(problem.predicted_velocity.size(), 0.0);
    movers_.find_velocity_before(step_.velocity_before);
  }
  movers_.predict();
  rest_.compare_loads();
}
