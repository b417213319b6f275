#include "inelastic_cluster_motions.h"

#include "inelastic_atom_state.h"
#include "inelastic_ghost_exchange.h"
#include "inelastic_periods.h"

#include "atom.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::cross;
using inelastic::dot;
using inelastic::norm;

namespace {

// A particle is held if contacts resist its motion by this part of its unit.
constexpr double HELD = 0.1;

// Solves A x = b for a symmetric matrix A >= 0, given as xx yy zz xy xz yz, that has no inverse
// where particles lie in a line or are one: what is below `size` times round-off counts as none.
void solve_symmetric(const double *a, double size, const double *b, double *x)
{
  constexpr double ROUNDED = 1.0e-10;
  const double least = ROUNDED * (a[0] + a[1] + a[2] + size);
  const double xx = a[0] + least, yy = a[1] + least, zz = a[2] + least;
  // By Cramer's rule, of a matrix that is positive definite now.
  const double c00 = yy * zz - a[5] * a[5], c01 = a[4] * a[5] - a[3] * zz,
               c02 = a[3] * a[5] - yy * a[4];
  const double c11 = xx * zz - a[4] * a[4], c12 = a[3] * a[4] - xx * a[5],
               c22 = xx * yy - a[3] * a[3];
  const double determinant = xx * c00 + a[3] * c01 + a[4] * c02;
  if (!(determinant > 0.0)) {
    std::fill_n(x, 3, 0.0);
    return;
  }
  x[0] = (c00 * b[0] + c01 * b[1] + c02 * b[2]) / determinant;
  x[1] = (c01 * b[0] + c11 * b[1] + c12 * b[2]) / determinant;
  x[2] = (c02 * b[0] + c12 * b[1] + c22 * b[2]) / determinant;
}

}    // namespace

ClusterMotions::ClusterMotions(LAMMPS *lmp, const Step &step, GhostExchange &ranks,
                               AtomState &state) :
    Pointers(lmp), step_(step), ranks_(ranks), state_(state), clusters_(lmp, step, ranks),
    pieces_(lmp, step, ranks)
{
}

const ClusterPieces &ClusterMotions::find_pieces()
{
  pieces_.find();
  return pieces_;
}

void ClusterMotions::measure(double quiet_steps)
{
  measure_clusters();
  measure_resistance();
  measure_by_motion();
  measure_slip(quiet_steps);
}

bool ClusterMotions::counts(int i) const
{ return step_.in_group(atom, i) && clusters_.of(i) != Clusters::NONE; }

// The velocity of a particle without the common one of its cluster.
std::array<double, 3> ClusterMotions::own_velocity(int i) const
{
  const double *const v = velocity(i);
  const std::array<double, 3> &common = of(i).common;
  return {v[0] - common[0], v[1] - common[1], v[2] - common[2]};
}

// Adds up what contacts resist of the motion of each particle, and counts the gaps that they have
// still to close, ghosts included.
void ClusterMotions::measure_resistance()
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  resistance_.assign(3 * static_cast<std::size_t>(step_.problem.particles), 0.0);
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const double impulse = std::abs(contacts.impulse[c]);
    if (impulse == 0.0) continue;
    const bool open = step_.contact_of(c).gap_now > step_.settings.tolerance;
    for (const int i : {contacts.first[c], contacts.second[c]}) {
      if (!clusters_.is_mobile(i)) continue;
      const double along = dot(&contacts.normal[3 * c], own_velocity(i).data());
      double *const of_particle = &resistance_[3 * static_cast<std::size_t>(i)];
      of_particle[0] += impulse * along * along;
      if (open) of_particle[1] += 1.0;
      of_particle[2] += 1.0;
    }
  }
  ranks_.sum_over_ghosts(resistance_.data(), 3);
}

