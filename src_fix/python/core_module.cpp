// The compiled part of the Python module lammps_inelastic.core. It takes the objects of problem.py,
// which have checked their arrays, and checks nothing itself.

#include "inelastic_contact_problem.h"
#include "inelastic_gap_operator.h"
#include "inelastic_make_solver.h"
#include "inelastic_random.h"
#include "inelastic_solver.h"

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <string>
#include <vector>

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Vectors = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Scalars = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Matrices = nb::ndarray<const double, nb::shape<-1, 3, 3>, nb::c_contig, nb::device::cpu>;
using Indices = nb::ndarray<const std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

// Copies the values into an array of shape (n,) if `columns` is 0, and (n / columns, columns)
// otherwise.
nb::object to_numpy(const std::vector<double> &values, std::size_t columns)
{
  auto *data = new double[std::max<std::size_t>(values.size(), 1)];
  std::copy(values.begin(), values.end(), data);
  nb::capsule owner(data, [](void *pointer) noexcept {
    delete[] static_cast<double *>(pointer);
  });
  using Numbers = nb::ndarray<nb::numpy, double>;
  if (columns == 0) {
    const std::size_t shape[1] = {values.size()};
    return nb::cast(Numbers(data, 1, shape, owner));
  }
  const std::size_t shape[2] = {values.size() / columns, columns};
  return nb::cast(Numbers(data, 2, shape, owner));
}

template <typename Array> Array array(nb::handle owner, const char *name)
{ return nb::cast<Array>(owner.attr(name)); }

// Adds the bodies of a problem (class Bodies) whose number of particles is known.
void add_bodies(inelastic::ContactProblem &problem, nb::handle given)
{
  const auto body = array<Indices>(given, "body");
  const auto arm = array<Vectors>(given, "arm");
  const auto inverse_mass = array<Scalars>(given, "inverse_mass");
  const auto inverse_inertia = array<Matrices>(given, "inverse_inertia");
  std::vector<std::vector<int>> members(inverse_mass.size());
  std::vector<std::vector<double>> arms(inverse_mass.size());
  for (int i = 0; i < problem.particles; ++i) {
    const std::int64_t b = body.data()[i];
    if (b < 0) continue;
    const double *const from_centre = arm.data() + 3 * static_cast<std::size_t>(i);
    members[b].push_back(i);
    arms[b].insert(arms[b].end(), from_centre, from_centre + 3);
  }
  problem.bodies.clear(problem.particles);
  for (std::size_t b = 0; b < members.size(); ++b) {
    const int size = static_cast<int>(members[b].size());
    const double *const a = inverse_inertia.data() + 9 * b;
    // In the order of RigidBodies::inverse_inertia.
    const double symmetric[6] = {
        a[0], a[4], a[8], 0.5 * (a[1] + a[3]), 0.5 * (a[2] + a[6]), 0.5 * (a[5] + a[7])};
    problem.bodies.add(members[b].data(), arms[b].data(), size, size, inverse_mass.data()[b],
                       symmetric);
  }
}

void add_contacts(inelastic::ContactProblem &problem, nb::handle given)
{
  const auto first = array<Indices>(given, "first");
  const auto second = array<Indices>(given, "second");
  const auto normal = array<Vectors>(given, "normal");
  const auto gap = array<Scalars>(given, "gap");
  const auto guess = array<Scalars>(given, "impulse_guess");
  const auto compliance = array<Scalars>(given, "compliance");
  const auto least = array<Scalars>(given, "least_impulse");
  const auto refinement = array<Scalars>(given, "refinement");
  for (std::size_t c = 0; c < gap.size(); ++c) {
    const auto wall_or_particle = static_cast<int>(second.data()[c]);
    problem.contacts.add(
        static_cast<int>(first.data()[c]),
        wall_or_particle < 0 ? problem.slot_of_wall(0) : wall_or_particle, normal.data() + 3 * c,
        gap.data()[c], guess.data()[c], compliance.data()[c],
        inelastic::AdmissibleSet<double>::above(least.data()[c]), refinement.data()[c]);
  }
}

