#include "inelastic_step_length.h"

#include "inelastic_ghost_exchange.h"
#include "inelastic_periods.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "fix.h"
#include "force.h"
#include "group.h"
#include "modify.h"
#include "neighbor.h"
#include "output.h"
#include "pair.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::dot;
using inelastic::norm;

namespace {

constexpr double SHORTEST_STEP = 1.0e-6;    // of the regular one: below, something else is wrong
constexpr double SHORTEST_UNSOLVED = 1.0e-3;    // below, it is not the step that is too long
// An atom may stray by this part of what its rank owns of the box: LAMMPS brings it back from the
// next part alone.
constexpr double MOST_STRAYED = 0.5;

}    // namespace

StepLength::StepLength(LAMMPS *lmp, Step &step, GhostExchange &ranks) :
    Pointers(lmp), step_(step), ranks_(ranks), list_(lmp, step, ranks)
{ step_.regular_timestep = update->dt; }

void StepLength::begin_run()
{
  list_.warn_of_tolerance();
  restore();
  step_.regular_timestep = update->dt;
}

void StepLength::list_built()
{
  position_at_build_.resize(3 * static_cast<std::size_t>(atom->nlocal));
  radius_at_build_.assign(atom->radius, atom->radius + atom->nlocal);
  for (int i = 0; i < atom->nlocal; ++i) std::copy_n(atom->x[i], 3, &position_at_build_[3 * i]);
  list_.built();
  measure_farthest();
}

// A motion that all share costs no reach, but takes atoms away from their rank and their box.
// LAMMPS brings an atom back into a periodic box from the next image alone, and hands it to the
// next rank alone (with two ranks in a direction, the other one is the next on both sides).
void StepLength::measure_farthest()
{
  const Periods periods(lmp);
  double narrowest[3];
  for (int d = 0; d < 3; ++d) {
    const double part = periods.own_part(d);
    const bool bounded = periods.along(d) || comm->nprocs > 1;
    own_width_[d] = bounded ? part * domain->prd[d] : EXTREME;
    narrowest[d] = -part;
  }
  ranks_.reduce(nullptr, 0, narrowest, 3);
  for (int d = 0; d < 3; ++d) {
    const bool tiled = comm->layout == Comm::LAYOUT_TILED;
    const int ranks = tiled ? comm->nprocs : comm->procgrid[d];
    farthest_[d] = periods.along(d) ? 1.0 : EXTREME;
    if (ranks > 2) farthest_[d] = std::min(farthest_[d], -narrowest[d]);
  }
}

// Collective: how far some atom will have gone since the list was built, as a part of farthest_.
double StepLength::part_of_farthest()
{
  if (std::min({farthest_[0], farthest_[1], farthest_[2]}) == EXTREME) return 0.0;
  const double *const inverse = domain->h_inv;
  const std::vector<double> &motion = step_.motion();
  double part = 0.0;
  for (int i = 0; i < atom->nlocal; ++i) {
    double gone[3];
    for (int d = 0; d < 3; ++d)
      gone[d] = atom->x[i][d] - position_at_build_[3 * i + d] + update->dt * motion[3 * i + d];
    const double of_box[3] = {inverse[0] * gone[0] + inverse[5] * gone[1] + inverse[4] * gone[2],
                              inverse[1] * gone[1] + inverse[3] * gone[2], inverse[2] * gone[2]};
    for (int d = 0; d < 3; ++d) part = std::max(part, std::abs(of_box[d]) / farthest_[d]);
  }
  ranks_.reduce(nullptr, 0, &part, 1);
  return part;
}

