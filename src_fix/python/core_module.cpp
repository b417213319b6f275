// The core as a Python module. Shapes, units and errors are documented in _core.pyi.

#include "contact_problem.h"
#include "npz.h"
#include "random.h"
#include "solver.h"

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Vectors = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Scalars = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Matrices = nb::ndarray<const double, nb::shape<-1, 3, 3>, nb::c_contig, nb::device::cpu>;
using Indices = nb::ndarray<const std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

// The arguments that put particles into rigid bodies: all of them or none.
struct Bodies {
  std::optional<Indices> body;
  std::optional<Vectors> arm;
  std::optional<Scalars> inverse_mass;
  std::optional<Matrices> inverse_inertia;
};

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

constexpr double FLAW = 1.0e-6;    // of a matrix, and of a squared length: far above round-off

// In the order of RigidBodies::inverse_inertia.
std::array<double, 6> symmetric(const double *a, std::size_t body)
{
  double flaw = 0.0;
  for (int k = 0; k < 9; ++k) flaw = std::max(flaw, FLAW * std::abs(a[k]));
  const double xx = a[0], yy = a[4], zz = a[8];
  const double xy = 0.5 * (a[1] + a[3]), xz = 0.5 * (a[2] + a[6]), yz = 0.5 * (a[5] + a[7]);
  // Elimination leaves positive pivots, after the allowance for round-off.
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

inelastic::ContactProblem make_problem(const Vectors &predicted_velocity,
                                       const Scalars &inverse_mass, const Indices &first,
                                       const Indices &second, const Vectors &normal,
                                       const Scalars &gap, double timestep,
                                       const std::optional<Scalars> &impulse, const Bodies &bodies)
{
  const std::size_t particles = predicted_velocity.shape(0);
  const std::size_t count = gap.shape(0);
  require_length(inverse_mass, particles, "inverse_mass");
  require_length(first, count, "first");
  require_length(second, count, "second");
  require_length(normal, count, "normal");
  if (impulse) require_length(*impulse, count, "impulse");
  if (!(timestep > 0.0) || std::isinf(timestep))
    throw nb::value_error("timestep must be finite and greater than 0");
  require_finite(predicted_velocity, "predicted_velocity");
  require_finite(normal, "normal");
  require_finite(gap, "gap");
  if (impulse) require_finite(*impulse, "impulse");

  inelastic::ContactProblem problem;
  problem.timestep = timestep;
  problem.resize(static_cast<int>(particles));
  std::copy_n(predicted_velocity.data(), 3 * particles, problem.predicted_velocity.begin());
  std::copy_n(inverse_mass.data(), particles, problem.inverse_mass.begin());
  add_bodies(problem, bodies);
  auto body_of = [&](std::size_t i) {
    return problem.bodies.empty() ? -1 : problem.bodies.body[i];
  };
  for (std::size_t i = 0; i < particles; ++i)
    if (body_of(i) < 0) require_inverse_mass(inverse_mass.data()[i], "inverse_mass");
  const auto limit = static_cast<std::int64_t>(particles);
  for (std::size_t c = 0; c < count; ++c) {
    const std::int64_t i = first.data()[c];
    const std::int64_t j = second.data()[c];
    if (i < 0 || i >= limit || j < -1 || j >= limit)
      throw nb::value_error(("contact " + std::to_string(c) + " names a particle outside 0 ... " +
                             std::to_string(limit - 1))
                                .c_str());
    if (i == j)
      throw nb::value_error(
          ("contact " + std::to_string(c) + " is of a particle with itself").c_str());
    if (j >= 0 && body_of(i) >= 0 && body_of(i) == body_of(j))
      throw nb::value_error(
          ("contact " + std::to_string(c) + " is between two particles of one body").c_str());
    const double *const n = normal.data() + 3 * c;
    if (std::abs(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1.0) > FLAW)
      throw nb::value_error(
          ("the normal of contact " + std::to_string(c) + " has not length 1").c_str());
    const int second_or_wall = j < 0 ? problem.particles : static_cast<int>(j);
    const double w = problem.mobility(static_cast<int>(i), n) + problem.mobility(second_or_wall, n);
    if (!(w > 0.0))
      throw nb::value_error(
          ("contact " + std::to_string(c) + " is between particles that cannot move").c_str());
    problem.contacts.add(static_cast<int>(i), second_or_wall, n, gap.data()[c],
                         impulse ? impulse->data()[c] : 0.0);
  }
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
  return inelastic::residual(gap_at_end.data(), problem.contacts.impulse.data(), gap_at_end.size());
}

Projection project(const Vectors &predicted_velocity, const Scalars &inverse_mass,
                   const Indices &first, const Indices &second, const Vectors &normal,
                   const Scalars &gap, double timestep, double tolerance,
                   const std::string &solver_name, long max_iterations,
                   const std::optional<Scalars> &impulse, const std::optional<Indices> &body,
                   const std::optional<Vectors> &arm,
                   const std::optional<Scalars> &body_inverse_mass,
                   const std::optional<Matrices> &body_inverse_inertia)
{
  if (!(tolerance > 0.0) || std::isinf(tolerance))
    throw nb::value_error("tolerance must be finite and greater than 0");
  if (max_iterations < 0) throw nb::value_error("max_iterations must not be negative");
  auto solver = inelastic::make_solver(solver_name);
  if (!solver) throw nb::value_error(("solver must be apgd or uzawa, not " + solver_name).c_str());
  inelastic::ContactProblem problem =
      make_problem(predicted_velocity, inverse_mass, first, second, normal, gap, timestep, impulse,
                   {body, arm, body_inverse_mass, body_inverse_inertia});
  inelastic::SerialHost host;
  Projection projection;
  const inelastic::SolverResult result = solver->solve(problem, {tolerance, max_iterations}, host);
  projection.iterations = result.iterations;
  projection.converged = result.converged;
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
             "normal"_a, "gap"_a, nb::kw_only(), "timestep"_a, "tolerance"_a, "solver"_a = "apgd",
             "max_iterations"_a = 100000, "impulse"_a = nb::none(), "body"_a = nb::none(),
             "arm"_a = nb::none(), "body_inverse_mass"_a = nb::none(),
             "body_inverse_inertia"_a = nb::none());

  module.def(
      "residual",
      [](const Vectors &predicted_velocity, const Scalars &inverse_mass, const Indices &first,
         const Indices &second, const Vectors &normal, const Scalars &gap, const Scalars &impulse,
         double timestep, const std::optional<Indices> &body, const std::optional<Vectors> &arm,
         const std::optional<Scalars> &body_inverse_mass,
         const std::optional<Matrices> &body_inverse_inertia) {
        const inelastic::Residual worst = residual_of(
            make_problem(predicted_velocity, inverse_mass, first, second, normal, gap, timestep,
                         impulse, {body, arm, body_inverse_mass, body_inverse_inertia}));
        return nb::make_tuple(worst.feasibility, worst.complementarity);
      },
      "predicted_velocity"_a, "inverse_mass"_a, "first"_a, "second"_a, "normal"_a, "gap"_a,
      "impulse"_a, nb::kw_only(), "timestep"_a, "body"_a = nb::none(), "arm"_a = nb::none(),
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
            make_problem(velocity, inverse_mass, first, second, normal, gap, timestep, {},
                         {body, arm, body_inverse_mass, body_inverse_inertia}),
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

  module.def(
      "write_npz",
      [](const std::string &path, nb::dict arrays) {
        inelastic::NpzWriter writer;
        for (const auto &[name, values] : arrays) {
          const auto array = nb::cast<Vectors>(values);
          writer.add(nb::cast<std::string>(name),
                     std::vector<double>(array.data(), array.data() + array.size()), 3);
        }
        if (!writer.write(path))
          throw std::runtime_error("cannot write " + path + ": " + std::strerror(errno));
      },
      "path"_a, "arrays"_a);
}
