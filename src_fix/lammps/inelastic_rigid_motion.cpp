#include "inelastic_rigid_motion.h"

#include "inelastic_atom_state.h"
#include "inelastic_ghost_exchange.h"
#include "inelastic_rotation.h"

#include "atom.h"
#include "update.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::cross;
using inelastic::dot;
using inelastic::multiply;
using inelastic::norm;

RigidMotion::RigidMotion(LAMMPS *lmp, Step &step, GhostExchange &ranks, AtomState &state) :
    Pointers(lmp), step_(step), ranks_(ranks), state_(state), members_(lmp, step, ranks),
    inertias_(lmp, step.settings.inertia)
{
}

std::string RigidMotion::find()
{
  const std::string message = members_.find();
  bodies_.resize(step_.problem.bodies.size());
  if (members_.is_first_of_run()) {
    measure_inertia();
    members_.check_reach();
    members_.begin_steps();
  }
  return message;
}

std::string RigidMotion::measure()
{
  measure_inertia();
  return inertias_.disagreement(step_.problem, step_.settings.rigid_fix);
}

/* ----------------------------------------------------------------------
   momenta
------------------------------------------------------------------------- */

void RigidMotion::predict()
{
  measure_inertia();
  predict_bodies(step_.impulse_per_force, step_.problem.predicted_velocity);
  predicted_ = step_.problem.predicted_velocity;
  pushing_ = stopping_ = false;
}

void RigidMotion::find_velocity_before(std::vector<double> &velocity)
{
  measure_inertia();
  predict_bodies(0.0, velocity);
}

// Sets the velocities of members (3 per particle) after forces have acted for a time, in units that
// turn a force into a momentum.
void RigidMotion::predict_bodies(double kick, std::vector<double> &velocity)
{
  gather_momenta(kick);
  for (std::size_t b = 0; b < bodies_.size(); ++b) predict_body(b, velocity);
}

// Tells whether the body of an owned member carries along what its last step in this run has left.
bool RigidMotion::carries(int i) const
{ return step_.continues && state_.momenta()[i].continues; }

// Sets each member's part of its body's momenta, ghosts included.
void RigidMotion::gather_momenta(double kick)
{
  const std::size_t size = 3 * static_cast<std::size_t>(step_.problem.particles);
  linear_.assign(size, 0.0);
  change_.assign(size, 0.0);
  carried_part_.assign(size, 0.0);
  for (int i = 0; i < atom->nlocal; ++i) {
    const int b = step_.problem.bodies.body[i];
    if (b < 0) continue;
    const bool carried = carries(i);
    const Carried &of_body = state_.momenta()[i];
    const Push &push = carried ? of_body.next : of_body.included;
    const double m = mass_of(atom, i);
    for (int d = 0; d < 3; ++d) {
      const double forced = kick * atom->f[i][d];
      linear_[3 * i + d] = m * (atom->v[i][d] - push.velocity[d]) + forced;
      // The velocities of point masses on a line determine L: what they differ from the expected
      // ones corrects the L that is carried along. With the round-off of short arms that L would
      // otherwise belong to another I than theirs, which is unstable.
      change_[3 * i + d] = forced;
      if (!carried)
        change_[3 * i + d] += m * atom->v[i][d];
      else if (inertias_[b].collinear && inertias_.kind() == Inertia::POINT)
        change_[3 * i + d] += m * (atom->v[i][d] - state_.expected_velocity(i)[d]);
    }
    take_carried(i);
  }
  ranks_.share_with_ghosts(linear_.data(), 3);
  ranks_.share_with_ghosts(change_.data(), 3);
  ranks_.share_with_ghosts(carried_part_.data(), 3);
}

