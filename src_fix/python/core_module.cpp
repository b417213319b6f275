// The core as a Python module; _core.pyi documents shapes, units and errors.

#include "contact_problem.h"
#include "gap_operator.h"
#include "make_solver.h"
#include "random.h"
#include "solver.h"
#include "vector3.h"

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Vectors = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Scalars = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Matrices = nb::ndarray<const double, nb::shape<-1, 3, 3>, nb::c_contig, nb::device::cpu>;
using Indices = nb::ndarray<const std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

// The arguments that put particles into rigid bodies; either all are given or none.
struct Bodies {
  std::optional<Indices> body;
  std::optional<Vectors> arm;
  std::optional<Scalars> inverse_mass;
  std::optional<Matrices> inverse_inertia;
};

// Copies the values into an array of shape (n,) if `columns` is 0, and (n / columns, columns)
// otherwise.
nb::ndarray<nb::numpy, double> to_numpy(const std::vector<double> &values, std::size_t columns)
{
  auto *data = new double[std::max<std::size_t>(values.size(), 1)];
  std::copy(values.begin(), values.end(), data);
  nb::capsule owner(data, [](void *pointer) noexcept {
    delete[] static_cast<double *>(pointer);
  });
  if (columns == 0) {
    const std::size_t shape[1] = {values.size()};
    return {data, 1, shape, owner};
  }
  const std::size_t shape[2] = {values.size() / columns, columns};
  return {data, 2, shape, owner};
}

template <typename Array>
void require_length(const Array &array, std::size_t length, const char *name)
{
  if (array.shape(0) != length)
    throw nb::value_error((std::string(name) + " must have length " + std::to_string(length) +
                           ", not " + std::to_string(array.shape(0)))
                              .c_str());
}

void require_finite(const double *values, std::size_t count, const char *name)
{
  for (std::size_t k = 0; k < count; ++k)
    if (!std::isfinite(values[k]))
      throw nb::value_error((std::string(name) + " holds a number that is not finite").c_str());
}

template <typename Array> void require_finite(const Array &array, const char *name)
{ require_finite(array.data(), array.size(), name); }

void require_inverse_mass(double value, const char *name)
{
  require_finite(&value, 1, name);
  if (value < 0.0) throw nb::value_error((std::string(name) + " must not be negative").c_str());
}

// A relative error of a matrix, or of a squared length, that is far above round-off.
constexpr double FLAW = 1.0e-6;

// Returns a symmetric matrix in the order of RigidBodies::inverse_inertia.
std::array<double, 6> symmetric(const double *a, std::size_t body)
{
  double flaw = 0.0;
  for (int k = 0; k < 9; ++k) flaw = std::max(flaw, FLAW * std::abs(a[k]));
  const double xx = a[0], yy = a[4], zz = a[8];
  const double xy = 0.5 * (a[1] + a[3]), xz = 0.5 * (a[2] + a[6]), yz = 0.5 * (a[5] + a[7]);
  // A matrix is positive definite if Gaussian elimination leaves positive pivots. The flaw is added
  // to the diagonal as an allowance for round-off.
  const double x = xx + flaw, y = yy + flaw - xy * (xy / x), off = yz - xy * (xz / x);
  const bool positive = x > 0.0 && y > 0.0 && zz + flaw - xz * (xz / x) - off * (off / y) > 0.0;
  const double skew =
      std::max({std::abs(a[1] - a[3]), std::abs(a[2] - a[6]), std::abs(a[5] - a[7])});
  if (flaw > 0.0 && !(positive && skew <= flaw))
    throw nb::value_error(("body_inverse_inertia of body " + std::to_string(body) +
                           " is not symmetric and positive semi-definite")
                              .c_str());
  return {xx, yy, zz, xy, xz, yz};
}

