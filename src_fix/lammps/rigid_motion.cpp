#include "rigid_motion.h"

#include "atom.h"
#include "comm.h"
#include "compute.h"
#include "domain.h"
#include "error.h"
#include "fix.h"
#include "modify.h"
#include "neighbor.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace LAMMPS_NS;
using inelastic::multiply;

namespace {

constexpr double SPHERE_MOMENT = 0.4;    // of a solid ball, in m R^2
constexpr double COLLINEAR = 1.0e-7;     // smallest moment over the others; LAMMPS drops it there
// Of the largest coordinate, times the machine epsilon: point masses nearer to one another than this
// have an inertia, and turn, as the round-off of their positions will have it.
constexpr double RESOLVED_ARM = 1.0e7;
constexpr double AGREEMENT = 1.0e-6;    // relative, of masses and moments computed in two ways

// Per owned atom: its body, -1 = in none.
const int *bodies_of_atoms(Fix *fix)
{
  int dimension;
  return static_cast<const int *>(fix->extract("body", dimension));
}

void cross(const double *a, const double *b, double *c)
{
  c[0] = a[1] * b[2] - a[2] * b[1];
  c[1] = a[2] * b[0] - a[0] * b[2];
  c[2] = a[0] * b[1] - a[1] * b[0];
}

double dot(const double *a, const double *b)
{ return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

double norm(const double *a)
{ return std::sqrt(dot(a, a)); }

// Symmetric matrices are xx yy zz xy xz yz.
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

// Of an inertia; its pseudo-inverse where the masses lie on a line (two equal moments t and a third
// of zero: A A = t A) or in one point; then the result is true.
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

// Quaternions are w x y z.
void normalise(double *q)
{
  const double scale = 1.0 / std::sqrt(q[0] * q[0] + dot(q + 1, q + 1));
  for (int k = 0; k < 4; ++k) q[k] *= scale;
}

// (1 + s w) q, normalised.
void turn_by(const double *q, double s, const double *w, double *turned)
{
  double across[3];
  cross(w, q + 1, across);
  turned[0] = q[0] - s * dot(w, q + 1);
  for (int d = 0; d < 3; ++d) turned[1 + d] = q[1 + d] + s * (q[0] * w[d] + across[d]);
  normalise(turned);
}

// By how much a rotation displaces x; exact to round-off for small rotations too.
void displacement(const double *q, double sign, const double *x, double *displaced)
{
  const double axis[3] = {sign * q[1], sign * q[2], sign * q[3]};
  double once[3], twice[3];
  cross(axis, x, once);
  cross(axis, once, twice);
  for (int d = 0; d < 3; ++d) displaced[d] = 2.0 * (q[0] * once[d] + twice[d]);
}

void rotate(const double *q, double sign, const double *x, double *rotated)
{
  double displaced[3];
  displacement(q, sign, x, displaced);
  for (int d = 0; d < 3; ++d) rotated[d] = x[d] + displaced[d];
}

// Angular velocity for an angular momentum after a turn from the orientation that the inertia is of.
void angular_velocity_turned(const double *q, const double *inverse_inertia, const double *momentum,
                             double *angular_velocity)
{
  double before[3], slow[3];
  rotate(q, -1.0, momentum, before);
  multiply(inverse_inertia, before, slow);
  rotate(q, 1.0, slow, angular_velocity);
}

}    // namespace

/* ---------------------------------------------------------------------- */

RigidMotion::RigidMotion(LAMMPS *lmp, std::string fix_id, Inertia inertia) :
    Pointers(lmp), fix_id_(std::move(fix_id)), inertia_(inertia), fix_(nullptr), pushing_(false)
{
}

void RigidMotion::init()
{
  fix_ = modify->get_fix_by_id(fix_id_);
  if (!fix_) error->all(FLERR, "Fix inelastic rigid: there is no fix {}", fix_id_);
  if (!utils::strmatch(fix_->style, "^rigid/small$") &&
      !utils::strmatch(fix_->style, "^rigid/small/omp$"))
    error->all(FLERR, "Fix inelastic rigid: fix {} is of style {}, and must be rigid/small",
               fix_id_, fix_->style);
}

double RigidMotion::mass(int i) const
{ return atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]]; }

/* ----------------------------------------------------------------------
   who belongs to which body
------------------------------------------------------------------------- */