// The largest difference between two of the vectors (3 doubles each) of the group's atoms, from
// above: the diagonal of their bounding box, or the diameter of a ball about its centre.
double StepLength::spread(const double *values)
{
  double maxima[6];
  std::fill_n(maxima, 6, -EXTREME);
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!step_.in_group(atom, i)) continue;
    for (int d = 0; d < 3; ++d) {
      maxima[d] = std::max(maxima[d], values[3 * i + d]);
      maxima[3 + d] = std::max(maxima[3 + d], -values[3 * i + d]);
    }
  }
  ranks_.reduce(nullptr, 0, maxima, 6);
  const double extent[3] = {maxima[0] + maxima[3], maxima[1] + maxima[4], maxima[2] + maxima[5]};
  if (extent[0] < 0.0) return 0.0;
  double farthest = 0.0;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!step_.in_group(atom, i)) continue;
    double from_centre[3];
    for (int d = 0; d < 3; ++d)
      from_centre[d] = values[3 * i + d] - 0.5 * (maxima[d] - maxima[3 + d]);
    farthest = std::max(farthest, dot(from_centre, from_centre));
  }
  ranks_.reduce(nullptr, 0, &farthest, 1);
  return std::min(norm(extent), 2.0 * std::sqrt(farthest));
}

// The spread of the displacements since the list was built: at present, or after a motion (null =
// none).
double StepLength::spread_since_build(const double *motion)
{
  vectors_.resize(3 * static_cast<std::size_t>(atom->nlocal));
  for (int i = 0; i < atom->nlocal; ++i)
    for (int d = 0; d < 3; ++d)
      vectors_[3 * i + d] = atom->x[i][d] - position_at_build_[3 * i + d] +
          (motion ? step_.problem.timestep * motion[3 * i + d] : 0.0);
  growth_ = strayed_ = 0.0;
  for (int i = 0; i < atom->nlocal; ++i) {
    growth_ = std::max(growth_, atom->radius[i] - radius_at_build_[i]);
    for (int d = 0; d < 3; ++d)
      strayed_ = std::max(strayed_, std::abs(vectors_[3 * i + d]) / own_width_[d]);
  }
  double maxima[2] = {growth_, strayed_};
  ranks_.reduce(nullptr, 0, maxima, 2);
  growth_ = maxima[0];
  strayed_ = maxima[1];
  return spread(vectors_.data()) + 2.0 * growth_;
}

// The spread of the velocities after so many kicks (0, 0.5 or 1) by the forces alone. Bodies turn
// in other ways: for them this is about it.
double StepLength::unhindered_spread(double kicks)
{
  vectors_.resize(3 * static_cast<std::size_t>(atom->nlocal));
  for (int i = 0; i < atom->nlocal; ++i) {
    const double kick_per_force =
        step_.is_mobile(atom, i) ? kicks * update->dt * force->ftm2v / mass_of(atom, i) : 0.0;
    for (int d = 0; d < 3; ++d)
      vectors_[3 * i + d] = atom->v[i][d] + kick_per_force * atom->f[i][d];
  }
  return spread(vectors_.data());
}

// The part of the time step for which the list would reach, with some reserve, where velocities
// have the spread `whole` in the whole step and `none` before its forces: in a part s, whose kick
// is smaller, they have at most (1 - s) none + s whole.
double StepLength::room_in_list(double none, double whole) const
{
  constexpr double RESERVE = 0.9;
  const double room = RESERVE * (list_.reach() - spread_at_start_) / update->dt;
  return 2.0 * room / (none + std::sqrt(none * none + 4.0 * (whole - none) * room));
}

bool StepLength::needs_new_list()
{
  const double *const motion = step_.motion().data();
  const double next_start = spread_since_build(motion);
  const double next_motion = step_.problem.timestep * spread(motion);
  const bool short_of_reach = next_start + 1.5 * next_motion > list_.reach() || growth_ > 0.0;
  return short_of_reach || strayed_ > MOST_STRAYED;
}

/* ----------------------------------------------------------------------
   the time step
------------------------------------------------------------------------- */

void StepLength::begin_step()
{
  spread_at_start_ = spread_since_build(nullptr);
  first_timestep_ = 0.0;
}

void StepLength::fit_to_list()
{
  if (step_.settings.shorten && spread_at_start_ < list_.reach()) {
    const double motion = unhindered_spread(step_.kicks());
    if (spread_at_start_ + update->dt * motion > list_.reach())
      shorten(room_in_list(unhindered_spread(0.0), motion), "");
  }
  if (first_timestep_ == 0.0) first_timestep_ = update->dt;
}

