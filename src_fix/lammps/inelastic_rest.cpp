#include "inelastic_rest.h"

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
// A cluster is quiet if the root mean square of its held particles' speeds is at most this part of
// the mean speed that they would have without contacts, and its motion as a whole this part of what
// resists it.
constexpr double QUIET = 0.1;
// So many quiet steps come first: a force that nothing balances would show.
constexpr double PATIENCE = 8.0;
// For so many steps held particles are stopped and contacts are solved more accurately. In the last
// of these steps velocities show which forces do not balance.
constexpr double TRIAL = 4.0;
// The part of the accuracy to which contacts are solved then. The residuals of a bed, which is
// isostatic, make velocities of some fifty times their size.
constexpr double REFINED = 1.0 / 4.0;
// After a trial in which something held moved the next one comes so many quiet steps later.
constexpr double PAUSE = 50.0;
// A particle at rest is no faster than so many accuracies; a coarser accuracy counts as the one
// below.
constexpr double AT_REST = 5.0;
constexpr double COARSEST_ACCURACY = 1.0e-3;
// A cluster moves if it is faster than this part of what it would be without contacts, whatever
// resists it.
constexpr double ROUND_OFF = 1.0e-12;

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

Rest::Rest(LAMMPS *lmp, Step &step, GhostExchange &ranks, AtomState &state) :
    Pointers(lmp), step_(step), ranks_(ranks), state_(state), clusters_(lmp, step, ranks)
{
}

void Rest::compare_loads()
{
  step_.load_change.clear();
  if (!any_stopped_) return;
  const inelastic::ContactProblem &problem = step_.problem;
  step_.load_change.assign(3 * static_cast<std::size_t>(problem.particles), 0.0);
  for (int i = 0; i < atom->nlocal; ++i) {
    const double before = step_.impulse_per_force * state_.load_at_rest(i);
    if (before == 0.0) continue;
    const std::size_t first = 3 * static_cast<std::size_t>(i);
    step_.load_change[first] = norm(&problem.predicted_velocity[first]) / before;
  }
  ranks_.share_with_ghosts(step_.load_change.data());
}

bool Rest::look(const inelastic::ProjectionResult &result)
{
  // A step that is shortened, or pushes spheres apart, tells nothing of rest. Uzawa starts every
  // step from no forces at all: rest would save it nothing. Without atoms there are no bodies,
  // either.
  looks_ = step_.settings.rest && step_.settings.solver != "uzawa" && step_.largest_radius > 0.0 &&
      step_.problem.timestep == step_.regular_timestep && !step_.bad_start &&
      result.status == inelastic::Status::CONVERGED;
  if (!looks_) {
    forget();
    return false;
  }
  clusters_.find();
  look_again();
  inelastic::ContactSet &contacts = step_.problem.contacts;
  double any = 0.0;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const int one = clusters_.of(contacts.first[c]), other = clusters_.of(contacts.second[c]);
    const bool refines = (one != Clusters::NONE && needs_refinement(motions_[one])) ||
        (other != Clusters::NONE && needs_refinement(motions_[other]));
    contacts.refinement[c] = std::min(refines ? REFINED : 1.0, step_.contact_of(c).refinement());
    if (refines) any = 1.0;
  }
  ranks_.reduce(nullptr, 0, &any, 1);
  return any > 0.0;
}

void Rest::look_again()
{
  measure_resistance();
  measure_clusters();
  measure_clusters_by_motion();
}

bool Rest::needs_refinement(const ClusterMotion &cluster) const
{ return cluster.quiet_steps >= PATIENCE && is_quiet(cluster) && moves(cluster); }

void Rest::forget()
{
  for (int i = 0; i < atom->nlocal; ++i)
    state_.quiet_steps(i) = std::min(state_.quiet_steps(i), 0.0);
}

double Rest::limit() const
{ return AT_REST * std::min(step_.settings.accuracy, COARSEST_ACCURACY); }

// Tells whether this rank judges a particle.
bool Rest::counts(int i) const
{ return step_.in_group(atom, i) && clusters_.of(i) != Clusters::NONE; }

