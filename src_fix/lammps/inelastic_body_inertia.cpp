#include "inelastic_body_inertia.h"

#include "inelastic_periods.h"
#include "inelastic_step.h"

#include "atom.h"
#include "compute.h"
#include "modify.h"

#include "fmt/format.h"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::dot;
using inelastic::norm;

namespace {

constexpr double COLLINEAR = 1.0e-7;    // smallest moment over the others; LAMMPS drops it there
// Point masses nearer to one another than this part of the largest coordinate, times the machine
// epsilon, have an inertia, and turn, as the round-off of their positions will have it.
constexpr double RESOLVED_ARM = 1.0e7;
constexpr double AGREEMENT = 1.0e-6;    // relative, of masses and moments computed in two ways

double trace(const double *a)
{ return a[0] + a[1] + a[2]; }

double determinant(const double *a)
{
  return a[0] * (a[1] * a[2] - a[5] * a[5]) - a[3] * (a[3] * a[2] - a[5] * a[4]) +
      a[4] * (a[3] * a[5] - a[1] * a[4]);
}

double trace_of_square(const double *a)
{
  return a[0] * a[0] + a[1] * a[1] + a[2] * a[2] + 2.0 * (a[3] * a[3] + a[4] * a[4] + a[5] * a[5]);
}

// The inverse of an inertia; its pseudo-inverse where the masses lie on a line (two equal moments t
// and a third of zero: A A = t A) or in one point; then the result is true.
bool invert_inertia(const double *a, double *inverse)
{
  const double t = 0.5 * trace(a);
  const double det = determinant(a);
  if (det <= COLLINEAR * t * t * t) {
    for (int k = 0; k < 6; ++k) inverse[k] = t > 0.0 ? a[k] / (t * t) : 0.0;
    return true;
  }
  inverse[0] = (a[1] * a[2] - a[5] * a[5]) / det;
  inverse[1] = (a[0] * a[2] - a[4] * a[4]) / det;
  inverse[2] = (a[0] * a[1] - a[3] * a[3]) / det;
  inverse[3] = (a[4] * a[5] - a[3] * a[2]) / det;
  inverse[4] = (a[3] * a[5] - a[4] * a[1]) / det;
  inverse[5] = (a[3] * a[4] - a[0] * a[5]) / det;
  return false;
}

// Tells whether an inertia has these principal moments: the same trace, sum of squares and product.
bool same_moments(const double *inertia, const double *moments)
{
  const double sum = moments[0] + moments[1] + moments[2];
  const double squares = dot(moments, moments);
  const double product = moments[0] * moments[1] * moments[2];
  return std::abs(trace(inertia) - sum) <= AGREEMENT * sum &&
      std::abs(trace_of_square(inertia) - squares) <= AGREEMENT * squares &&
      std::abs(determinant(inertia) - product) <= AGREEMENT * sum * sum * sum;
}

}    // namespace

void BodyInertias::measure(inelastic::ContactProblem &problem, const std::vector<int> &original_of)
{
  inelastic::RigidBodies &bodies = problem.bodies;
  inertias_.resize(bodies.size());
  double *const arm = bodies.arm.data();
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    measure_masses(bodies, b);
    const int begin = bodies.start[b];
    for (int k = begin + bodies.originals[b]; k < bodies.start[b + 1]; ++k)
      std::copy_n(arm + 3 * (begin + original_of[k]), 3, arm + 3 * k);
    bodies.inverse_mass[b] = 1.0 / inertias_[b].mass;
    invert_inertia(inertias_[b].inertia, &bodies.inverse_inertia[6 * b]);
  }
}