void RigidMotion::count_spheres(int groupbit, int frozen_bit)
{
  const int *const body = bodies_of_atoms(fix_);
  const int *const mask = atom->mask;
  std::vector<MoleculeSizes::Molecule> mine;
  for (int i = 0; i < atom->nlocal; ++i)
    if (body[i] >= 0)
      mine.push_back({atom->molecule[i], 1, !(mask[i] & groupbit), (mask[i] & frozen_bit) != 0});
  molecules_.count(std::move(mine), world);
  for (const MoleculeSizes::Molecule &molecule : molecules_.all()) {
    if (molecule.id < 0)
      error->all(FLERR,
                 "Fix inelastic rigid: molecule ID {} of a body must not be negative: use "
                 "reset_atoms mol",
                 molecule.id);
    if (molecule.outside > 0 && molecule.outside < molecule.spheres)
      error->all(FLERR,
                 "Fix inelastic rigid: the body of molecule {} is partly outside the fix's group: "
                 "put all its spheres in, or none",
                 molecule.id);
    if (molecule.frozen > 0)
      error->all(FLERR,
                 "Fix inelastic rigid: a sphere of molecule {} is frozen: frozen spheres cannot "
                 "belong to a body",
                 molecule.id);
  }
  last_sphere_.assign(molecules_.all().size(), NONE);

  // Free spheres have no molecule of their own: LAMMPS takes all of them for one.
  int unseen = 0, any_unseen = 0;
  for (int k = 0; k < neighbor->nex_mol; ++k)
    for (int i = 0; i < atom->nlocal; ++i)
      if (body[i] < 0 && neighbor->ex_mol_intra[k] && (mask[i] & groupbit) &&
          (mask[i] & neighbor->ex_mol_bit[k]))
        unseen = 1;
  MPI_Allreduce(&unseen, &any_unseen, 1, MPI_INT, MPI_MAX, world);
  if (any_unseen)
    error->all(
        FLERR,
        "Fix inelastic rigid: neigh_modify exclude molecule/intra hides free spheres from one "
        "another, because they share a molecule ID: give it a group of bodies only");
}

std::string RigidMotion::find_bodies(inelastic::ContactProblem &problem, inelastic::Host &host,
                                     int groupbit, int frozen_bit, bool first_of_run)
{
  if (!bodies_of_atoms(fix_))
    error->all(FLERR, "Fix inelastic rigid: fix {} has not set up its bodies", fix_id_);
  if (first_of_run) count_spheres(groupbit, frozen_bit);

  const int nlocal = atom->nlocal;
  const int nall = nlocal + atom->nghost;
  const int *const body = bodies_of_atoms(fix_);
  linear_.assign(3 * static_cast<std::size_t>(nall), 0.0);
  for (int i = 0; i < nlocal; ++i)
    linear_[3 * i] = body[i] >= 0 && (atom->mask[i] & groupbit) ? 1.0 : 0.0;
  host.share_with_copies(linear_.data());

  // The spheres of a body as a chain, and bodies in the order of their first ones: what is near in
  // space is near in memory.
  const tagint *const molecule = atom->molecule;
  const tagint *const tag = atom->tag;
  std::vector<int> first_spheres, next(nall, NONE);
  incomplete_.assign(nall, 0);
  std::string message;
  for (int i = 0; i < nall; ++i) {
    if (!(linear_[3 * i] > 0.0)) continue;
    const int place = molecules_.place(molecule[i]);
    if (place == MoleculeSizes::NONE) {
      incomplete_[i] = 1;
      message = fmt::format("molecule {} had no body when the run began: create no bodies during a "
                            "run, and change no molecule ID",
                            molecule[i]);
      continue;
    }
    int &before = last_sphere_[place];
    if (before == NONE)
      first_spheres.push_back(i);
    else
      next[before] = i;
    before = i;
  }

  problem.bodies.clear(nall);
  copy_of_.clear();
  std::vector<int> spheres, originals, copies, copy_of;
  std::vector<double> nothing;
  for (const int first_sphere : first_spheres) {
    const tagint id = molecule[first_sphere];
    const int place = molecules_.place(id);
    last_sphere_[place] = NONE;
    spheres.clear();
    for (int i = first_sphere; i != NONE; i = next[i]) spheres.push_back(i);
    // The owned sphere before its copies.
    std::sort(spheres.begin(), spheres.end(), [&](int a, int b) {
      return tag[a] != tag[b] ? tag[a] < tag[b] : a < b;
    });
    originals.clear();
    copies.clear();
    copy_of.clear();
    for (const int i : spheres) {
      if (originals.empty() || tag[originals.back()] != tag[i]) {
        originals.push_back(i);
      } else {
        copies.push_back(i);
        copy_of.push_back(static_cast<int>(originals.size()) - 1);
      }
    }
    const int number = static_cast<int>(originals.size());
    const auto all = static_cast<int>(molecules_.all()[place].spheres);
    if (number != all) {
      for (const int i : spheres) incomplete_[i] = 1;
      for (const int i : originals)
        if (i < nlocal)
          message = fmt::format("the body of molecule {} has {} spheres, of which a rank sees {}: "
                                "raise comm_modify cutoff, and create no bodies during a run",
                                id, all, number);
      continue;
    }
    for (int k = 0; k < number; ++k) copy_of_.push_back(k);
    copy_of_.insert(copy_of_.end(), copy_of.begin(), copy_of.end());
    originals.insert(originals.end(), copies.begin(), copies.end());
    nothing.assign(3 * originals.size() + 6, 0.0);
    problem.bodies.add(originals.data(), nothing.data(), static_cast<int>(originals.size()), number,
                       0.0, nothing.data());
  }
  bodies_.resize(problem.bodies.size());
  message = explained(message, host);
  if (!first_of_run) return message;
  measure(problem);
  double extent = 0.0;
  const std::vector<double> &arm = problem.bodies.arm;
  for (std::size_t k = 0; k < problem.bodies.member.size(); ++k)
    extent = std::max(extent, 2.0 * std::sqrt(dot(&arm[3 * k], &arm[3 * k])));
  host.reduce(nullptr, 0, &extent, 1);
  check_reach(extent);
  return message;
}