// Adds up what contacts resist of the motion of each particle, and counts the gaps that they have
// still to close, ghosts included.
void Rest::measure_resistance()
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  resistance_.assign(3 * static_cast<std::size_t>(step_.problem.particles), 0.0);
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const double impulse = std::abs(contacts.impulse[c]);
    if (impulse == 0.0) continue;
    const bool open = step_.contact_of(c).gap_now > step_.settings.tolerance;
    for (const int i : {contacts.first[c], contacts.second[c]}) {
      if (!clusters_.is_mobile(i)) continue;
      const double along = dot(&contacts.normal[3 * c], velocity(i));
      double *const of_particle = &resistance_[3 * static_cast<std::size_t>(i)];
      of_particle[0] += impulse * along * along;
      if (open) of_particle[1] += 1.0;
    }
  }
  ranks_.sum_over_ghosts(resistance_.data());
}

Rest::Motion Rest::motion_of(int i) const
{
  const inelastic::ContactProblem &problem = step_.problem;
  Motion motion;
  double mass = 0.0, square = 0.0, taken = 0.0, resisted = 0.0;
  const auto add = [&](int k) {
    const double m = mass_of(atom, k);
    const double *const v = velocity(k);
    const double *const predicted = &problem.predicted_velocity[3 * static_cast<std::size_t>(k)];
    const double change[3] = {predicted[0] - v[0], predicted[1] - v[1], predicted[2] - v[2]};
    mass += m;
    square += m * dot(v, v);
    taken += m * dot(change, change);
    resisted += resistance_[3 * static_cast<std::size_t>(k)];
    if (resistance_[3 * static_cast<std::size_t>(k) + 1] > 0.0) motion.closes = true;
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

double Rest::unit(int i, const Motion &motion) const
{ return std::min(motion.taken, motions_[clusters_.of(i)].without_contacts); }

// Tells whether a particle is held, as one without motion is. One that still has a gap to close is
// not: its force would stay across the gap.
bool Rest::is_held(int i, const Motion &motion) const
{ return !motion.closes && (motion.speed == 0.0 || motion.resisted >= HELD * unit(i, motion)); }

void Rest::measure_clusters()
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
    double *const m = &maxima[MAXIMA * static_cast<std::size_t>(clusters_.of(one ? i : j))];
    const bool frozen_moves =
        !step_.contact_of(c).is_with_wall() && norm(velocity(one ? j : i)) > 0.0;
    if (problem.contacts.impulse[c] != 0.0) m[SUPPORTED] = 1.0;
    if (step_.rows[c].wall_motion != 0.0 || frozen_moves) m[DRIVEN] = 1.0;
  }
  clusters_.over_ranks(SUMS, sums, MAXIMA, maxima);
  motions_.assign(clusters_.size(), ClusterMotion{});
  for (std::size_t k = 0; k < motions_.size(); ++k)
    motions_[k] = motion_of_cluster(&sums[SUMS * k], &maxima[MAXIMA * k]);
}

// Adds an owned particle to the sums of its cluster.
void Rest::add_particle(int i, double *s) const
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
  s[SPEEDS] += norm(&step_.problem.predicted_velocity[3 * static_cast<std::size_t>(i)]);
  s[STEPS] += state_.quiet_steps(i);
  s[NUMBER] += 1.0;
}