Motion ClusterMotions::motion_of(int i) const
{
  const inelastic::ContactProblem &problem = step_.problem;
  Motion motion;
  double mass = 0.0, square = 0.0, taken = 0.0, resisted = 0.0;
  const auto add = [&](int k) {
    const double m = mass_of(atom, k);
    const double *const v = velocity(k);
    const double *const predicted = &problem.predicted_velocity[3 * static_cast<std::size_t>(k)];
    const double change[3] = {predicted[0] - v[0], predicted[1] - v[1], predicted[2] - v[2]};
    const std::array<double, 3> own = own_velocity(k);
    mass += m;
    square += m * dot(own.data(), own.data());
    taken += m * dot(change, change);
    resisted += resistance_[3 * static_cast<std::size_t>(k)];
    if (resistance_[3 * static_cast<std::size_t>(k) + 1] > 0.0) motion.closes = true;
    if (resistance_[3 * static_cast<std::size_t>(k) + 2] > 0.0) motion.touched = true;
  };
  if (step_.is_member(i)) {
    const inelastic::RigidBodies &bodies = problem.bodies;
    const int b = bodies.body[i];
    for (int k = bodies.start[b]; k < bodies.start[b] + bodies.originals[b]; ++k)
      add(bodies.member[k]);
  } else
    add(i);
  motion.speed = std::sqrt(square / mass);
  motion.taken = std::sqrt(taken / mass);
  motion.resisted = square > 0.0 ? resisted / square : 0.0;
  return motion;
}

double ClusterMotions::speed_between(int i, const std::vector<double> &one,
                                     const std::vector<double> &other) const
{
  double mass = 0.0, square = 0.0;
  const auto add = [&](int k) {
    const double m = mass_of(atom, k);
    const double *const a = &one[3 * static_cast<std::size_t>(k)];
    const double *const b = &other[3 * static_cast<std::size_t>(k)];
    const double between[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    mass += m;
    square += m * dot(between, between);
  };
  if (step_.is_member(i)) {
    const inelastic::RigidBodies &bodies = step_.problem.bodies;
    const int b = bodies.body[i];
    for (int k = bodies.start[b]; k < bodies.start[b] + bodies.originals[b]; ++k)
      add(bodies.member[k]);
  } else
    add(i);
  return std::sqrt(square / mass);
}

double ClusterMotions::unit(int i, const Motion &motion) const
{ return std::min(motion.taken, motions_[clusters_.of(i)].without_contacts); }

bool ClusterMotions::is_held(int i, const Motion &motion) const
{
  return motion.touched && !motion.closes &&
      (motion.speed == 0.0 || motion.resisted >= HELD * unit(i, motion));
}

void ClusterMotions::measure_clusters()
{
  std::vector<double> sums(SUMS * clusters_.size(), 0.0);
  std::vector<double> maxima(MAXIMA * clusters_.size(), -EXTREME);
  for (int i = 0; i < atom->nlocal; ++i)
    if (counts(i)) add_particle(i, &sums[SUMS * static_cast<std::size_t>(clusters_.of(i))]);
  const inelastic::ContactProblem &problem = step_.problem;
  for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
    const int i = problem.contacts.first[c], j = problem.contacts.second[c];
    const bool one = clusters_.is_mobile(i), other = clusters_.is_mobile(j);
    if (one && other) continue;
    const auto k = static_cast<std::size_t>(clusters_.of(one ? i : j));
    add_outer_contact(c, &sums[SUMS * k], &maxima[MAXIMA * k]);
  }
  clusters_.over_ranks(SUMS, sums, MAXIMA, maxima);
  motions_.assign(clusters_.size(), ClusterMotion{});
  for (std::size_t k = 0; k < motions_.size(); ++k)
    motions_[k] = motion_of_cluster(&sums[SUMS * k], &maxima[MAXIMA * k]);
}

// Adds a contact with a wall or a frozen particle to those of its cluster.
void ClusterMotions::add_outer_contact(std::size_t c, double *s, double *m) const
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  const int i = contacts.first[c], j = contacts.second[c];
  const bool frozen_moves =
      !step_.contact_of(c).is_with_wall() && norm(velocity(clusters_.is_mobile(i) ? j : i)) > 0.0;
  if (step_.rows[c].wall_motion != 0.0 || frozen_moves) m[DRIVEN] = 1.0;
  if (contacts.impulse[c] == 0.0) return;
  m[SUPPORTED] = 1.0;
  Directions::add(&contacts.normal[3 * c], s + NORMALS);
}