// A body may be seen in part because a sphere of it is not there any more. Collective.
std::string RigidMotion::explained(const std::string &message, inelastic::Host &host) const
{
  const int *const body = bodies_of_atoms(fix_);
  double sums[2] = {message.empty() ? 0.0 : 1.0, 0.0};
  for (int i = 0; i < atom->nlocal; ++i)
    if (body[i] >= 0) sums[1] += 1.0;
  host.reduce(sums, 2, nullptr, 0);
  double expected = 0.0;
  for (const MoleculeSizes::Molecule &molecule : molecules_.all())
    expected += static_cast<double>(molecule.spheres);
  if (message.empty() || sums[1] >= expected) return message;
  return fmt::format(
      "{:.0f} of the {:.0f} spheres of bodies are lost, because they left the box or were "
      "deleted: walls must keep bodies inside of the box, and whole bodies alone may be "
      "deleted, between runs",
      expected - sums[1], expected);
}

// A sphere of another rank that touches one of this rank's brings its whole body with it.
void RigidMotion::check_reach(double extent) const
{
  constexpr double ROUNDED_UP = 1.00001;    // six digits of it are enough
  const bool periodic = domain->xperiodic || domain->yperiodic || domain->zperiodic;
  if (comm->nprocs == 1 && !periodic) return;
  const double needed = neighbor->cutneighmax + extent;
  const double cutoff = std::max(comm->cutghostuser, neighbor->cutneighmax);
  if (cutoff < needed)
    error->all(FLERR,
               "Fix inelastic rigid: ranks and periodic images see {:.6g} far, which is too short "
               "for bodies of this size: set comm_modify cutoff to at least {:.6g}",
               cutoff, ROUNDED_UP * needed);
  const double period[3] = {domain->xperiodic ? domain->xprd : 2.0 * needed,
                            domain->yperiodic ? domain->yprd : 2.0 * needed,
                            domain->zperiodic ? domain->zprd : 2.0 * needed};
  for (const double length : period)
    if (length < 2.0 * needed)
      error->all(
          FLERR,
          "Fix inelastic rigid: the periodic box is {:.6g} wide and must be at least {:.6g}, "
          "so that no body can meet its own image",
          length, 2.0 * ROUNDED_UP * needed);
}

/* ----------------------------------------------------------------------
   inertia and momenta
------------------------------------------------------------------------- */