// The motion of a cluster from its sums and maxima over all ranks.
Rest::ClusterMotion Rest::motion_of_cluster(const double *s, const double *m) const
{
  ClusterMotion cluster;
  if (!(s[MASS] > 0.0)) return cluster;
  cluster.mass = s[MASS];
  cluster.without_contacts = s[SPEEDS] / s[NUMBER];
  // The count is that of most of its particles: single ones that join the cluster, and have not
  // been quiet, do not begin it anew.
  cluster.quiet_steps = std::round(s[STEPS] / s[NUMBER]);
  cluster.supported = m[SUPPORTED] > 0.0;
  cluster.driven = m[DRIVEN] > 0.0;
  for (int d = 0; d < 3; ++d) {
    cluster.centre[d] = s[CENTRE + d] / s[MASS];
    cluster.velocity[d] = s[MOMENTUM + d] / s[MASS];
  }
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
void Rest::measure_clusters_by_motion()
{
  const inelastic::ContactProblem &problem = step_.problem;
  enum { RESISTED, SQUARES, HELD_NUMBER, SUMS };
  enum { MOVES, MAXIMA };
  std::vector<double> sums(SUMS * clusters_.size(), 0.0);
  std::vector<double> maxima(MAXIMA * clusters_.size(), 0.0);
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!counts(i)) continue;
    const Motion motion = motion_of(i);
    if (!is_held(i, motion)) continue;
    double *const s = &sums[SUMS * static_cast<std::size_t>(clusters_.of(i))];
    s[SQUARES] += motion.speed * motion.speed;
    s[HELD_NUMBER] += 1.0;
    if (motion.speed > limit() * unit(i, motion)) maxima[MAXIMA * clusters_.of(i) + MOVES] = 1.0;
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
    cluster.held_moves = maxima[MAXIMA * k + MOVES] > 0.0;
  }
}

bool Rest::is_quiet(const ClusterMotion &cluster) const
{
  const double round_off = ROUND_OFF * cluster.without_contacts;
  return cluster.supported && !cluster.driven &&
      cluster.held_speed <= QUIET * cluster.without_contacts &&
      cluster.speed <= std::max(QUIET * cluster.resisted, round_off);
}

// Tells whether something in a quiet cluster moves that contacts are to hold.
bool Rest::moves(const ClusterMotion &cluster) const
{
  const double round_off = ROUND_OFF * cluster.without_contacts;
  return cluster.held_moves || cluster.speed > std::max(limit() * cluster.resisted, round_off);
}

bool Rest::decide(std::vector<char> &stopped)
{
  step_.at_rest = any_stopped_ = false;
  if (!looks_) return false;
  stopped.assign(step_.problem.particles, 0);
  double maxima[2] = {0.0, 0.0};    // whether any is stopped, and whether any moves
  for (int i = 0; i < atom->nlocal; ++i) {
    state_.load_at_rest(i) = 0.0;
    if (!counts(i)) continue;
    const ClusterMotion &cluster = motions_[clusters_.of(i)];
    const double steps = cluster.quiet_steps;
    const bool in_trial = steps >= PATIENCE && steps < PATIENCE + TRIAL;
    const bool at_rest = steps >= PATIENCE + TRIAL;
    const Motion motion = motion_of(i);
    const bool goes_on = is_quiet(cluster) && (in_trial || !moves(cluster));
    // In the half kick of a run no trial goes on: velocities may have been given.
    const bool stops =
        (at_rest || (in_trial && step_.kick == Kick::WHOLE)) && goes_on && is_held(i, motion);
    if (stops) stopped[i] = 1;
    if (stops) maxima[0] = 1.0;
    const double *const predicted =
        &step_.problem.predicted_velocity[3 * static_cast<std::size_t>(i)];
    if (stops) state_.load_at_rest(i) = norm(predicted) / step_.impulse_per_force;
    if (in_trial || (!stops && motion.speed > limit() * cluster.without_contacts)) maxima[1] = 1.0;
    // No time passes in the half kick with which a run starts.
    if (step_.kick == Kick::HALF) continue;
    double &own = state_.quiet_steps(i);
    own = is_quiet(cluster) ? std::min(steps, PATIENCE + TRIAL) + 1.0 : std::min(steps, 0.0);
    if (at_rest && !goes_on) own = std::min(own, 0.0);
    // The forces of the last step of a trial decide.
    if (own == PATIENCE + TRIAL && moves(cluster)) own = -PAUSE;
  }
  ranks_.reduce(nullptr, 0, maxima, 2);
  any_stopped_ = maxima[0] > 0.0;
  step_.at_rest = any_stopped_ && maxima[1] == 0.0;
  return any_stopped_;
}
