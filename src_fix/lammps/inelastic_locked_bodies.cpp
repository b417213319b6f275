#include "inelastic_locked_bodies.h"

#include "inelastic_lammps_versions.h"
#include "inelastic_periods.h"

#include "atom.h"
#include "domain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::dot;
using inelastic::norm;

namespace {

// Directions spread evenly over the sphere (a Fibonacci lattice): a way out is a cone of them.
std::vector<std::array<double, 3>> all_directions()
{
  constexpr int NUMBER = 100;
  const double golden = std::acos(-1.0) * (3.0 - std::sqrt(5.0));
  std::vector<std::array<double, 3>> directions;
  for (int k = 0; k < NUMBER; ++k) {
    const double z = 1.0 - (2.0 * k + 1.0) / NUMBER, across = std::sqrt(1.0 - z * z);
    directions.push_back({across * std::cos(golden * k), across * std::sin(golden * k), z});
  }
  return directions;
}

// Tells whether all spheres of one body may go along a direction without that any comes nearer to
// one of the other than touching, or than now if they overlap. `away` (3 per pair) leads from the
// spheres of the other to those of the one, `radii` is the sum of their radii.
bool is_way_out(const double *direction, const std::vector<double> &away,
                const std::vector<double> &radii)
{
  constexpr double ROUND_OFF = 1.0e-9;
  for (std::size_t p = 0; p < radii.size(); ++p) {
    const double *const r = &away[3 * p];
    const double along = dot(r, direction);
    if (along >= 0.0) continue;
    const double square = dot(r, r);
    const double nearest = square - along * along;
    if (nearest < (1.0 - ROUND_OFF) * std::min(square, radii[p] * radii[p])) return false;
  }
  return true;
}

}    // namespace

LockedBodies::LockedBodies(LAMMPS *lmp, const Step &step) : Pointers(lmp), step_(step) {}

// Returns all bodies that this rank sees, and the free spheres, each where its first image is.
std::vector<LockedBodies::Grain> LockedBodies::grains() const
{
  const inelastic::RigidBodies &bodies = step_.problem.bodies;
  std::vector<Grain> grains;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    Grain body = {};
    const int first = bodies.member[bodies.start[b]];
    for (int d = 0; d < 3; ++d) body.centre[d] = atom->x[first][d] - step_.arm(first)[d];
    for (int k = bodies.start[b]; k < bodies.start[b] + bodies.originals[b]; ++k) {
      body.spheres.push_back(bodies.member[k]);
      body.reach = std::max(body.reach, norm(&bodies.arm[3 * k]) + atom->radius[bodies.member[k]]);
    }
    grains.push_back(std::move(body));
  }
  for (int i = 0; i < step_.problem.particles; ++i)
    if (step_.in_group(atom, i) && !step_.is_member(i))
      grains.push_back({{atom->x[i][0], atom->x[i][1], atom->x[i][2]}, atom->radius[i], {i}});
  return grains;
}

// Pairs are looked for along an axis that is not periodic, from one end to the other.
void LockedBodies::find()
{
  pairs_.clear();
  const Periods periods(lmp);
  const int axis = !periods.along(0) ? 0 : !periods.along(1) ? 1 : !periods.along(2) ? 2 : -1;
  std::vector<Grain> all = grains();
  auto begin = [axis](const Grain &grain) {
    return axis < 0 ? 0.0 : grain.centre[axis] - grain.reach;
  };
  std::sort(all.begin(), all.end(), [&](const Grain &one, const Grain &other) {
    return begin(one) < begin(other);
  });
  for (std::size_t one = 0; one < all.size(); ++one) {
    const double end = begin(all[one]) + 2.0 * all[one].reach;
    for (std::size_t other = one + 1; other < all.size() && begin(all[other]) <= end; ++other)
      if (all[one].spheres.size() + all[other].spheres.size() > 2) look_at(all[one], all[other]);
  }
}

void LockedBodies::look_at(const Grain &one, const Grain &other)
{
  static const std::vector<std::array<double, 3>> directions = all_directions();
  double between[3];
  for (int d = 0; d < 3; ++d) between[d] = one.centre[d] - other.centre[d];
  NearestImage<Domain>::of(domain, between);
  const double distance = norm(between);
  if (distance > one.reach + other.reach) return;
  away_.clear();
  radii_.clear();
  double least = EXTREME;
  Pair nearest = {};
  for (const int i : one.spheres)
    for (const int j : other.spheres) {
      double r[3];
      // Spheres of a body may be images that are far from one another, its arms are not.
      for (int d = 0; d < 3; ++d) r[d] = between[d] + step_.arm(i)[d] - step_.arm(j)[d];
      away_.insert(away_.end(), r, r + 3);
      radii_.push_back(atom->radius[i] + atom->radius[j]);
      const double gap = norm(r) - radii_.back();
      if (gap >= least) continue;
      least = gap;
      nearest = {i, j};
    }
  // It is the business of the rank that has the sphere with the lower ID.
  if (atom->tag[nearest.first] > atom->tag[nearest.second])
    std::swap(nearest.first, nearest.second);
  if (nearest.first >= atom->nlocal || atom->tag[nearest.first] == atom->tag[nearest.second])
    return;
  if (distance > 0.0) {
    for (double &component : between) component /= distance;
    if (is_way_out(between, away_, radii_)) return;
  }
  for (const std::array<double, 3> &direction : directions)
    if (is_way_out(direction.data(), away_, radii_)) return;
  nearest.second = domain->closest_image(nearest.first, nearest.second);
  pairs_.push_back(nearest);
}