void add_bodies(inelastic::ContactProblem &problem, const Bodies &given)
{
  if (!given.body && !given.arm && !given.inverse_mass && !given.inverse_inertia) return;
  if (!given.body || !given.arm || !given.inverse_mass || !given.inverse_inertia)
    throw nb::value_error("body, arm, body_inverse_mass and body_inverse_inertia go together");
  const auto particles = static_cast<std::size_t>(problem.particles);
  const std::size_t count = given.inverse_mass->shape(0);
  require_length(*given.body, particles, "body");
  require_length(*given.arm, particles, "arm");
  require_length(*given.inverse_inertia, count, "body_inverse_inertia");
  require_finite(*given.inverse_inertia, "body_inverse_inertia");

  std::vector<std::vector<int>> members(count);
  std::vector<std::vector<double>> arms(count);
  for (std::size_t i = 0; i < particles; ++i) {
    const std::int64_t b = given.body->data()[i];
    if (b < -1 || b >= static_cast<std::int64_t>(count))
      throw nb::value_error(("particle " + std::to_string(i) + " is in a body outside -1 ... " +
                             std::to_string(static_cast<std::int64_t>(count) - 1))
                                .c_str());
    if (b < 0) continue;
    const double *const arm = given.arm->data() + 3 * i;
    require_finite(arm, 3, "arm");
    members[b].push_back(static_cast<int>(i));
    arms[b].insert(arms[b].end(), arm, arm + 3);
  }
  problem.bodies.clear(problem.particles);
  for (std::size_t b = 0; b < count; ++b) {
    const int size = static_cast<int>(members[b].size());
    if (size == 0)
      throw nb::value_error(("body " + std::to_string(b) + " has no particle").c_str());
    const double inverse_mass = given.inverse_mass->data()[b];
    require_inverse_mass(inverse_mass, "body_inverse_mass");
    problem.bodies.add(members[b].data(), arms[b].data(), size, size, inverse_mass,
                       symmetric(given.inverse_inertia->data() + 9 * b, b).data());
  }
}

// The arguments that describe constraints.
struct Contacts {
  Indices first;
  Indices second;
  Vectors normal;
  Scalars gap;
  std::optional<Scalars> impulse;       // the first guess, or none
  std::optional<Scalars> compliance;    // or all are rigid
  std::optional<Scalars> least;         // least impulses, or all are 0
};

void require_contacts(const Contacts &given)
{
  const std::size_t count = given.gap.shape(0);
  require_length(given.first, count, "first");
  require_length(given.second, count, "second");
  require_length(given.normal, count, "normal");
  if (given.impulse) require_length(*given.impulse, count, "impulse");
  if (given.compliance) require_length(*given.compliance, count, "compliance");
  if (given.least) require_length(*given.least, count, "least_impulse");
}

// Refuses constraint c between particles i and j (-1 = a wall) if it makes no sense for the
// problem.
void require_contact(const inelastic::ContactProblem &problem, std::size_t c, std::int64_t i,
                     std::int64_t j, const double *normal)
{
  const auto refuse = [c](const char *before, const std::string &after) {
    throw nb::value_error((before + ("contact " + std::to_string(c)) + after).c_str());
  };
  const auto limit = static_cast<std::int64_t>(problem.particles);
  auto body_of = [&](std::int64_t k) {
    return problem.bodies.empty() ? -1 : problem.bodies.body[static_cast<std::size_t>(k)];
  };
  if (i < 0 || i >= limit || j < -1 || j >= limit)
    refuse("", " names a particle outside 0 ... " + std::to_string(limit - 1));
  if (i == j) refuse("", " is of a particle with itself");
  if (j >= 0 && body_of(i) >= 0 && body_of(i) == body_of(j))
    refuse("", " is between two particles of one body");
  if (std::abs(inelastic::dot(normal, normal) - 1.0) > FLAW)
    refuse("the normal of ", " has not length 1");
  const int second = j < 0 ? problem.particles : static_cast<int>(j);
  const double w = problem.mobility(static_cast<int>(i), normal) + problem.mobility(second, normal);
  if (!(w > 0.0)) refuse("", " is between particles that cannot move");
}

void add_contacts(inelastic::ContactProblem &problem, const Contacts &given)
{
  for (std::size_t c = 0; c < given.gap.shape(0); ++c) {
    const std::int64_t i = given.first.data()[c];
    const std::int64_t j = given.second.data()[c];
    const double *const n = given.normal.data() + 3 * c;
    require_contact(problem, c, i, j, n);
    problem.contacts.add(static_cast<int>(i), j < 0 ? problem.particles : static_cast<int>(j), n,
                         given.gap.data()[c], given.impulse ? given.impulse->data()[c] : 0.0,
                         given.compliance ? given.compliance->data()[c] : 0.0,
                         given.least ? given.least->data()[c] : 0.0);
  }
}

