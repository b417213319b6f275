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

constexpr double BELOW_ONE = 1.0 - 1.0e-12;    // by the round-off of a sum of a cutoff and a skin
constexpr double ABOVE_ONE = 1.0 + 1.0e-12;    // by that of a quotient
constexpr double SHORTEST_STEP = 1.0e-6;       // of the regular one: below, something else is wrong
constexpr double SHORTEST_UNSOLVED = 1.0e-3;    // below, it is not the step that is too long
// An overlap of two spheres is not known better than this part of the largest coordinate. Each of
// the three coordinates of either is rounded by up to half of the machine epsilon.
constexpr double POSITIONS_RESOLVED = 2.0 * std::numeric_limits<double>::epsilon();
// An atom may stray by this part of what its rank owns of the box: LAMMPS brings it back from the
// next part alone.
constexpr double MOST_STRAYED = 0.5;
// Parts of the smallest radius: a tolerance that serves nearly every packing, and one beyond which
// a packing means little.
constexpr double USUAL_TOLERANCE = 0.001, COARSE_TOLERANCE = 0.1;

}    // namespace

StepLength::StepLength(LAMMPS *lmp, Step &step, GhostExchange &ranks) :
    Pointers(lmp), step_(step), ranks_(ranks)
{ step_.regular_timestep = update->dt; }

/* ----------------------------------------------------------------------
   the neighbour list's reach
------------------------------------------------------------------------- */

void StepLength::measure_radii()
{
  double radii[2] = {0.0, -EXTREME};
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!step_.in_group(atom, i)) continue;
    radii[0] = std::max(radii[0], atom->radius[i]);
    radii[1] = std::max(radii[1], -atom->radius[i]);
  }
  ranks_.reduce(nullptr, 0, radii, 2);
  step_.largest_radius = radii[0];
  smallest_radius_ = -radii[1];
  if (step_.largest_radius > 0.0 && !(smallest_radius_ > 0.0))
    error->all(FLERR, "Fix inelastic: an atom of group {} has no radius: set its diameter",
               name_of_group());
  if (step_.largest_radius > 0.0 && step_.settings.tolerance >= smallest_radius_)
    error->all(
        FLERR,
        "Fix inelastic: the tolerance {:.4g}, the largest overlap allowed, must be below the "
        "smallest radius of group {}, {:.4g}: give a thousandth of that, {:.2g}, or less",
        step_.settings.tolerance, name_of_group(), smallest_radius_,
        USUAL_TOLERANCE * smallest_radius_);
}

const char *StepLength::name_of_group() const
{
  const int *const bits = group->bitmask;
  return group->names[std::find(bits, bits + group->ngroup, step_.settings.group_bit) - bits];
}

void StepLength::choose_list()
{
  constexpr double SIMILAR = 1.1;
  one_cutoff_ = step_.largest_radius <= SIMILAR * smallest_radius_;
}

void StepLength::warn_of_tolerance() const
{
  const double part = step_.settings.tolerance / smallest_radius_;
  if (comm->me != 0 || !(part > COARSE_TOLERANCE * ABOVE_ONE) || step_.largest_radius == 0.0)
    return;
  error->warning(
      FLERR,
      "Fix inelastic: the tolerance {:.4g} lets spheres overlap by {:.2g} of the smallest "
      "radius of group {}, {:.4g}: give a thousandth of that, {:.2g}, or less",
      step_.settings.tolerance, part, name_of_group(), smallest_radius_,
      USUAL_TOLERANCE * smallest_radius_);
}

void StepLength::begin_run()
{
  warn_of_tolerance();
  restore();
  step_.regular_timestep = update->dt;
}

