#include "inelastic_list_reach.h"

#include "inelastic_ghost_exchange.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "group.h"
#include "neighbor.h"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

constexpr double BELOW_ONE = 1.0 - 1.0e-12;    // by the round-off of a sum of a cutoff and a skin
constexpr double ABOVE_ONE = 1.0 + 1.0e-12;    // by that of a quotient
// An overlap of two spheres is not known better than this part of the largest coordinate. Each of
// the three coordinates of either is rounded by up to half of the machine epsilon.
constexpr double POSITIONS_RESOLVED = 2.0 * std::numeric_limits<double>::epsilon();
// Parts of the smallest radius: a tolerance that serves nearly every packing, and one beyond which
// a packing means little.
constexpr double USUAL_TOLERANCE = 0.001, COARSE_TOLERANCE = 0.1;

}    // namespace

ListReach::ListReach(LAMMPS *lmp, Step &step, GhostExchange &ranks) :
    Pointers(lmp), step_(step), ranks_(ranks)
{
}

void ListReach::measure_radii()
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

const char *ListReach::name_of_group() const
{
  const int *const bits = group->bitmask;
  return group->names[std::find(bits, bits + group->ngroup, step_.settings.group_bit) - bits];
}

void ListReach::choose_list()
{
  constexpr double SIMILAR = 1.1;
  one_cutoff_ = step_.largest_radius <= SIMILAR * smallest_radius_;
}

void ListReach::warn_of_tolerance() const
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

void ListReach::built()
{
  measure_radii();
  check_tolerance();
  const std::vector<double> radius = radii_of_types();
  check(radius);
  // With neighbor multi pairs are looked for as far as the pair style reaches for their types.
  if (neighbor->style == Neighbor::MULTI || neighbor->style == Neighbor::MULTI_OLD)
    check_types(radius);
  reach_ = one_cutoff_ ? least_listed(radius) - 2.0 * step_.largest_radius : neighbor->skin;
}

void ListReach::check_tolerance() const
{
  double largest = 0.0;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!step_.in_group(atom, i)) continue;
    for (int d = 0; d < 3; ++d) largest = std::max(largest, std::abs(atom->x[i][d]));
  }
  ranks_.reduce(nullptr, 0, &largest, 1);
  const double tolerance = step_.settings.tolerance;
  const double resolution = POSITIONS_RESOLVED * (largest + step_.largest_radius);
  if (tolerance < resolution)
    error->all(FLERR,
               "Fix inelastic: the tolerance {:.4g} is below the round-off of positions: with "
               "coordinates of up to {:.4g} give at least {:.2g}",
               tolerance, largest, 1.05 * resolution);
}

// Returns the largest radius of each atom type in the group, from type 1 on at place 1; 0 for a
// type without spheres [length]. Collective.
std::vector<double> ListReach::radii_of_types() const
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
double ListReach::least_listed(const std::vector<double> &radius) const
{
  double least = EXTREME;
  for (int one = 1; one <= atom->ntypes; ++one)
    for (int other = one; other <= atom->ntypes; ++other)
      if (radius[one] > 0.0 && radius[other] > 0.0)
        least = std::min(least, std::sqrt(neighbor->cutneighsq[one][other]));
  return least < EXTREME ? least : neighbor->cutneighmin;
}

void ListReach::check(const std::vector<double> &radius) const
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

void ListReach::check_types(const std::vector<double> &radius) const
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