inelastic::ContactProblem make_problem(const Vectors &predicted_velocity,
                                       const Scalars &inverse_mass, const Contacts &contacts,
                                       double timestep, const Bodies &bodies)
{
  const std::size_t particles = predicted_velocity.shape(0);
  require_length(inverse_mass, particles, "inverse_mass");
  require_contacts(contacts);
  if (!(timestep > 0.0) || std::isinf(timestep))
    throw nb::value_error("timestep must be finite and greater than 0");
  require_finite(predicted_velocity, "predicted_velocity");
  require_finite(contacts.normal, "normal");
  require_finite(contacts.gap, "gap");
  if (contacts.impulse) require_finite(*contacts.impulse, "impulse");
  if (contacts.compliance) {
    require_finite(*contacts.compliance, "compliance");
    for (std::size_t c = 0; c < contacts.compliance->size(); ++c)
      if (contacts.compliance->data()[c] < 0.0)
        throw nb::value_error("compliance must not be negative");
  }
  if (contacts.least) {
    require_finite(*contacts.least, "least_impulse");
    for (std::size_t c = 0; c < contacts.least->size(); ++c)
      if (contacts.least->data()[c] > 0.0)
        throw nb::value_error("least_impulse must not be positive");
  }

  inelastic::ContactProblem problem;
  problem.timestep = timestep;
  problem.resize(static_cast<int>(particles));
  std::copy_n(predicted_velocity.data(), 3 * particles, problem.predicted_velocity.begin());
  std::copy_n(inverse_mass.data(), particles, problem.inverse_mass.begin());
  add_bodies(problem, bodies);
  for (std::size_t i = 0; i < particles; ++i)
    if (problem.bodies.empty() || problem.bodies.body[i] < 0)
      require_inverse_mass(inverse_mass.data()[i], "inverse_mass");
  add_contacts(problem, contacts);
  return problem;
}

struct Projection {
  std::vector<double> velocity;
  std::vector<double> impulse;
  long iterations;
  bool converged;
  inelastic::Residual residual;
};

inelastic::Residual residual_of(const inelastic::ContactProblem &problem)
{
  inelastic::SerialHost host;
  inelastic::GapOperator gap_operator;
  std::vector<double> gap_at_end(problem.contacts.size());
  gap_operator.prepare(problem);
  gap_operator.apply(problem, problem.contacts.impulse.data(), gap_at_end.data(), host);
  return inelastic::residual(gap_at_end.data(), problem.contacts);
}

Projection project(const Vectors &predicted_velocity, const Scalars &inverse_mass,
                   const Indices &first, const Indices &second, const Vectors &normal,
                   const Scalars &gap, double timestep, double tolerance, double accuracy,
                   const std::string &solver_name, long max_iterations,
                   const std::optional<Scalars> &impulse, const std::optional<Scalars> &compliance,
                   const std::optional<Scalars> &least_impulse, const std::optional<Indices> &body,
                   const std::optional<Vectors> &arm,
                   const std::optional<Scalars> &body_inverse_mass,
                   const std::optional<Matrices> &body_inverse_inertia)
{
  if (!(tolerance > 0.0) || std::isinf(tolerance))
    throw nb::value_error("tolerance must be finite and greater than 0");
  if (!(accuracy >= 0.0 && accuracy < 1.0))
    throw nb::value_error("accuracy must be at least 0 and below 1");
  if (max_iterations < 0) throw nb::value_error("max_iterations must not be negative");
  auto solver = inelastic::make_solver(solver_name);
  if (!solver) throw nb::value_error(("solver must be apgd or uzawa, not " + solver_name).c_str());
  inelastic::ContactProblem problem =
      make_problem(predicted_velocity, inverse_mass,
                   {first, second, normal, gap, impulse, compliance, least_impulse}, timestep,
                   {body, arm, body_inverse_mass, body_inverse_inertia});
  inelastic::SerialHost host;
  Projection projection;
  inelastic::SolverLimits limits = {tolerance, max_iterations};
  limits.accuracy = accuracy;
  const inelastic::SolverResult result = solver->solve(problem, limits, host);
  projection.iterations = result.iterations;
  projection.converged = result.status == inelastic::Status::CONVERGED;
  projection.residual = residual_of(problem);
  projection.impulse = problem.contacts.impulse;
  projection.velocity.resize(3 * static_cast<std::size_t>(problem.particles));
  inelastic::GapOperator gap_operator;
  gap_operator.prepare(problem);
  gap_operator.velocity(problem, problem.contacts.impulse.data(), projection.velocity.data(), host);
  return projection;
}

}    // namespace