void StepLength::list_built()
{
  const double *const *const x = atom->x;
  position_at_build_.resize(3 * static_cast<std::size_t>(atom->nlocal));
  radius_at_build_.assign(atom->radius, atom->radius + atom->nlocal);
  for (int i = 0; i < atom->nlocal; ++i) std::copy_n(x[i], 3, &position_at_build_[3 * i]);

  measure_radii();
  double largest = 0.0;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!step_.in_group(atom, i)) continue;
    for (int d = 0; d < 3; ++d) largest = std::max(largest, std::abs(x[i][d]));
  }
  ranks_.reduce(nullptr, 0, &largest, 1);
  const double tolerance = step_.settings.tolerance;
  const double resolution = POSITIONS_RESOLVED * (largest + step_.largest_radius);
  if (tolerance < resolution)
    error->all(FLERR,
               "Fix inelastic: the tolerance {:.4g} is below the round-off of positions: with "
               "coordinates of up to {:.4g} give at least {:.2g}",
               tolerance, largest, 1.05 * resolution);
  const std::vector<double> radius = radii_of_types();
  check_reach(radius);
  // With neighbor multi pairs are looked for as far as the pair style reaches for their types.
  if (neighbor->style == Neighbor::MULTI || neighbor->style == Neighbor::MULTI_OLD)
    check_reach_of_types(radius);
  measure_farthest();
  list_reach_ = one_cutoff_ ? least_listed(radius) - 2.0 * step_.largest_radius : neighbor->skin;
}

// Returns the largest radius of each atom type in the group, from type 1 on at place 1; 0 for a
// type without spheres [length]. Collective.
std::vector<double> StepLength::radii_of_types() const
{
  std::vector<double> mine(atom->ntypes + 1, 0.0), radius(mine.size());
  for (int i = 0; i < atom->nlocal; ++i)
    if (step_.in_group(atom, i))
      mine[atom->type[i]] = std::max(mine[atom->type[i]], atom->radius[i]);
  MPI_Allreduce(mine.data(), radius.data(), static_cast<int>(mine.size()), MPI_DOUBLE, MPI_MAX,
                world);
  return radius;
}

// Returns how far a list by cutoffs reaches between spheres of any types that have some; of all
// types where none has [length].
double StepLength::least_listed(const std::vector<double> &radius) const
{
  double least = EXTREME;
  for (int one = 1; one <= atom->ntypes; ++one)
    for (int other = one; other <= atom->ntypes; ++other)
      if (radius[one] > 0.0 && radius[other] > 0.0)
        least = std::min(least, std::sqrt(neighbor->cutneighsq[one][other]));
  return least < EXTREME ? least : neighbor->cutneighmin;
}

void StepLength::check_reach(const std::vector<double> &radius) const
{
  const double widest = 2.0 * step_.largest_radius + neighbor->skin;
  const double listed = one_cutoff_ ? least_listed(radius) : neighbor->cutneighmax;
  if (listed >= widest * BELOW_ONE) return;
  // As LAMMPS creates them.
  constexpr double DEFAULT_DIAMETER = 1.0;
  const bool as_created = 2.0 * step_.largest_radius == DEFAULT_DIAMETER;
  error->all(
      FLERR,
      "Fix inelastic: the neighbour list reaches {:.6g} between centres but needs {:.6g}: give "
      "pair_style zero a cutoff of at least the largest diameter, {:.6g}{}",
      listed, widest, 2.0 * step_.largest_radius,
      as_created
          ? " (which LAMMPS gives to spheres that it creates: or was set diameter forgotten?)"
          : "");
}

