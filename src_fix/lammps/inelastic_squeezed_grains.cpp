#include "inelastic_squeezed_grains.h"

#include "inelastic_ghost_exchange.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "update.h"

#include "fmt/format.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::norm;

SqueezedGrains::SqueezedGrains(LAMMPS *lmp, const Step &step, GhostExchange &ranks) :
    Pointers(lmp), step_(step), ranks_(ranks)
{
}

// Returns the largest speed of walls, and of spheres without contacts [length / time]; at least a
// tolerance a step, since speeds are known no better.
double SqueezedGrains::fastest_before() const
{
  const inelastic::ContactProblem &problem = step_.problem;
  double fastest = step_.settings.tolerance;
  for (const Row &row : step_.rows) fastest = std::max(fastest, std::abs(row.wall_motion));
  fastest /= problem.timestep;
  for (int i = 0; i < atom->nlocal; ++i)
    if (step_.in_group(atom, i))
      fastest = std::max(fastest, norm(&problem.predicted_velocity[3 * i]));
  ranks_.reduce(nullptr, 0, &fastest, 1);
  return fastest;
}

void SqueezedGrains::look()
{
  constexpr double TIMES_AS_FAST = 30.0;
  said_.clear();
  const double before = fastest_before();
  const std::vector<double> &impulse = step_.problem.contacts.impulse;
  double speed = 0.0;
  std::string named;
  for (std::size_t c = 0; c < step_.rows.size(); ++c) {
    if (!(step_.rows[c].wall_motion > 0.0 && impulse[c] > 0.0)) continue;
    const int i = step_.problem.contacts.first[c];
    const double its_speed = norm(&step_.motion()[3 * i]);
    if (its_speed <= speed) continue;
    speed = its_speed;
    named = fmt::format("atom {}", atom->tag[i]);
  }
  double fastest;
  const int rank = ranks_.rank_of_largest(speed, &fastest);
  if (!(fastest > TIMES_AS_FAST * before)) return;
  said_ =
      fmt::format("walls that close squeeze {} out from between them at {:.3g}, {:.3g} times as "
                  "fast as anything moved",
                  ranks_.said_by(rank, named), fastest, fastest / before);
}

void SqueezedGrains::warn()
{
  if (said_.empty() || told_) return;
  told_ = true;
  if (comm->me != 0) return;
  error->warning(FLERR, "Fix inelastic: step {}: {}: keep them further apart than its diameter",
                 update->ntimestep, said_);
  // Where such a grain leaves the box, LAMMPS may end all ranks before it writes out what was said.
  if (screen) fflush(screen);
  if (logfile) fflush(logfile);
}