void RigidMotion::measure(inelastic::ContactProblem &problem)
{
  inelastic::RigidBodies &bodies = problem.bodies;
  const double *const *const x = atom->x;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const int begin = bodies.start[b], end = bodies.start[b + 1];
    const int last_original = begin + bodies.originals[b];
    double *const arm = bodies.arm.data();
    const double *const x0 = x[bodies.member[begin]];
    double total = 0.0, centre[3] = {0.0, 0.0, 0.0};
    for (int k = begin; k < last_original; ++k) {
      const int i = bodies.member[k];
      double *const r = arm + 3 * k;
      for (int d = 0; d < 3; ++d) r[d] = x[i][d] - x0[d];
      domain->minimum_image(FLERR, r);
      const double m = mass(i);
      total += m;
      for (int d = 0; d < 3; ++d) centre[d] += m * r[d];
    }
    Body &body = bodies_[b];
    body.mass = total;
    double *const point = body.point_inertia;
    std::fill_n(point, 6, 0.0);
    double balls = 0.0;
    for (int k = begin; k < last_original; ++k) {
      const int i = bodies.member[k];
      double *const r = arm + 3 * k;
      for (int d = 0; d < 3; ++d) r[d] -= centre[d] / total;
      const double m = mass(i), square = dot(r, r);
      for (int d = 0; d < 3; ++d) point[d] += m * (square - r[d] * r[d]);
      point[3] -= m * r[0] * r[1];
      point[4] -= m * r[0] * r[2];
      point[5] -= m * r[1] * r[2];
      balls += SPHERE_MOMENT * m * atom->radius[i] * atom->radius[i];
    }
    for (int k = last_original; k < end; ++k)
      std::copy_n(arm + 3 * (begin + copy_of_[k]), 3, arm + 3 * k);
    body.collinear = invert_inertia(point, body.point_inverse);
    std::copy_n(point, 6, body.inertia);
    if (inertia_ == Inertia::SOLID)
      for (int d = 0; d < 3; ++d) body.inertia[d] += balls;
    bodies.inverse_mass[b] = 1.0 / total;
    invert_inertia(body.inertia, &bodies.inverse_inertia[6 * b]);
  }
}

void RigidMotion::predict(inelastic::ContactProblem &problem, inelastic::Host &host, double kick,
                          bool carried, const double *const *expected, int column)
{
  const inelastic::RigidBodies &bodies = problem.bodies;
  const std::size_t size = 3 * static_cast<std::size_t>(problem.particles);
  linear_.assign(size, 0.0);
  change_.assign(size, 0.0);
  carried_part_.assign(size, 0.0);
  for (int i = 0; i < atom->nlocal; ++i) {
    const int b = bodies.body[i];
    if (b < 0) continue;
    const Body &body = bodies_[b];
    const Carried &of_body = carried_[i];
    const Push &push = carried ? of_body.next : of_body.held;
    const double m = mass(i);
    for (int d = 0; d < 3; ++d) {
      const double forced = kick * atom->f[i][d];
      linear_[3 * i + d] = m * (atom->v[i][d] - push.velocity[d]) + forced;
      // Point masses on a line show L by v: it sets right the round-off of short arms in what is
      // carried along. Otherwise this would be off by a change of I, and unstable.
      change_[3 * i + d] = forced;
      if (!carried)
        change_[3 * i + d] += m * atom->v[i][d];
      else if (body.collinear && inertia_ == Inertia::POINT)
        change_[3 * i + d] += m * (atom->v[i][d] - expected[i][column + d]);
    }
    double *const part = &carried_part_[3 * i];
    if (bodies.place[i] == bodies.start[b]) {
      // Forces on the spheres can take away no more of a push than this.
      double pushed[3], slow[3], removed[3];
      for (int d = 0; d < 3; ++d)
        pushed[d] = push.angular_momentum[d] + (carried ? of_body.left_over[d] : 0.0);
      multiply(body.point_inverse, pushed, slow);
      multiply(body.point_inertia, slow, removed);
      for (int d = 0; d < 3; ++d)
        part[d] = (carried ? of_body.angular_momentum[d] : 0.0) - removed[d];
    }
    if (!carried && inertia_ == Inertia::SOLID)
      for (int d = 0; d < 3; ++d)
        part[d] += SPHERE_MOMENT * m * atom->radius[i] * atom->radius[i] * atom->omega[i][d];
  }
  host.share_with_copies(linear_.data());
  host.share_with_copies(change_.data());
  host.share_with_copies(carried_part_.data());

  for (std::size_t b = 0; b < bodies.size(); ++b) {
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
    for (int d = 0; d < 3; ++d) body.velocity[d] = momentum[d] / body.mass;
    double spin[3];
    multiply(&bodies.inverse_inertia[6 * b], body.angular_momentum, spin);
    for (int k = begin; k < end; ++k) {
      double around[3];
      cross(spin, &bodies.arm[3 * k], around);
      for (int d = 0; d < 3; ++d)
        problem.predicted_velocity[3 * static_cast<std::size_t>(bodies.member[k]) + d] =
            body.velocity[d] + around[d];
    }
  }
  predicted_ = problem.predicted_velocity;
  pushing_ = false;
}