NB_MODULE(_core, module)
{
  nb::class_<Projection>(module, "Projection")
      .def_prop_ro(
          "velocity",
          [](const Projection &p) {
            return to_numpy(p.velocity, 3);
          },
          nb::rv_policy::move)
      .def_prop_ro(
          "impulse",
          [](const Projection &p) {
            return to_numpy(p.impulse, 0);
          },
          nb::rv_policy::move)
      .def_ro("iterations", &Projection::iterations)
      .def_ro("converged", &Projection::converged)
      .def_prop_ro("feasibility",
                   [](const Projection &p) {
                     return p.residual.feasibility;
                   })
      .def_prop_ro("complementarity", [](const Projection &p) {
        return p.residual.complementarity;
      });

  module.def("project", &project, "predicted_velocity"_a, "inverse_mass"_a, "first"_a, "second"_a,
             "normal"_a, "gap"_a, nb::kw_only(), "timestep"_a, "tolerance"_a, "accuracy"_a = 0.0,
             "solver"_a = "apgd", "max_iterations"_a = 100000, "impulse"_a = nb::none(),
             "compliance"_a = nb::none(), "least_impulse"_a = nb::none(), "body"_a = nb::none(),
             "arm"_a = nb::none(), "body_inverse_mass"_a = nb::none(),
             "body_inverse_inertia"_a = nb::none());

  module.def(
      "residual",
      [](const Vectors &predicted_velocity, const Scalars &inverse_mass, const Indices &first,
         const Indices &second, const Vectors &normal, const Scalars &gap, const Scalars &impulse,
         double timestep, const std::optional<Scalars> &compliance,
         const std::optional<Scalars> &least_impulse, const std::optional<Indices> &body,
         const std::optional<Vectors> &arm, const std::optional<Scalars> &body_inverse_mass,
         const std::optional<Matrices> &body_inverse_inertia) {
        const inelastic::Residual worst = residual_of(
            make_problem(predicted_velocity, inverse_mass,
                         {first, second, normal, gap, impulse, compliance, least_impulse}, timestep,
                         {body, arm, body_inverse_mass, body_inverse_inertia}));
        return nb::make_tuple(worst.feasibility, worst.complementarity);
      },
      "predicted_velocity"_a, "inverse_mass"_a, "first"_a, "second"_a, "normal"_a, "gap"_a,
      "impulse"_a, nb::kw_only(), "timestep"_a, "compliance"_a = nb::none(),
      "least_impulse"_a = nb::none(), "body"_a = nb::none(), "arm"_a = nb::none(),
      "body_inverse_mass"_a = nb::none(), "body_inverse_inertia"_a = nb::none());

  module.def(
      "largest_eigenvalue",
      [](const Scalars &inverse_mass, const Indices &first, const Indices &second,
         const Vectors &normal, double timestep, const std::optional<Indices> &body,
         const std::optional<Vectors> &arm, const std::optional<Scalars> &body_inverse_mass,
         const std::optional<Matrices> &body_inverse_inertia) {
        const std::vector<double> zeros(3 * inverse_mass.shape(0) + first.shape(0), 0.0);
        const std::size_t velocity_shape[2] = {inverse_mass.shape(0), 3};
        const std::size_t gap_shape[1] = {first.shape(0)};
        const Vectors velocity(zeros.data(), 2, velocity_shape);
        const Scalars gap(zeros.data(), 1, gap_shape);
        inelastic::SerialHost host;
        return inelastic::largest_eigenvalue(
            make_problem(velocity, inverse_mass,
                         {first, second, normal, gap, std::nullopt, std::nullopt, std::nullopt},
                         timestep, {body, arm, body_inverse_mass, body_inverse_inertia}),
            host);
      },
      "inverse_mass"_a, "first"_a, "second"_a, "normal"_a, nb::kw_only(), "timestep"_a,
      "body"_a = nb::none(), "arm"_a = nb::none(), "body_inverse_mass"_a = nb::none(),
      "body_inverse_inertia"_a = nb::none());

  module.def(
      "uniform_vector",
      [](std::uint32_t seed, std::uint64_t particle, std::uint64_t step) {
        const auto vector = inelastic::uniform_vector(seed, particle, step);
        return nb::make_tuple(vector[0], vector[1], vector[2]);
      },
      "seed"_a, "particle"_a, "step"_a);
}