// Sets the part of a body's angular momentum that does not act at its members' arms: the first
// member holds it for all, and solid spheres each hold their own at the start of a run.
void RigidMotion::take_carried(int i)
{
  const inelastic::RigidBodies &bodies = step_.problem.bodies;
  const int b = bodies.body[i];
  const bool carried = carries(i);
  double *const part = &carried_part_[3 * i];
  if (bodies.place[i] == bodies.start[b]) {
    const BodyInertia &inertia = inertias_[b];
    const Carried &of_body = state_.momenta()[i];
    const Push &push = carried ? of_body.next : of_body.included;
    // Forces on the spheres can take away no more of the push than `removed`.
    double pushed[3], slow[3], removed[3];
    for (int d = 0; d < 3; ++d)
      pushed[d] = push.angular_momentum[d] + (carried ? of_body.left_over[d] : 0.0);
    multiply(inertia.point_inverse, pushed, slow);
    multiply(inertia.point_inertia, slow, removed);
    for (int d = 0; d < 3; ++d)
      part[d] = (carried ? of_body.angular_momentum[d] : 0.0) - removed[d];
  }
  if (!carried && inertias_.kind() == Inertia::SOLID)
    for (int d = 0; d < 3; ++d)
      part[d] +=
          SPHERE_MOMENT * mass_of(atom, i) * atom->radius[i] * atom->radius[i] * atom->omega[i][d];
}

void RigidMotion::predict_body(std::size_t b, std::vector<double> &velocity)
{
  const inelastic::RigidBodies &bodies = step_.problem.bodies;
  Body &body = bodies_[b];
  double momentum[3] = {};
  std::fill_n(body.angular_momentum, 3, 0.0);
  const int begin = bodies.start[b], end = bodies.start[b + 1];
  for (int k = begin; k < begin + bodies.originals[b]; ++k) {
    const std::size_t i = 3 * static_cast<std::size_t>(bodies.member[k]);
    double moment[3];
    cross(&bodies.arm[3 * k], &change_[i], moment);
    for (int d = 0; d < 3; ++d) {
      momentum[d] += linear_[i + d];
      body.angular_momentum[d] += moment[d] + carried_part_[i + d];
    }
  }
  for (int d = 0; d < 3; ++d) body.velocity[d] = momentum[d] / inertias_[b].mass;
  double spin[3];
  multiply(&bodies.inverse_inertia[6 * b], body.angular_momentum, spin);
  for (int k = begin; k < end; ++k) {
    double around[3];
    cross(spin, &bodies.arm[3 * k], around);
    for (int d = 0; d < 3; ++d)
      velocity[3 * static_cast<std::size_t>(bodies.member[k]) + d] = body.velocity[d] + around[d];
  }
}

/* ----------------------------------------------------------------------
   the step
------------------------------------------------------------------------- */

// The momenta that a body has beyond a reference, both given by the velocities of its spheres. They
// do not show a spin about a line through all of them, which contacts cannot change.
Push RigidMotion::difference(const inelastic::RigidBodies &bodies, std::size_t b,
                             const double *velocity, const double *reference) const
{
  const BodyInertia &inertia = inertias_[b];
  double momentum[3] = {}, moment[3] = {};
  const int begin = bodies.start[b];
  for (int k = begin; k < begin + bodies.originals[b]; ++k) {
    const std::size_t i = 3 * static_cast<std::size_t>(bodies.member[k]);
    const double m = mass_of(atom, bodies.member[k]);
    double faster[3], turning[3];
    for (int d = 0; d < 3; ++d) faster[d] = m * (velocity[i + d] - reference[i + d]);
    cross(&bodies.arm[3 * k], faster, turning);
    for (int d = 0; d < 3; ++d) {
      momentum[d] += faster[d];
      moment[d] += turning[d];
    }
  }
  Push gained;
  double spin[3];
  multiply(inertia.point_inverse, moment, spin);
  multiply(inertia.inertia, spin, gained.angular_momentum.data());
  for (int d = 0; d < 3; ++d) gained.velocity[d] = momentum[d] / inertia.mass;
  return gained;
}