// Takes a Problem of problem.py.
inelastic::ContactProblem make_problem(nb::handle given)
{
  inelastic::ContactProblem problem;
  const auto predicted_velocity = array<Vectors>(given, "predicted_velocity");
  const auto inverse_mass = array<Scalars>(given, "inverse_mass");
  problem.timestep = nb::cast<double>(given.attr("timestep"));
  problem.resize(static_cast<int>(inverse_mass.size()), 1);
  std::copy_n(predicted_velocity.data(), predicted_velocity.size(),
              problem.predicted_velocity.begin());
  std::copy_n(inverse_mass.data(), inverse_mass.size(), problem.inverse_mass.begin());
  const nb::object bodies = given.attr("bodies");
  if (!bodies.is_none()) add_bodies(problem, bodies);
  add_contacts(problem, given);
  return problem;
}

inelastic::Residual residual_of(const inelastic::ContactProblem &problem)
{
  inelastic::SerialHost host;
  inelastic::GapOperator gap_operator;
  std::vector<double> gap_at_end(problem.contacts.size());
  gap_operator.prepare(problem);
  gap_operator.apply(problem, problem.contacts.impulse.data(), gap_at_end.data(), host);
  return inelastic::residual(gap_at_end.data(), problem.contacts);
}

// The words of projection.Status. A solve alone has no rounds.
const char *in_words(inelastic::Status status)
{
  switch (status) {
    case inelastic::Status::CONVERGED:
      return "converged";
    case inelastic::Status::ROUND_OFF:
      return "round-off";
    case inelastic::Status::NOT_FINITE:
      return "not finite";
    case inelastic::Status::INFEASIBLE:
      return "infeasible";
    case inelastic::Status::OUT_OF_ROUNDS:
    case inelastic::Status::OUT_OF_ITERATIONS:
      break;
  }
  return "out of iterations";
}

nb::tuple project(nb::handle given, const std::string &solver_name, double tolerance,
                  double accuracy, long max_iterations, double reach)
{
  auto solver = inelastic::make_solver(solver_name);
  inelastic::ContactProblem problem = make_problem(given);
  inelastic::SolverLimits limits = {tolerance, max_iterations, reach, accuracy};
  inelastic::SerialHost host;
  const inelastic::SolverResult result = solver->solve(problem, limits, host);
  const inelastic::Residual worst = residual_of(problem);
  std::vector<double> velocity(problem.predicted_velocity.size());
  inelastic::GapOperator gap_operator;
  gap_operator.prepare(problem);
  gap_operator.velocity(problem, problem.contacts.impulse.data(), velocity.data(), host);
  velocity.resize(3 * static_cast<std::size_t>(problem.particles));
  return nb::make_tuple(to_numpy(velocity, 3), to_numpy(problem.contacts.impulse, 0),
                        result.iterations, in_words(result.status), worst.feasibility,
                        worst.complementarity);
}

nb::tuple residual(nb::handle given, const Scalars &impulse)
{
  inelastic::ContactProblem problem = make_problem(given);
  std::copy_n(impulse.data(), impulse.size(), problem.contacts.impulse.begin());
  const inelastic::Residual worst = residual_of(problem);
  return nb::make_tuple(worst.feasibility, worst.complementarity);
}

double largest_eigenvalue(nb::handle given)
{
  inelastic::SerialHost host;
  return inelastic::largest_eigenvalue(make_problem(given), host);
}

nb::tuple uniform_vector(std::uint32_t seed, std::uint64_t particle, std::uint64_t step)
{
  const auto vector = inelastic::uniform_vector(seed, particle, step);
  return nb::make_tuple(vector[0], vector[1], vector[2]);
}

}    // namespace

NB_MODULE(_core, module)
{
  module.def("project", &project, "problem"_a, "solver"_a, nb::kw_only(), "tolerance"_a,
             "accuracy"_a, "max_iterations"_a, "reach"_a);
  module.def("residual", &residual, "problem"_a, "impulse"_a);
  module.def("largest_eigenvalue", &largest_eigenvalue, "problem"_a);
  module.def("uniform_vector", &uniform_vector, "seed"_a, "particle"_a, "step"_a);
}