// The arms of the originals, from the centre of mass, and the masses about it.
void BodyInertias::measure_masses(inelastic::RigidBodies &bodies, std::size_t b)
{
  const double *const *const x = atom->x;
  const int begin = bodies.start[b];
  const int end = begin + bodies.originals[b];
  double *const arm = bodies.arm.data();
  const double *const x0 = x[bodies.member[begin]];
  double total = 0.0, centre[3] = {0.0, 0.0, 0.0};
  for (int k = begin; k < end; ++k) {
    const int i = bodies.member[k];
    double *const r = arm + 3 * k;
    for (int d = 0; d < 3; ++d) r[d] = x[i][d] - x0[d];
    Periods(lmp).to_nearest_image(r);
    const double m = mass_of(atom, i);
    total += m;
    for (int d = 0; d < 3; ++d) centre[d] += m * r[d];
  }
  BodyInertia &body = inertias_[b];
  body.mass = total;
  double *const point = body.point_inertia;
  std::fill_n(point, 6, 0.0);
  double balls = 0.0;
  for (int k = begin; k < end; ++k) {
    const int i = bodies.member[k];
    double *const r = arm + 3 * k;
    for (int d = 0; d < 3; ++d) r[d] -= centre[d] / total;
    const double m = mass_of(atom, i), square = dot(r, r);
    for (int d = 0; d < 3; ++d) point[d] += m * (square - r[d] * r[d]);
    point[3] -= m * r[0] * r[1];
    point[4] -= m * r[0] * r[2];
    point[5] -= m * r[1] * r[2];
    balls += SPHERE_MOMENT * m * atom->radius[i] * atom->radius[i];
  }
  body.collinear = invert_inertia(point, body.point_inverse);
  std::copy_n(point, 6, body.inertia);
  if (kind_ == Inertia::SOLID)
    for (int d = 0; d < 3; ++d) body.inertia[d] += balls;
}

std::string BodyInertias::disagreement(const inelastic::ContactProblem &problem,
                                       const std::string &fix_id)
{
  const std::string compute_id = "inelastic_bodies_of_" + fix_id;
  Compute *const compute = modify->add_compute(
      fmt::format("{} all rigid/local {} id mass inertiax inertiay inertiaz", compute_id, fix_id));
  compute->init();
  compute->compute_local();
  std::string message;
  for (int row = 0; row < compute->size_local_rows && message.empty(); ++row) {
    const double *const found = compute->array_local[row];
    const int i = atom->map(static_cast<tagint>(found[0]));
    const int b = i < 0 ? -1 : problem.bodies.body[i];
    if (b < 0) continue;    // outside the fix's group
    message = compare(problem, fix_id, i, b, found[1], found + 2);
  }
  modify->delete_compute(compute_id);
  return message;
}

std::string BodyInertias::compare(const inelastic::ContactProblem &problem,
                                  const std::string &fix_id, int i, int b, double mass,
                                  const double *moments) const
{
  const BodyInertia &body = inertias_[b];
  const tagint molecule = atom->molecule[i];
  if (std::abs(body.mass - mass) > AGREEMENT * body.mass)
    return fmt::format("fix {} gives the body of molecule {} the mass {:.6g}, its spheres have "
                       "{:.6g}: bodies must be molecules (rigid/small molecule), their masses "
                       "set before fix {}, with no other ones in an infile",
                       fix_id, molecule, mass, body.mass, fix_id);
  const double extent = std::sqrt(trace(body.point_inertia) / body.mass);
  const double rounded = std::numeric_limits<double>::epsilon() * norm(atom->x[i]);
  if (kind_ == Inertia::POINT && extent < RESOLVED_ARM * rounded)
    return fmt::format(
        "the spheres of molecule {} are about {:.2g} apart, too near to one another "
        "for point masses at coordinates that are rounded by {:.1g}: at least {:.1g} "
        "is needed, or rigid {} solid, or one sphere in their place",
        molecule, extent, rounded, RESOLVED_ARM * rounded, fix_id);
  if (same_moments(body.inertia, moments)) return "";
  return other_moments(problem.bodies, fix_id, i, b, moments);
}

std::string BodyInertias::other_moments(const inelastic::RigidBodies &bodies,
                                        const std::string &fix_id, int i, int b,
                                        const double *moments) const
{
  const BodyInertia &body = inertias_[b];
  double balls[6];
  std::copy_n(body.point_inertia, 6, balls);
  const int begin = bodies.start[b];
  for (int k = begin; k < begin + bodies.originals[b]; ++k) {
    const int j = bodies.member[k];
    for (int d = 0; d < 3; ++d)
      balls[d] += SPHERE_MOMENT * mass_of(atom, j) * atom->radius[j] * atom->radius[j];
  }
  const char *const kind = same_moments(body.point_inertia, moments) ? "of point masses"
      : same_moments(balls, moments)                                 ? "of solid spheres"
                                     : "neither of point masses nor of solid spheres";
  return fmt::format(
      "fix {} turns the body of molecule {} with the moments of inertia {:.6g}, {:.6g}, {:.6g}, "
      "{}, where fix inelastic has rigid {} {}. Spheres count as point masses for rigid/small if "
      "their diameter is 0 when its bodies are set up; moments from an infile must be one or the "
      "other",
      fix_id, atom->molecule[i], moments[0], moments[1], moments[2], kind, fix_id,
      kind_ == Inertia::POINT ? "point" : "solid");
}