void RigidMotion::turn(const inelastic::ContactProblem &problem,
                       const std::vector<double> &velocity, std::vector<double> &motion)
{
  const inelastic::RigidBodies &bodies = problem.bodies;
  const double h = problem.timestep;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    Body &body = bodies_[b];
    const Push gained = difference(bodies, b, velocity.data(), predicted_.data());
    for (int d = 0; d < 3; ++d) {
      body.velocity_end[d] = body.velocity[d] + gained.velocity[d];
      body.angular_momentum_end[d] = body.angular_momentum[d] + gained.angular_momentum[d];
    }
    const double *const inverse = &bodies.inverse_inertia[6 * b];
    const double none[4] = {1.0, 0.0, 0.0, 0.0};
    double spin[3], full[4], half[4], two_halves[4];
    multiply(inverse, body.angular_momentum_end, spin);
    turn_by(none, 0.5 * h, spin, full);
    turn_by(none, 0.25 * h, spin, half);
    angular_velocity_turned(half, inverse, body.angular_momentum_end, body.angular_velocity_end);
    turn_by(half, 0.25 * h, body.angular_velocity_end, two_halves);
    for (int k = 0; k < 4; ++k) body.turned[k] = 2.0 * two_halves[k] - full[k];
    normalise(body.turned);
    for (int k = bodies.start[b]; k < bodies.start[b + 1]; ++k) {
      double displaced[3];
      displacement(body.turned, 1.0, &bodies.arm[3 * k], displaced);
      for (int d = 0; d < 3; ++d)
        motion[3 * static_cast<std::size_t>(bodies.member[k]) + d] =
            body.velocity_end[d] + displaced[d] / h;
    }
  }
}

double RigidMotion::angle_turned(const inelastic::ContactProblem &problem, int i) const
{
  const int b = problem.bodies.body[i];
  return b < 0 ? 0.0 : problem.timestep * norm(bodies_[b].angular_velocity_end);
}

double RigidMotion::angle_predicted(const inelastic::ContactProblem &problem, int i) const
{
  const int b = problem.bodies.body[i];
  if (b < 0) return 0.0;
  double spin[3];
  multiply(&problem.bodies.inverse_inertia[6 * b], bodies_[b].angular_momentum, spin);
  return problem.timestep * norm(spin);
}

double RigidMotion::energy_of_turning(const inelastic::ContactProblem &problem, int i) const
{
  const int b = problem.bodies.body[i];
  if (b < 0) return 0.0;
  const Body &body = bodies_[b];
  const double *const momentum = body.angular_momentum_end;
  const double *const inverse = &problem.bodies.inverse_inertia[6 * b];
  double before[3], after[3];
  multiply(inverse, momentum, before);
  angular_velocity_turned(body.turned, inverse, momentum, after);
  const double energy = dot(momentum, before);
  return energy > 0.0 ? dot(momentum, after) / energy - 1.0 : 0.0;
}

// The velocity of a member after the step of the last turn().
void RigidMotion::velocity_after(int i, double *velocity) const
{
  const inelastic::RigidBodies &bodies = step_.problem.bodies;
  const Body &body = bodies_[bodies.body[i]];
  double arm[3];
  rotate(body.turned, 1.0, &bodies.arm[3 * bodies.place[i]], arm);
  cross(body.angular_velocity_end, arm, velocity);
  for (int d = 0; d < 3; ++d) velocity[d] += body.velocity_end[d];
}

void RigidMotion::note_push(const inelastic::ContactProblem &problem,
                            const std::vector<double> &velocity)
{
  pushing_ = true;
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    bodies_[b].push =
        difference(problem.bodies, b, velocity.data(), problem.predicted_velocity.data());
}

void RigidMotion::note_stop(const inelastic::ContactProblem &problem,
                            const std::vector<double> &by_contacts,
                            const std::vector<double> &wanted)
{
  stopping_ = true;
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    bodies_[b].stop = difference(problem.bodies, b, wanted.data(), by_contacts.data());
}

void RigidMotion::apply(const double *contact_force)
{
  const double h = step_.problem.timestep;
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!step_.in_group(atom, i) || !step_.is_member(i)) continue;
    for (int d = 0; d < 3; ++d) {
      atom->f[i][d] += contact_force[3 * i + d];
      state_.expected_position(i)[d] = atom->x[i][d] + h * step_.motion_of_bodies[3 * i + d];
    }
    keep(i, replace_push(i, atom->f[i]), contact_force);
    velocity_after(i, state_.expected_velocity(i));
  }
}