void StepLength::check_reach_of_types(const std::vector<double> &radius) const
{
  for (int one = 1; one <= atom->ntypes; ++one)
    for (int other = one; other <= atom->ntypes; ++other) {
      if (radius[one] == 0.0 || radius[other] == 0.0) continue;
      const double sum = radius[one] + radius[other];
      const double listed = std::sqrt(neighbor->cutneighsq[one][other]);
      if (listed < (sum + neighbor->skin) * BELOW_ONE)
        error->all(
            FLERR,
            "Fix inelastic: with neighbor multi the neighbour list reaches {:.6g} between "
            "centres of atom types {} and {} but needs {:.6g}: give pair_style zero a cutoff "
            "of at least {:.6g} for them",
            listed, one, other, sum + neighbor->skin, sum);
    }
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
  displacement_.resize(3 * static_cast<std::size_t>(atom->nlocal));
  for (int i = 0; i < atom->nlocal; ++i)
    for (int d = 0; d < 3; ++d)
      displacement_[3 * i + d] = atom->x[i][d] - position_at_build_[3 * i + d] +
          (motion ? step_.problem.timestep * motion[3 * i + d] : 0.0);
  growth_ = strayed_ = 0.0;
  for (int i = 0; i < atom->nlocal; ++i) {
    growth_ = std::max(growth_, atom->radius[i] - radius_at_build_[i]);
    for (int d = 0; d < 3; ++d)
      strayed_ = std::max(strayed_, std::abs(displacement_[3 * i + d]) / own_width_[d]);
  }
  double maxima[2] = {growth_, strayed_};
  ranks_.reduce(nullptr, 0, maxima, 2);
  growth_ = maxima[0];
  strayed_ = maxima[1];
  return spread(displacement_.data()) + 2.0 * growth_;
}

// The spread of the velocities after so many kicks (0, 0.5 or 1) by the forces alone. Bodies turn
// in other ways: for them this is about it.
double StepLength::unhindered_spread(double kicks)
{
  unhindered_.resize(3 * static_cast<std::size_t>(atom->nlocal));
  for (int i = 0; i < atom->nlocal; ++i) {
    const double kick_per_force =
        step_.is_mobile(atom, i) ? kicks * update->dt * force->ftm2v / mass_of(atom, i) : 0.0;
    for (int d = 0; d < 3; ++d)
      unhindered_[3 * i + d] = atom->v[i][d] + kick_per_force * atom->f[i][d];
  }
  return spread(unhindered_.data());
}

// The part of the time step for which the list would reach, with some reserve, where velocities
// have the spread `whole` in the whole step and `none` before its forces: in a part s, whose kick
// is smaller, they have at most (1 - s) none + s whole.
double StepLength::room_in_list(double none, double whole) const
{
  constexpr double RESERVE = 0.9;
  const double room = RESERVE * (list_reach_ - spread_at_start_) / update->dt;
  return 2.0 * room / (none + std::sqrt(none * none + 4.0 * (whole - none) * room));
}

bool StepLength::needs_new_list()
{
  const double *const motion = step_.motion().data();
  const double next_start = spread_since_build(motion);
  const double next_motion = step_.problem.timestep * spread(motion);
  const bool short_of_reach = next_start + 1.5 * next_motion > list_reach_ || growth_ > 0.0;
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
  if (step_.settings.shorten && spread_at_start_ < list_reach_) {
    const double motion = unhindered_spread(step_.kicks());
    if (spread_at_start_ + update->dt * motion > list_reach_)
      shorten(room_in_list(unhindered_spread(0.0), motion), "");
  }
  if (first_timestep_ == 0.0) first_timestep_ = update->dt;
}

bool StepLength::accepts(bool solved, const std::string &named, const std::string &squeezed)
{
  const bool may_shorten = step_.settings.shorten;
  // Pairs that are not listed were at least list_reach_ apart when the list was built.
  const double motion = spread(step_.motion().data());
  if (!(spread_at_start_ + update->dt * motion <= list_reach_)) {
    if (!may_shorten || spread_at_start_ >= list_reach_) {
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
          update->ntimestep, needed, list_reach_, 1.2 * needed);
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
  const double kept = step_.bad_start ? step_.settings.tolerance : 0.0;
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
  const double timestep = factor * update->dt;
  if (timestep < SHORTEST_STEP * step_.regular_timestep)
    error->all(FLERR, "Fix inelastic: step {}: no time step above {:.3g} keeps the spheres apart{}",
               update->ntimestep, timestep,
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