/* ----------------------------------------------------------------------
   the step
------------------------------------------------------------------------- */

// What a body has beyond a reference, both given by the velocities of its spheres. They do not show
// a spin about a line through all of them, which contacts cannot change.
void RigidMotion::difference(const inelastic::RigidBodies &bodies, std::size_t b,
                             const double *velocity, const double *reference, Push &push) const
{
  const Body &body = bodies_[b];
  double momentum[3] = {}, moment[3] = {};
  const int begin = bodies.start[b];
  for (int k = begin; k < begin + bodies.originals[b]; ++k) {
    const std::size_t i = 3 * static_cast<std::size_t>(bodies.member[k]);
    const double m = mass(bodies.member[k]);
    double faster[3], turning[3];
    for (int d = 0; d < 3; ++d) faster[d] = m * (velocity[i + d] - reference[i + d]);
    cross(&bodies.arm[3 * k], faster, turning);
    for (int d = 0; d < 3; ++d) {
      momentum[d] += faster[d];
      moment[d] += turning[d];
    }
  }
  double spin[3];
  multiply(body.point_inverse, moment, spin);
  multiply(body.inertia, spin, push.angular_momentum.data());
  for (int d = 0; d < 3; ++d) push.velocity[d] = momentum[d] / body.mass;
}

void RigidMotion::turn(const inelastic::ContactProblem &problem,
                       const std::vector<double> &velocity)
{
  const inelastic::RigidBodies &bodies = problem.bodies;
  const double h = problem.timestep;
  motion_ = velocity;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    Body &body = bodies_[b];
    Push gained;
    difference(bodies, b, velocity.data(), predicted_.data(), gained);
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
        motion_[3 * static_cast<std::size_t>(bodies.member[k]) + d] =
            body.velocity_end[d] + displaced[d] / h;
    }
  }
}

double RigidMotion::angle_turned(const inelastic::ContactProblem &problem, int i) const
{ return problem.timestep * norm(bodies_[problem.bodies.body[i]].angular_velocity_end); }

double RigidMotion::angle_predicted(const inelastic::ContactProblem &problem, int i) const
{
  const int b = problem.bodies.body[i];
  double spin[3];
  multiply(&problem.bodies.inverse_inertia[6 * b], bodies_[b].angular_momentum, spin);
  return problem.timestep * norm(spin);
}

void RigidMotion::velocity_after(const inelastic::ContactProblem &problem, int i,
                                 double *velocity) const
{
  const Body &body = bodies_[problem.bodies.body[i]];
  double arm[3];
  rotate(body.turned, 1.0, &problem.bodies.arm[3 * problem.bodies.place[i]], arm);
  cross(body.angular_velocity_end, arm, velocity);
  for (int d = 0; d < 3; ++d) velocity[d] += body.velocity_end[d];
}

void RigidMotion::note_push(const inelastic::ContactProblem &problem,
                            const std::vector<double> &velocity)
{
  pushing_ = true;
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    difference(problem.bodies, b, velocity.data(), problem.predicted_velocity.data(),
               bodies_[b].push);
}