// Adds to the force on an owned member what replaces the last step's push by this one's, which it
// returns, and what stops its body.
Push RigidMotion::replace_push(int i, double *force)
{
  const inelastic::RigidBodies &bodies = step_.problem.bodies;
  const int b = bodies.body[i];
  const BodyInertia &inertia = inertias_[b];
  Carried &of_body = state_.momenta()[i];
  const bool whole = step_.kick == Kick::WHOLE;
  Push push = pushing_ ? bodies_[b].push : Push{};
  // In the last step of a run no push may stay in the velocities. Whole-step velocities hold the
  // mean of two pushes: this makes it vanish.
  if (whole && update->ntimestep == update->laststep)
    for (int d = 0; d < 3; ++d) {
      push.velocity[d] = -of_body.next.velocity[d];
      push.angular_momentum[d] = -of_body.next.angular_momentum[d];
    }
  const Push &before = whole ? of_body.next : of_body.included;
  const Push stop = stopping_ ? bodies_[b].stop : Push{};
  // Forces m (a + alpha x r) with the right sum and the right moment.
  double change[3], spin[3], around[3];
  for (int d = 0; d < 3; ++d)
    change[d] = push.angular_momentum[d] - before.angular_momentum[d] + stop.angular_momentum[d] -
        (whole ? of_body.left_over[d] : 0.0);
  multiply(inertia.point_inverse, change, spin);
  of_body.left_over = {};
  if (inertia.collinear) {
    double made[3];
    multiply(inertia.point_inertia, spin, made);
    for (int d = 0; d < 3; ++d) of_body.left_over[d] = made[d] - change[d];
  }
  cross(spin, &bodies.arm[3 * bodies.place[i]], around);
  for (int d = 0; d < 3; ++d)
    force[d] += mass_of(atom, i) *
        (push.velocity[d] - before.velocity[d] + stop.velocity[d] + around[d]) /
        step_.impulse_per_force;
  return push;
}

// Keeps the push and the angular momentum after the last turn(). The contact forces only tell how
// large the moments were.
void RigidMotion::keep(int i, const Push &push, const double *contact_force)
{
  const inelastic::RigidBodies &bodies = step_.problem.bodies;
  const int b = bodies.body[i];
  const Body &body = bodies_[b];
  Carried &of_body = state_.momenta()[i];
  const bool whole = step_.kick == Kick::WHOLE;
  if (whole)
    for (int d = 0; d < 3; ++d) {
      of_body.included.velocity[d] = 0.5 * (of_body.next.velocity[d] + push.velocity[d]);
      of_body.included.angular_momentum[d] =
          0.5 * (of_body.next.angular_momentum[d] + push.angular_momentum[d]);
    }
  of_body.next = push;
  double moments = 0.0;    // their size; they may cancel
  for (int k = bodies.start[b]; k < bodies.start[b] + bodies.originals[b]; ++k) {
    const double *const r = &bodies.arm[3 * k];
    const double *const f = contact_force + 3 * static_cast<std::size_t>(bodies.member[k]);
    moments += std::sqrt(dot(r, r) * dot(f, f));
  }
  const double *const inverse = &bodies.inverse_inertia[6 * b];
  const double angle = step_.problem.timestep *
      (std::sqrt(dot(body.angular_velocity_end, body.angular_velocity_end)) +
       step_.impulse_per_force * moments * (inverse[0] + inverse[1] + inverse[2]));
  // The largest angle of all steps counts: the angular momentum that is carried along keeps the
  // round-off of earlier moments.
  of_body.angle = std::max(angle, carries(i) ? of_body.angle : angle_of_first_momentum(b));
  std::copy_n(body.angular_momentum_end, 3, of_body.angular_momentum.begin());
  of_body.continues = true;
}

// Returns the angle whose square magnifies the round-off of positions as much as the start of a run
// does. LAMMPS then takes the angular momentum of a body of mass M from its spheres' velocities,
// which contain its velocity v, about a centre of mass with the round-off dx of coordinates: an
// error of about M |dx| |v|.
double RigidMotion::angle_of_first_momentum(int b) const
{
  // Ten times the machine epsilon, of the part of coordinates that is allowed for round-off.
  constexpr double ROUNDED = 2.2e-3;
  const inelastic::RigidBodies &bodies = step_.problem.bodies;
  double longest = 0.0;
  for (int k = bodies.start[b]; k < bodies.start[b] + bodies.originals[b]; ++k)
    longest = std::max(longest, norm(&bodies.arm[3 * k]));
  const double *const inverse = &bodies.inverse_inertia[6 * b];
  const double turned = step_.problem.timestep * inertias_[b].mass * norm(bodies_[b].velocity_end) *
      (inverse[0] + inverse[1] + inverse[2]) * longest;
  return std::sqrt(ROUNDED * turned);
}