// Adds an owned particle to the sums of its cluster.
void ClusterMotions::add_particle(int i, double *s) const
{
  const double mass = mass_of(atom, i);
  const double *const x = atom->x[i], *const v = velocity(i);
  double moment[3];
  cross(x, v, moment);
  const double square = dot(x, x);
  s[MASS] += mass;
  for (int d = 0; d < 3; ++d) {
    s[CENTRE + d] += mass * x[d];
    s[MOMENTUM + d] += mass * v[d];
    s[ANGULAR + d] += mass * moment[d];
    s[INERTIA + d] += mass * (square - x[d] * x[d]);
  }
  s[INERTIA + 3] -= mass * x[0] * x[1];
  s[INERTIA + 4] -= mass * x[0] * x[2];
  s[INERTIA + 5] -= mass * x[1] * x[2];
  const double *const predicted =
      &step_.problem.predicted_velocity[3 * static_cast<std::size_t>(i)];
  s[SPEEDS] += norm(predicted);
  s[SQUARES] += dot(predicted, predicted);
  for (int d = 0; d < 3; ++d) s[PREDICTED + d] += predicted[d];
  s[STEPS] += state_.quiet_steps(i);
  s[NUMBER] += 1.0;
}

// The motion of a cluster from its sums and maxima over all ranks.
ClusterMotion ClusterMotions::motion_of_cluster(const double *s, const double *m) const
{
  ClusterMotion cluster;
  if (!(s[MASS] > 0.0)) return cluster;
  cluster.mass = s[MASS];
  // The count is that of most of its particles: single ones that join the cluster, and have not
  // been quiet, do not begin it anew.
  cluster.quiet_steps = std::round(s[STEPS] / s[NUMBER]);
  cluster.supported = m[SUPPORTED] > 0.0;
  cluster.driven = m[DRIVEN] > 0.0;
  for (int d = 0; d < 3; ++d) {
    cluster.centre[d] = s[CENTRE + d] / s[MASS];
    cluster.velocity[d] = s[MOMENTUM + d] / s[MASS];
  }
  cluster.held.span_range(s + NORMALS);
  cluster.common = cluster.held.without(cluster.velocity);
  for (int d = 0; d < 3; ++d) cluster.velocity[d] -= cluster.common[d];
  cluster.without_contacts = s[SPEEDS] / s[NUMBER];
  // Beside a common velocity: the root mean square of what is left of the others.
  const double common = dot(cluster.common.data(), cluster.common.data());
  if (common > 0.0)
    cluster.without_contacts = std::sqrt(std::max(
        0.0, (s[SQUARES] - 2.0 * dot(cluster.common.data(), s + PREDICTED)) / s[NUMBER] + common));
  double square = dot(cluster.velocity.data(), cluster.velocity.data());
  // Through periodic boundaries a cluster has no centre.
  if (!Periods(lmp).any()) {
    double of_centre[3], about_centre[3], inertia[6];
    cross(cluster.centre.data(), s + MOMENTUM, of_centre);
    const double *const x = cluster.centre.data();
    const double far = dot(x, x);
    for (int d = 0; d < 3; ++d) {
      about_centre[d] = s[ANGULAR + d] - of_centre[d];
      inertia[d] = s[INERTIA + d] - s[MASS] * (far - x[d] * x[d]);
    }
    inertia[3] = s[INERTIA + 3] + s[MASS] * x[0] * x[1];
    inertia[4] = s[INERTIA + 4] + s[MASS] * x[0] * x[2];
    inertia[5] = s[INERTIA + 5] + s[MASS] * x[1] * x[2];
    solve_symmetric(inertia, s[MASS] * far, about_centre, cluster.angular_velocity.data());
    square += dot(about_centre, cluster.angular_velocity.data()) / s[MASS];
  }
  cluster.speed = std::sqrt(std::max(0.0, square));
  return cluster;
}