void RigidMotion::finish(const inelastic::ContactProblem &problem, int i, const Kick &kick,
                         const double *contact_force, double *force)
{
  const inelastic::RigidBodies &bodies = problem.bodies;
  const int b = bodies.body[i];
  const Body &body = bodies_[b];
  Carried &of_body = carried_[i];
  Push push = pushing_ ? body.push : Push{};
  // Whole-step velocities hold the mean of two pushes: this makes it vanish.
  if (kick.last)
    for (int d = 0; d < 3; ++d) {
      push.velocity[d] = -of_body.next.velocity[d];
      push.angular_momentum[d] = -of_body.next.angular_momentum[d];
    }
  const Push &before = kick.whole ? of_body.next : of_body.held;
  // Forces m (a + alpha x r) with the right sum and the right moment.
  double change[3], spin[3], around[3];
  for (int d = 0; d < 3; ++d)
    change[d] = push.angular_momentum[d] - before.angular_momentum[d] -
        (kick.whole ? of_body.left_over[d] : 0.0);
  multiply(body.point_inverse, change, spin);
  of_body.left_over = {};
  if (body.collinear) {
    double made[3];
    multiply(body.point_inertia, spin, made);
    for (int d = 0; d < 3; ++d) of_body.left_over[d] = made[d] - change[d];
  }
  cross(spin, &bodies.arm[3 * bodies.place[i]], around);
  for (int d = 0; d < 3; ++d)
    force[d] += mass(i) * (push.velocity[d] - before.velocity[d] + around[d]) / kick.strength;

  if (kick.whole)
    for (int d = 0; d < 3; ++d) {
      of_body.held.velocity[d] = 0.5 * (of_body.next.velocity[d] + push.velocity[d]);
      of_body.held.angular_momentum[d] =
          0.5 * (of_body.next.angular_momentum[d] + push.angular_momentum[d]);
    }
  of_body.next = push;
  double moments = 0.0;    // their size; they may cancel
  for (int k = bodies.start[b]; k < bodies.start[b] + bodies.originals[b]; ++k) {
    const double *const r = &bodies.arm[3 * k];
    const double *const f = contact_force + 3 * static_cast<std::size_t>(bodies.member[k]);
    moments += std::sqrt(dot(r, r) * dot(f, f));
  }
  const double angle = problem.timestep *
      (std::sqrt(dot(body.angular_velocity_end, body.angular_velocity_end)) +
       kick.strength * moments * trace(&bodies.inverse_inertia[6 * b]));
  // The angular momentum is carried along, and with it what an earlier step's moments have rounded.
  of_body.angle = kick.whole ? std::max(of_body.angle, angle)
                             : std::max(angle, angle_of_first_momentum(problem, b));
  std::copy_n(body.angular_momentum_end, 3, of_body.angular_momentum.begin());
}

// At the start of a run LAMMPS takes the angular momentum of a body from velocities that hold the common
// one, and its centre of mass is rounded as coordinates are: to about M |dx| |v|. The angle whose square
// magnifies the round-off of positions as much as that does.
double RigidMotion::angle_of_first_momentum(const inelastic::ContactProblem &problem, int b) const
{
  // Ten times the machine epsilon, of the part of coordinates that is allowed for round-off.
  constexpr double ROUNDED = 2.2e-3;
  const inelastic::RigidBodies &bodies = problem.bodies;
  double longest = 0.0;
  for (int k = bodies.start[b]; k < bodies.start[b] + bodies.originals[b]; ++k)
    longest = std::max(longest, norm(&bodies.arm[3 * k]));
  const double turned = problem.timestep * bodies_[b].mass * norm(bodies_[b].velocity_end) *
      trace(&bodies.inverse_inertia[6 * b]) * longest;
  return std::sqrt(ROUNDED * turned);
}

int RigidMotion::pack(int i, double *buffer) const
{
  const Carried &of_body = carried_[i];
  double *out = std::copy_n(of_body.angular_momentum.begin(), 3, buffer);
  for (const Push *push : {&of_body.next, &of_body.held}) {
    out = std::copy_n(push->velocity.begin(), 3, out);
    out = std::copy_n(push->angular_momentum.begin(), 3, out);
  }
  out = std::copy_n(of_body.left_over.begin(), 3, out);
  *out++ = of_body.angle;
  return static_cast<int>(out - buffer);
}