bool StepLength::accepts(bool solved, const std::string &named, const std::string &squeezed)
{
  const bool may_shorten = step_.settings.shorten;
  // Pairs that are not listed were at least list_.reach() apart when the list was built.
  const double motion = spread(step_.motion().data());
  if (!(spread_at_start_ + update->dt * motion <= list_.reach())) {
    if (!may_shorten || spread_at_start_ >= list_.reach()) {
      if (!squeezed.empty())
        error->all(FLERR,
                   "Fix inelastic: step {}: {}, and further than the neighbour list reaches: keep "
                   "them further apart than its diameter",
                   update->ntimestep, squeezed);
      const double needed = spread_at_start_ + step_.problem.timestep * motion;
      error->all(
          FLERR,
          "Fix inelastic: step {}: spheres move by up to {:.6g} relative to one another, further "
          "than the neighbour list reaches ({:.6g}): set the skin of the neighbor command to at "
          "least {:.6g}, or lower the timestep, or use shorten yes",
          update->ntimestep, needed, list_.reach(), 1.2 * needed);
    }
    shorten(room_in_list(motion, motion), named);
    return false;
  }
  const double part = part_of_farthest();
  if (part >= 1.0 && !may_shorten)
    error->all(FLERR,
               "Fix inelastic: step {}: spheres move further than LAMMPS can follow them between "
               "two neighbour lists, {:.3g} times as far: lower the timestep, or use shorten yes",
               update->ntimestep, part);
  // What a step that is not solved leaves too deep a shorter one may leave, too. Regular overlaps
  // beside bad ones are kept to within the residual, in steps of any length.
  const double kept = step_.bad_start ? step_.eps(in_eps::KEPT - in_eps::REGULAR) : 0.0;
  if (part >= 1.0 || (may_shorten && solved && step_.excess > kept)) {
    shorten(0.5, named);
    return false;
  }
  return true;
}

bool StepLength::may_shorten_unsolved(bool law_parts) const
{
  // What a law asks for can be had in a step that is short enough, however short the list has made
  // it. A bed that is being crushed cannot be helped by steps that are ever shorter.
  const double from = law_parts ? first_timestep_ : step_.regular_timestep;
  const double shortest =
      std::max(SHORTEST_UNSOLVED * from, 2.0 * SHORTEST_STEP * step_.regular_timestep);
  return step_.settings.shorten && update->dt > shortest;
}

void StepLength::shorten(double factor, const std::string &named)
{
  const double timestep = factor * update->dt, shortest = SHORTEST_STEP * step_.regular_timestep;
  // Where motions are no finite numbers the factor is none, either.
  if (!(timestep >= shortest))
    error->all(FLERR, "Fix inelastic: step {}: no time step above {:.3g} keeps the spheres apart{}",
               update->ntimestep, std::isfinite(timestep) ? timestep : shortest,
               named.empty() ? " and within reach of the neighbour list: lower the timestep"
                             : ": " + named);
  if (update->dt == step_.regular_timestep) ++shortened_steps_;
  set_timestep(timestep);
  shortened_ = true;
}

void StepLength::restore()
{
  if (shortened_ && update->dt != step_.regular_timestep) set_timestep(step_.regular_timestep);
  shortened_ = false;
}

void StepLength::set_regular_timestep(double timestep)
{
  set_timestep(timestep);
  step_.regular_timestep = timestep;
}

bool StepLength::is_shortened() const
{ return update->dt != step_.regular_timestep; }

// A change by the fix itself leaves the regular time step what it is.
void StepLength::timestep_was_set()
{
  if (!setting_timestep_) step_.regular_timestep = update->dt;
}

void StepLength::set_timestep(double timestep)
{
  setting_timestep_ = true;
  update->update_time();
  update->dt = timestep;
  update->dt_default = 0;
  if (force->pair) force->pair->reset_dt();
  for (Fix *fix : modify->get_fix_list()) fix->reset_dt();
  output->reset_dt();
  setting_timestep_ = false;
}