// Measures what needs the motion of the clusters: the resistance to it, and the speeds of held
// particles.
void ClusterMotions::measure_by_motion()
{
  const inelastic::ContactProblem &problem = step_.problem;
  enum { RESISTED, SQUARES, HELD_NUMBER, SUMS };
  enum { FASTEST, MAXIMA };
  std::vector<double> sums(SUMS * clusters_.size(), 0.0);
  std::vector<double> maxima(MAXIMA * clusters_.size(), 0.0);
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!counts(i)) continue;
    const Motion motion = motion_of(i);
    if (!is_held(i, motion)) continue;
    double *const s = &sums[SUMS * static_cast<std::size_t>(clusters_.of(i))];
    s[SQUARES] += motion.speed * motion.speed;
    s[HELD_NUMBER] += 1.0;
    double &fastest = maxima[MAXIMA * static_cast<std::size_t>(clusters_.of(i)) + FASTEST];
    if (motion.speed > 0.0) fastest = std::max(fastest, motion.speed / unit(i, motion));
  }
  for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
    const int i = problem.contacts.first[c], j = problem.contacts.second[c];
    const bool one = clusters_.is_mobile(i);
    if (one && clusters_.is_mobile(j)) continue;
    const int k = clusters_.of(one ? i : j);
    const ClusterMotion &cluster = motions_[k];
    if (!(cluster.speed > 0.0)) continue;
    const double *const x = atom->x[one ? i : j];
    const double arm[3] = {x[0] - cluster.centre[0], x[1] - cluster.centre[1],
                           x[2] - cluster.centre[2]};
    double moved[3];
    cross(cluster.angular_velocity.data(), arm, moved);
    for (int d = 0; d < 3; ++d) moved[d] += cluster.velocity[d];
    const double along = dot(&problem.contacts.normal[3 * c], moved);
    sums[SUMS * static_cast<std::size_t>(k) + RESISTED] +=
        std::abs(problem.contacts.impulse[c]) * along * along;
  }
  clusters_.over_ranks(SUMS, sums, MAXIMA, maxima);
  for (std::size_t k = 0; k < motions_.size(); ++k) {
    const double *const s = &sums[SUMS * k];
    ClusterMotion &cluster = motions_[k];
    if (cluster.speed > 0.0)
      cluster.resisted = s[RESISTED] / (cluster.mass * cluster.speed * cluster.speed);
    if (s[HELD_NUMBER] > 0.0) cluster.held_speed = std::sqrt(s[SQUARES] / s[HELD_NUMBER]);
    cluster.fastest = maxima[MAXIMA * k + FASTEST];
  }
}

// Measures how fast held particles move towards, or away from, others that they touch with a force.
void ClusterMotions::measure_slip(double quiet_steps)
{
  double any = 0.0;
  for (const ClusterMotion &cluster : motions_)
    if (cluster.quiet_steps >= quiet_steps) any = 1.0;
  ranks_.reduce(nullptr, 0, &any, 1);
  if (any == 0.0) return;
  std::vector<double> units(step_.problem.particles, 0.0);
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!counts(i)) continue;
    const Motion motion = motion_of(i);
    if (is_held(i, motion)) units[i] = unit(i, motion);
  }
  ranks_.share_with_ghosts(units.data(), 1);
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  enum { SQUARES, NUMBER, SUMS };
  std::vector<double> sums(SUMS * clusters_.size(), 0.0), most(clusters_.size(), 0.0);
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const int i = contacts.first[c], j = contacts.second[c];
    if (contacts.impulse[c] == 0.0 || !clusters_.is_mobile(i) || !clusters_.is_mobile(j)) continue;
    const double one = units[i], other = units[j];
    if ((one > 0.0) == (other > 0.0)) continue;
    const int held = one > 0.0 ? i : j;
    const double speed = std::abs(dot(&contacts.normal[3 * c], own_velocity(held).data()));
    const auto k = static_cast<std::size_t>(clusters_.of(held));
    sums[SUMS * k + SQUARES] += speed * speed;
    sums[SUMS * k + NUMBER] += 1.0;
    most[k] = std::max(most[k], speed / std::max(one, other));
  }
  clusters_.over_ranks(SUMS, sums, 1, most);
  for (std::size_t k = 0; k < motions_.size(); ++k) {
    const double *const s = &sums[SUMS * k];
    motions_[k].slip = s[NUMBER] > 0.0 ? std::sqrt(s[SQUARES] / s[NUMBER]) : 0.0;
    motions_[k].most_slip = most[k];
  }
}