int RigidMotion::unpack(int i, const double *buffer)
{
  Carried &of_body = carried_[i];
  const double *in = buffer;
  auto take = [&in](std::array<double, 3> &values) {
    std::copy_n(in, 3, values.begin());
    in += 3;
  };
  take(of_body.angular_momentum);
  for (Push *push : {&of_body.next, &of_body.held}) {
    take(push->velocity);
    take(push->angular_momentum);
  }
  take(of_body.left_over);
  of_body.angle = *in++;
  return static_cast<int>(in - buffer);
}

bool RigidMotion::has_held(int i) const
{
  double held[HELD_SIZE];
  pack_held(i, held);
  return std::any_of(held, held + HELD_SIZE, [](double value) {
    return value != 0.0;
  });
}

void RigidMotion::pack_held(int i, double *buffer) const
{
  const Push &held = carried_[i].held;
  double *out = std::copy_n(held.velocity.begin(), 3, buffer);
  std::copy_n(held.angular_momentum.begin(), 3, out);
}

void RigidMotion::unpack_held(int i, const double *buffer)
{
  Push &held = carried_[i].held;
  std::copy_n(buffer, 3, held.velocity.begin());
  std::copy_n(buffer + 3, 3, held.angular_momentum.begin());
}

/* ----------------------------------------------------------------------
   do LAMMPS's bodies agree with these?
------------------------------------------------------------------------- */

namespace {

// Same trace, same sum of squares and same product of the principal moments.
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

std::string RigidMotion::disagreement(const inelastic::ContactProblem &problem)
{
  const std::string compute_id = "inelastic_bodies_of_" + fix_id_;
  Compute *const compute = modify->add_compute(
      fmt::format("{} all rigid/local {} id mass inertiax inertiay inertiaz", compute_id, fix_id_));
  compute->init();
  compute->compute_local();
  std::string message;
  for (int row = 0; row < compute->size_local_rows && message.empty(); ++row) {
    const double *const found = compute->array_local[row];
    const int i = atom->map(static_cast<tagint>(found[0]));
    const int b = i < 0 ? -1 : problem.bodies.body[i];
    if (b < 0) continue;    // outside the fix's group
    const Body &body = bodies_[b];
    const tagint molecule = atom->molecule[i];
    if (std::abs(body.mass - found[1]) > AGREEMENT * body.mass) {
      message =
          fmt::format("fix {} gives the body of molecule {} the mass {:.6g}, its spheres have "
                      "{:.6g}: bodies must be molecules (rigid/small molecule), their masses "
                      "set before fix {}, with no other ones in an infile",
                      fix_id_, molecule, found[1], body.mass, fix_id_);
      continue;
    }
    const double extent = std::sqrt(trace(body.point_inertia) / body.mass);
    const double rounded = std::numeric_limits<double>::epsilon() * norm(atom->x[i]);
    if (inertia_ == Inertia::POINT && extent < RESOLVED_ARM * rounded) {
      message =
          fmt::format("the spheres of molecule {} are about {:.2g} apart, too near to one another "
                      "for point masses at coordinates that are rounded by {:.1g}: at least {:.1g} "
                      "is needed, or rigid {} solid, or one sphere in their place",
                      molecule, extent, rounded, RESOLVED_ARM * rounded, fix_id_);
      continue;
    }
    const double *const moments = found + 2;
    if (same_moments(body.inertia, moments)) continue;
    double balls[6];
    std::copy_n(body.point_inertia, 6, balls);
    const int begin = problem.bodies.start[b];
    for (int k = begin; k < begin + problem.bodies.originals[b]; ++k) {
      const int j = problem.bodies.member[k];
      for (int d = 0; d < 3; ++d)
        balls[d] += SPHERE_MOMENT * mass(j) * atom->radius[j] * atom->radius[j];
    }
    const char *const kind = same_moments(body.point_inertia, moments) ? "of point masses"
        : same_moments(balls, moments)                                 ? "of solid spheres"
                                       : "neither of point masses nor of solid spheres";
    message = fmt::format(
        "fix {} turns the body of molecule {} with the moments of inertia {:.6g}, {:.6g}, {:.6g}, "
        "{}, where fix inelastic has rigid {} {}. Spheres count as point masses for rigid/small if "
        "their diameter is 0 when its bodies are set up; moments from an infile must be one or the "
        "other",
        fix_id_, molecule, moments[0], moments[1], moments[2], kind, fix_id_,
        inertia_ == Inertia::POINT ? "point" : "solid");
  }
  modify->delete_compute(compute_id);
  return message;
}
