#include "inelastic_unrest.h"

#include "inelastic_contact_output.h"

#include "atom.h"
#include "force.h"
#include "update.h"

#include <cmath>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::dot;
using inelastic::norm;

Unrest::Unrest(LAMMPS *lmp, const Step &step, const ContactOutput &output) :
    Pointers(lmp), step_(step), output_(output)
{
}

void Unrest::look()
{
  if (!any_step_ || looked_at_ == update->ntimestep || update->whichflag == 0) return;
  looked_at_ = update->ntimestep;
  // Sums over what may move: mass times squared speed, the same of velocities that forces from
  // outside give in a step, these forces, all forces, and sizes of those from outside.
  enum { SQUARE, GIVEN, OUTSIDE, NET = OUTSIDE + 3, SIZE = NET + 3, SUMS };
  double mine[SUMS] = {}, sums[SUMS];
  const double *const contact_force = output_.contact_force();
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!step_.is_mobile(atom, i)) continue;
    const double mass = mass_of(atom, i);
    double outside[3];
    for (int d = 0; d < 3; ++d) {
      outside[d] = atom->f[i][d] - contact_force[3 * static_cast<std::size_t>(i) + d];
      mine[OUTSIDE + d] += outside[d];
      mine[NET + d] += atom->f[i][d];
    }
    const double given = step_.regular_timestep * force->ftm2v / mass * norm(outside);
    mine[SQUARE] += mass * dot(atom->v[i], atom->v[i]);
    mine[GIVEN] += mass * given * given;
    mine[SIZE] += norm(outside);
  }
  MPI_Allreduce(mine, sums, SUMS, MPI_DOUBLE, MPI_SUM, world);
  known_ = sums[GIVEN] > 0.0;
  speed_ = known_ ? std::sqrt(sums[SQUARE] / sums[GIVEN]) : 0.0;
  // Forces from outside that cancel out, as those of a shear, are no weight.
  constexpr double CANCELS = 0.01;
  const double weight = norm(&sums[OUTSIDE]);
  net_force_ = weight > CANCELS * sums[SIZE] ? norm(&sums[NET]) / weight : 0.0;
}

bool Unrest::is_at_rest() const
{
  constexpr double SLOW = 0.1, BALANCED = 0.01;
  return speed_ <= SLOW && net_force_ <= BALANCED;
}
