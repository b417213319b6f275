#include "fix_random_force.h"

#include "inelastic_lammps_versions.h"
#include "inelastic_random.h"

#include "atom.h"
#include "error.h"
#include "force.h"
#include "update.h"

#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using namespace FixConst;

FixRandomForce::FixRandomForce(LAMMPS *lmp, int narg, char **arg) : Fix(lmp, narg, arg)
{
  if (narg < 5) utils::missing_cmd_args(FLERR, "fix random/force", error);
  if (narg > 5)
    error_at(error, FLERR, 5,
             "Unknown fix random/force argument {}: it takes an acceleration and a seed", arg[5]);
  acceleration_ = utils::numeric(FLERR, arg[3], false, lmp);
  if (!(acceleration_ >= 0.0) || std::isinf(acceleration_))
    error_at(error, FLERR, 3, "Fix random/force acceleration must be 0 or greater, not {}", arg[3]);
  const int seed = utils::inumeric(FLERR, arg[4], false, lmp);
  if (seed < 0)
    error_at(error, FLERR, 4, "Fix random/force seed must be 0 or greater, not {}", arg[4]);
  seed_ = static_cast<std::uint32_t>(seed);
  if (!atom->tag_enable)
    error->all(FLERR, "Fix random/force needs atom IDs: use atom_modify id yes");
}

int FixRandomForce::setmask()
{ return acceleration_ > 0.0 ? POST_FORCE : 0; }

void FixRandomForce::init()
{
  if (utils::strmatch(update->integrate_style, "^respa"))
    error->all(FLERR, "Fix random/force does not work with run_style respa: use run_style verlet");
}

void FixRandomForce::setup(int vflag)
{
  if (acceleration_ > 0.0) post_force(vflag);
}

void FixRandomForce::post_force(int)
{
  const int *const mask = atom->mask;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!(mask[i] & groupbit)) continue;
    const double mass = atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]];
    const double scale = acceleration_ * mass / force->ftm2v;
    const auto uniform = inelastic::uniform_vector(seed_, static_cast<std::uint64_t>(atom->tag[i]),
                                                   static_cast<std::uint64_t>(update->ntimestep));
    for (int d = 0; d < 3; ++d) atom->f[i][d] += scale * uniform[d];
  }
}
