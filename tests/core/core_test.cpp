// The core without Python: colours, all solvers, rigid bodies, the projection in rounds, several
// ranks and random numbers. Small, because it is there to be run under the address and
// undefined-behaviour sanitizers; the solvers are judged in test_solver*.py. Returns 1 when a check
// failed.

#include "inelastic_coloured_sweeps.h"
#include "inelastic_constraint_colours.h"
#include "inelastic_contact_problem.h"
#include "inelastic_contact_set.h"
#include "inelastic_gap_operator.h"
#include "inelastic_host.h"
#include "inelastic_make_solver.h"
#include "inelastic_projection.h"
#include "inelastic_random.h"
#include "inelastic_rigid_bodies.h"
#include "inelastic_search_chain.h"
#include "inelastic_solver.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <functional>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

using namespace inelastic;

namespace {

/* ----------------------------------------------------------------------
   checks
------------------------------------------------------------------------- */

std::atomic<int> failures{0};

void fail(int line, const std::string &expression, const std::string &values)
{
  ++failures;
  std::ostringstream message;
  message << "core_test.cpp:" << line << ": " << expression << '\n';
  if (!values.empty()) message << "    " << values << '\n';
  std::cerr << message.str();
}

template <typename Actual, typename Expected>
std::string both(const Actual &actual, const Expected &expected)
{
  std::ostringstream text;
  text.precision(17);
  text << "left: " << actual << ", right: " << expected;
  return text.str();
}

void check_near(int line, const std::string &expression, double actual, double expected,
                double bound)
{
  if (std::abs(actual - expected) <= bound) return;    // false if one of them is not a number
  std::ostringstream text;
  text << both(actual, expected) << ", off by " << std::abs(actual - expected) << ", allowed "
       << bound;
  fail(line, expression, text.str());
}

// Names the worst offender.
void check_all_near(int line, const std::string &expression, const std::vector<double> &actual,
                    const std::vector<double> &expected, double bound)
{
  if (actual.size() != expected.size()) {
    fail(line, expression + ": sizes", both(actual.size(), expected.size()));
    return;
  }
  const auto difference = [&](std::size_t k) {
    const double value = std::abs(actual[k] - expected[k]);
    return std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
  };
  std::size_t worst = 0;
  for (std::size_t k = 1; k < actual.size(); ++k)
    if (difference(k) > difference(worst)) worst = k;
  if (!actual.empty())
    check_near(line, expression + " at " + std::to_string(worst), actual[worst], expected[worst],
               bound);
}

#define CHECK(condition)                                   \
  do {                                                     \
    if (!(condition)) fail(__LINE__, #condition, "false"); \
  } while (false)

#define CHECK_COMPARED(actual, comparison, expected)                            \
  do {                                                                          \
    const auto &left = (actual);                                                \
    const auto &right = (expected);                                             \
    if (!(left comparison right))                                               \
      fail(__LINE__, #actual " " #comparison " " #expected, both(left, right)); \
  } while (false)

#define CHECK_EQUAL(actual, expected) CHECK_COMPARED(actual, ==, expected)
#define CHECK_AT_MOST(actual, bound) CHECK_COMPARED(actual, <=, bound)
#define CHECK_ABOVE(actual, bound) CHECK_COMPARED(actual, >, bound)

#define CHECK_NEAR(actual, expected, bound) \
  check_near(__LINE__, #actual " near " #expected, actual, expected, bound)

#define CHECK_ALL_NEAR(actual, expected, bound) \
  check_all_near(__LINE__, #actual " near " #expected, actual, expected, bound)

/* ----------------------------------------------------------------------
   problems
------------------------------------------------------------------------- */

constexpr int WALL = -1;
constexpr double UP[3] = {0.0, 0.0, 1.0};
constexpr double TIMESTEP = 0.01;
// [length] 1e-9 of the motion of one step.
constexpr double TOLERANCE = 1.0e-11;
// [length] 1e-3 of the motion of one step: far above what single precision blurs.
constexpr double SINGLE_TOLERANCE = 1.0e-5;
// Numbers near 1 after a few dozen additions.
constexpr double ROUNDING = 1.0e-13;

const std::vector<std::string> SOLVERS = {"sweeps", "apgd", "uzawa"};

ContactProblem make_problem(const std::vector<double> &velocity,
                            const std::vector<double> &inverse_mass)
{
  ContactProblem problem;
  problem.timestep = TIMESTEP;
  problem.resize(static_cast<int>(inverse_mass.size()), 1);
  std::copy(velocity.begin(), velocity.end(), problem.predicted_velocity.begin());
  std::copy(inverse_mass.begin(), inverse_mass.end(), problem.inverse_mass.begin());
  return problem;
}

void add_contact(ContactProblem &problem, int first, int second, const double *normal, double gap)
{
  problem.contacts.add(first, second == WALL ? problem.slot_of_wall(0) : second, normal, gap, 0.0);
}

// Unit spheres on top of each other, the lowest on a floor, all falling at g h = 0.1. With the
// contacts or, for a source to find them, without.
ContactProblem make_column(int count, bool with_contacts)
{
  const std::size_t size = static_cast<std::size_t>(count);
  ContactProblem problem =
      make_problem(std::vector<double>(3 * size, 0.0), std::vector<double>(size, 1.0));
  for (int i = 0; i < count; ++i) {
    problem.predicted_velocity[3 * static_cast<std::size_t>(i) + 2] = -0.1;
    if (with_contacts) add_contact(problem, i, i - 1, UP, 0.0);    // i - 1 is WALL for the lowest
  }
  return problem;
}

// Weight, times h, that each contact of the column carries.
std::vector<double> column_weights(int count)
{
  std::vector<double> weights;
  for (int i = 0; i < count; ++i) weights.push_back(0.1 * (count - i));
  return weights;
}

// The same column under a wall that has LID_MASS times the mass of a sphere and falls with it, with
// a floor that has no mass and does not move.
constexpr double LID_MASS = 7.0;
ContactProblem make_column_under_lid(int count)
{
  const double down[3] = {0.0, 0.0, -1.0};
  ContactProblem column = make_column(count, true), problem = column;
  problem.resize(count, 2);
  std::copy_n(column.predicted_velocity.begin(), 3 * count, problem.predicted_velocity.begin());
  const int lid = problem.slot_of_wall(1);
  problem.inverse_mass[static_cast<std::size_t>(lid)] = 1.0 / LID_MASS;
  problem.predicted_velocity[3 * static_cast<std::size_t>(lid) + 2] = -0.1;
  problem.contacts.add(count - 1, lid, down, 0.0, 0.0);
  return problem;
}

// A cube of side^3 touching spheres with random velocities on a floor.
ContactProblem make_crystal(int side)
{
  const int count = side * side * side;
  ContactProblem problem =
      make_problem({}, std::vector<double>(static_cast<std::size_t>(count), 1.0));
  for (int i = 0; i < count; ++i) {
    const auto velocity = uniform_vector(1, static_cast<std::uint64_t>(i), 0);
    std::copy(velocity.begin(), velocity.end(), problem.predicted_velocity.begin() + 3 * i);
    const int place[3] = {i / (side * side), i / side % side, i % side};
    const int stride[3] = {side * side, side, 1};
    for (int axis = 0; axis < 3; ++axis) {
      double normal[3] = {0.0, 0.0, 0.0};
      normal[axis] = 1.0;
      if (place[axis] > 0) add_contact(problem, i, i - stride[axis], normal, 0.0);
      if (place[axis] == 0 && axis == 2) add_contact(problem, i, WALL, normal, 0.0);
    }
  }
  return problem;
}

// Unit point masses: two on a line along z, and three at a right angle in the plane of x and y.
constexpr double ROD_ARMS[6] = {0.0, 0.0, -0.5, 0.0, 0.0, 0.5};
constexpr double ROD_INVERSE_INERTIA[6] = {2.0, 2.0, 0.0, 0.0, 0.0, 0.0};
constexpr double ANGLE_ARMS[9] = {-1.0 / 3, -1.0 / 3, 0.0,     2.0 / 3, -1.0 / 3,
                                  0.0,      -1.0 / 3, 2.0 / 3, 0.0};
constexpr double ANGLE_INVERSE_INERTIA[6] = {2.0, 2.0, 0.75, -1.0, 0.0, 0.0};

// The crystal of side 4 with 4 angles, 8 rods and 36 free spheres.
ContactProblem make_crystal_of_bodies()
{
  ContactProblem problem = make_crystal(4);
  RigidBodies &bodies = problem.bodies;
  bodies.clear(problem.particles);
  for (int z = 0; z < 4; ++z) {
    const int members[3] = {z, 16 + z, 4 + z};
    bodies.add(members, ANGLE_ARMS, 3, 3, 1.0 / 3.0, ANGLE_INVERSE_INERTIA);
  }
  for (const int x : {2, 3})
    for (const int y : {0, 2})
      for (const int z : {0, 2}) {
        const int low = 16 * x + 4 * y + z;
        const int members[2] = {low, low + 1};
        bodies.add(members, ROD_ARMS, 2, 2, 0.5, ROD_INVERSE_INERTIA);
      }
  for (const int i : bodies.member)
    problem.inverse_mass[static_cast<std::size_t>(i)] = std::numeric_limits<double>::quiet_NaN();

  const ContactSet all = problem.contacts;
  problem.contacts.clear();
  for (std::size_t c = 0; c < all.size(); ++c) {
    const auto body_of = [&](int i) {
      return problem.is_wall(i) ? -1 : bodies.body[static_cast<std::size_t>(i)];
    };
    const int first = body_of(all.first[c]);
    if (first < 0 || first != body_of(all.second[c]))
      problem.contacts.add(all.first[c], all.second[c], &all.normal[3 * c], all.gap[c], 0.0);
  }
  return problem;
}

std::array<double, 3> cross(const double *a, const double *b)
{ return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; }

// Where element (row, column) of a symmetric matrix is in RigidBodies::inverse_inertia.
constexpr std::size_t ELEMENT[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};

// V* + M^-1 G^T lambda, by the formula and not by the operator.
std::vector<double> velocity_of(const ContactProblem &problem)
{
  std::vector<double> velocity = problem.predicted_velocity;
  std::vector<double> push(velocity.size(), 0.0);
  const ContactSet &contacts = problem.contacts;
  for (std::size_t c = 0; c < contacts.size(); ++c)
    for (std::size_t d = 0; d < 3; ++d) {
      const double along = contacts.impulse[c] * contacts.normal[3 * c + d];
      push[3 * static_cast<std::size_t>(contacts.first[c]) + d] += along;
      push[3 * static_cast<std::size_t>(contacts.second[c]) + d] -= along;
    }
  const RigidBodies &bodies = problem.bodies;
  for (std::size_t i = 0; i < problem.inverse_mass.size(); ++i)
    if (bodies.empty() || problem.is_wall(static_cast<int>(i)) || bodies.body[i] < 0)
      for (std::size_t d = 0; d < 3; ++d)
        velocity[3 * i + d] += problem.inverse_mass[i] * push[3 * i + d];
  // Of every member on every member of the same body.
  for (std::size_t k = 0; k < bodies.member.size(); ++k)
    for (std::size_t l = 0; l < bodies.member.size(); ++l) {
      const auto to = static_cast<std::size_t>(bodies.member[k]);
      const auto from = static_cast<std::size_t>(bodies.member[l]);
      if (bodies.body[to] != bodies.body[from]) continue;
      const auto b = static_cast<std::size_t>(bodies.body[to]);
      const std::array<double, 3> moment = cross(&bodies.arm[3 * l], &push[3 * from]);
      double turn[3] = {0.0, 0.0, 0.0};
      for (std::size_t d = 0; d < 3; ++d)
        for (std::size_t e = 0; e < 3; ++e)
          turn[d] += bodies.inverse_inertia[6 * b + ELEMENT[d][e]] * moment[e];
      const std::array<double, 3> turned = cross(turn, &bodies.arm[3 * k]);
      for (std::size_t d = 0; d < 3; ++d)
        velocity[3 * to + d] += bodies.inverse_mass[b] * push[3 * from + d] + turned[d];
    }
  return velocity;
}

// Gaps at the end of the step, by the formula.
std::vector<double> gaps_of(const ContactProblem &problem, const std::vector<double> &velocity)
{
  const ContactSet &contacts = problem.contacts;
  std::vector<double> gaps = contacts.gap;
  for (std::size_t c = 0; c < contacts.size(); ++c)
    for (std::size_t d = 0; d < 3; ++d)
      gaps[c] += problem.timestep * contacts.normal[3 * c + d] *
          (velocity[3 * static_cast<std::size_t>(contacts.first[c]) + d] -
           velocity[3 * static_cast<std::size_t>(contacts.second[c]) + d]);
  return gaps;
}

// Adds nothing.
class AllContactsKnown final : public ConstraintSource {
 public:
  Refined refine(const std::vector<double> &, ContactProblem &) override
  {
    ++looks;
    return {};
  }
  int looks = 0;
};

/* ----------------------------------------------------------------------
   one rank
------------------------------------------------------------------------- */

void test_empty_problems()
{
  SerialHost host;
  for (const std::string &name : SOLVERS)
    for (const std::size_t particles : {0, 2}) {
      const auto solver = make_solver(name);
      std::vector<double> given(3 * particles, 0.25);
      ContactProblem problem = make_problem(given, std::vector<double>(particles, 1.0));
      const SolverResult solved = solver->solve(problem, {TOLERANCE, 10}, host);
      CHECK(solved.status == Status::CONVERGED);
      CHECK_EQUAL(solved.iterations, 0L);
      CHECK_EQUAL(solved.residual.feasibility, 0.0);
      CHECK_EQUAL(solved.residual.complementarity, 0.0);

      AllContactsKnown source;
      std::vector<double> velocity(7, -1.0);    // of another size before
      const ProjectionResult result =
          project(problem, source, *solver, {TOLERANCE, 10}, 5, host, velocity);
      CHECK(result.status == Status::CONVERGED);
      CHECK_EQUAL(result.rounds, 1);
      CHECK_EQUAL(source.looks, 1);
      CHECK(velocity == problem.predicted_velocity);
      CHECK_EQUAL(largest_eigenvalue(problem, host), 0.0);
    }
  const Residual nothing = residual(nullptr, ContactSet());
  CHECK_EQUAL(nothing.feasibility, 0.0);
  CHECK_EQUAL(nothing.complementarity, 0.0);
}

void test_contact_set()
{
  ContactSet contacts;
  CHECK_EQUAL(contacts.size(), std::size_t{0});
  const double normal[3] = {0.6, 0.0, 0.8};
  contacts.add(3, 5, normal, -0.5, 2.0);
  CHECK_EQUAL(contacts.size(), std::size_t{1});
  CHECK(contacts.first == std::vector<int>{3} && contacts.second == std::vector<int>{5});
  CHECK(contacts.normal == std::vector<double>(normal, normal + 3));
  CHECK(contacts.gap == std::vector<double>{-0.5} && contacts.impulse == std::vector<double>{2.0});
  contacts.clear();
  CHECK_EQUAL(contacts.size(), std::size_t{0});
  CHECK(contacts.first.empty() && contacts.second.empty() && contacts.normal.empty());
  CHECK(contacts.gap.empty() && contacts.impulse.empty());
}

void test_resize_sets_walls_still()
{
  ContactProblem problem;
  for (const int particles : {3, 1, 4, 0})
    for (const int walls : {0, 1, 3}) {
      problem.resize(particles, walls);
      CHECK_EQUAL(problem.particles, particles);
      CHECK_EQUAL(problem.slots(), particles + walls);
      CHECK_EQUAL(problem.inverse_mass.size(), static_cast<std::size_t>(particles + walls));
      CHECK_EQUAL(problem.predicted_velocity.size(), 3 * problem.inverse_mass.size());
      CHECK(!problem.any_wall_moves());
      for (int wall = 0; wall < walls; ++wall) {
        const int slot = problem.slot_of_wall(wall);
        CHECK(problem.is_wall(slot) && !problem.is_mobile(slot));
        for (int d = 0; d < 3; ++d)
          CHECK_EQUAL(problem.predicted_velocity[3 * static_cast<std::size_t>(slot) +
                                                 static_cast<std::size_t>(d)],
                      0.0);
      }
      std::fill(problem.inverse_mass.begin(), problem.inverse_mass.end(), 9.0);
      std::fill(problem.predicted_velocity.begin(), problem.predicted_velocity.end(), 9.0);
    }
}

// Constraints of one colour share nothing that moves, but those of the last one; what nothing moves
// is shared freely.
void test_colours()
{
  constexpr int LAST = ConstraintColours::LAST, MANY = 80, WALL = 2 * MANY;
  std::vector<int> first, second;
  // A chain, a particle in more contacts than there are colours, and a wall in all others.
  for (int k = 0; k + 1 < MANY; ++k) {
    first.push_back(k);
    second.push_back(k + 1);
  }
  for (int k = 0; k < MANY; ++k) {
    first.push_back(MANY);
    second.push_back(k + 1 < MANY ? MANY + 1 + k : WALL);
  }
  for (int k = 0; k < MANY; ++k) {
    first.push_back(MANY + 1 + k);
    second.push_back(WALL);
  }
  std::vector<char> moves(WALL + 1, 1);
  moves[WALL] = 0;
  const ConstraintColours colours(first, second, moves);
  CHECK_EQUAL(colours.size(), first.size());
  std::size_t counted = 0;
  for (int colour = 0; colour <= LAST; ++colour) {
    std::vector<int> used(moves.size(), 0);
    std::size_t count = 0;
    for (std::size_t c = 0; c < first.size(); ++c) {
      if (colours[c] != colour) continue;
      ++count;
      for (const int grain : {first[c], second[c]})
        if (moves[grain] && colour < LAST) CHECK_EQUAL(used[grain]++, 0);
    }
    CHECK_EQUAL(colours.count(colour), count);
    counted += count;
  }
  CHECK_EQUAL(counted, first.size());
  CHECK_EQUAL(colours[0], 0);
  CHECK_EQUAL(colours[1], 1);
  CHECK_EQUAL(colours.count(LAST), static_cast<std::size_t>(MANY - LAST));
  // With a wall alone in common all have the first colour.
  const ConstraintColours of_wall({0, 1, 2}, {3, 3, 3}, {1, 1, 1, 0});
  CHECK_EQUAL(of_wall.count(0), std::size_t{3});
}

void test_residual()
{
  const double gaps[5] = {-0.1, 0.2, 0.3, 0.5, 0.4};
  const double impulses[5] = {0.0, 0.0, 1.0, -2.0, -1.0}, least[5] = {0.0, 0.0, 0.0, -2.0, -2.0};
  const double normal[3] = {0.0, 0.0, 1.0};
  ContactSet contacts;
  const auto add = [&](int c) {
    contacts.add(0, 1, normal, 0.0, impulses[c], 0.0, AdmissibleSet<double>::pulls(-least[c]));
    return residual(gaps, contacts);
  };
  add(0);
  CHECK_EQUAL(add(1).complementarity, 0.0);
  const Residual pushing = add(2);
  CHECK_EQUAL(pushing.feasibility, 0.1);
  CHECK_EQUAL(pushing.complementarity, 0.3);
  // A contact that pulls as much as it may has let go.
  CHECK_EQUAL(add(3).complementarity, 0.3);
  const Residual held = add(4);
  CHECK_EQUAL(held.feasibility, 0.4);
  CHECK_EQUAL(held.complementarity, 0.4);
}

void test_gap_operator()
{
  SerialHost host;
  GapOperator gap_operator;    // one for scenes with and without bodies
  for (ContactProblem problem :
       {make_crystal(3), make_crystal_of_bodies(), make_crystal_of_bodies(), make_crystal(4)}) {
    for (double &inverse_mass : problem.inverse_mass) inverse_mass *= 0.7;
    for (std::size_t c = 0; c < problem.contacts.size(); ++c)
      problem.contacts.impulse[c] = 0.1 * static_cast<double>(c % 7);
    gap_operator.prepare(problem);
    CHECK_ALL_NEAR(gap_operator.free_gap(), gaps_of(problem, problem.predicted_velocity), ROUNDING);
    std::vector<double> gaps(problem.contacts.size());
    gap_operator.apply(problem, problem.contacts.impulse.data(), gaps.data(), host);
    CHECK_ALL_NEAR(gaps, gaps_of(problem, velocity_of(problem)), ROUNDING);
    std::vector<double> velocity(problem.predicted_velocity.size());
    gap_operator.velocity(problem, problem.contacts.impulse.data(), velocity.data(), host);
    CHECK_ALL_NEAR(velocity, velocity_of(problem), ROUNDING);
  }
}

void test_rigid_bodies()
{
  constexpr double NOT_READ = std::numeric_limits<double>::quiet_NaN();
  constexpr double UNTOUCHED = 7.0;
  RigidBodies bodies;
  CHECK(bodies.empty());
  for (int round = 0; round < 2; ++round) {    // the second finds nothing left of the first
    // An angle of particles 3, 1 and 4, of which 5 and 7 are copies of 1 and 0 of 4; a rod of
    // 6 and 8.
    bodies.clear(9);
    CHECK(bodies.empty());
    const int angle[6] = {3, 1, 4, 5, 7, 0};
    std::vector<double> arms(ANGLE_ARMS, ANGLE_ARMS + 9);
    for (const int original : {1, 1, 2})
      arms.insert(arms.end(), ANGLE_ARMS + 3 * original, ANGLE_ARMS + 3 * original + 3);
    bodies.add(angle, arms.data(), 6, 3, 1.0 / 3.0, ANGLE_INVERSE_INERTIA);
    CHECK(!bodies.empty());
    const int rod[2] = {6, 8};
    bodies.add(rod, ROD_ARMS, 2, 2, 0.5, ROD_INVERSE_INERTIA);
    CHECK_EQUAL(bodies.size(), std::size_t{2});
    CHECK(bodies.body == std::vector<int>({0, 0, -1, 0, 0, 0, 1, 0, 1}));
    for (std::size_t k = 0; k < bodies.member.size(); ++k)
      CHECK_EQUAL(bodies.place[static_cast<std::size_t>(bodies.member[k])], static_cast<int>(k));

    // The corner of the angle moves on its own; its ends do not move.
    std::vector<double> moved(27, 0.0);
    for (const std::size_t copy : {5, 7, 0}) std::fill_n(&moved[3 * copy], 3, NOT_READ);
    std::fill_n(&moved[6], 3, UNTOUCHED);
    moved[3 * 3 + 2] = 2.0;
    // Both ends of the rod, in opposite directions: it turns at 1/2 of a moment of 3.
    moved[3 * 6 + 1] = -3.0;
    moved[3 * 8 + 1] = 3.0;
    bodies.velocity_change(moved.data());
    std::vector<double> expected(27, 0.0);
    std::fill_n(&expected[6], 3, UNTOUCHED);
    expected[3 * 3 + 2] = 2.0;
    expected[3 * 6 + 1] = -3.0;
    expected[3 * 8 + 1] = 3.0;
    CHECK_ALL_NEAR(moved, expected, ROUNDING);

    // A unit impulse along any direction: copies move like their originals.
    const double direction[3] = {0.6, -0.48, 0.64};
    for (const std::size_t original : {3, 1, 4, 6, 8}) {
      std::fill(moved.begin(), moved.end(), 0.0);
      std::copy_n(direction, 3, &moved[3 * original]);
      bodies.velocity_change(moved.data());
      const double along = direction[0] * moved[3 * original] +
          direction[1] * moved[3 * original + 1] + direction[2] * moved[3 * original + 2];
      CHECK_NEAR(bodies.mobility(static_cast<int>(original), direction), along, ROUNDING);
      CHECK(std::equal(&moved[3], &moved[3] + 3, &moved[15]));
      CHECK(std::equal(&moved[3], &moved[3] + 3, &moved[21]));
      CHECK(std::equal(&moved[12], &moved[12] + 3, &moved[0]));
    }
    CHECK_EQUAL(bodies.mobility(5, direction), bodies.mobility(1, direction));
    CHECK_EQUAL(bodies.mobility(0, direction), bodies.mobility(4, direction));
  }
}

void test_mobility()
{
  ContactProblem problem = make_problem(std::vector<double>(9, 0.0), {0.25, 9.0, 9.0});
  CHECK_EQUAL(problem.mobility(0, UP), 0.25);
  CHECK_EQUAL(problem.mobility(3, UP), 0.0);    // a wall
  problem.bodies.clear(3);
  const int members[2] = {1, 2};
  problem.bodies.add(members, ROD_ARMS, 2, 2, 0.5, ROD_INVERSE_INERTIA);
  const double across[3] = {0.6, 0.8, 0.0};
  CHECK_EQUAL(problem.mobility(0, UP), 0.25);
  CHECK_EQUAL(problem.mobility(3, UP), 0.0);
  CHECK_NEAR(problem.mobility(1, UP), 0.5, ROUNDING);
  CHECK_NEAR(problem.mobility(2, across), 1.0, ROUNDING);
}

void test_sphere_falling_on_the_floor()
{
  SerialHost host;
  for (const std::string &name : SOLVERS) {
    ContactProblem problem = make_problem({0.5, 0.0, -3.0}, {0.5});
    add_contact(problem, 0, WALL, UP, 0.01);
    const SolverResult result = make_solver(name)->solve(problem, {TOLERANCE, 1000}, host);
    CHECK(result.status == Status::CONVERGED);
    // m (-gap / h - v), to the tolerance over the step, times the mass.
    CHECK_NEAR(problem.contacts.impulse[0], 4.0, 2.0 * TOLERANCE / TIMESTEP);
  }
}

// A lid that rests on a column adds its weight to every contact, and carries its own.
void test_lid_on_a_column()
{
  constexpr int COUNT = 6;
  SerialHost host;
  for (const std::string &name : SOLVERS) {
    ContactProblem problem = make_column_under_lid(COUNT);
    const auto solver = make_solver(name);
    const SolverResult result = solver->solve(problem, {1.0e-12, 100000}, host);
    CHECK(result.status == Status::CONVERGED);
    std::vector<double> expected = column_weights(COUNT);
    for (double &weight : expected) weight += 0.1 * LID_MASS;
    expected.push_back(0.1 * LID_MASS);
    // A residual of 1e-12 at each of seven contacts in series, over h^2 of 1e-4 and the masses.
    CHECK_ALL_NEAR(problem.contacts.impulse, expected, 1.0e-7);
    std::vector<double> velocity(problem.predicted_velocity.size());
    solver->gap_operator().velocity_applied(problem, velocity.data());
    CHECK_ALL_NEAR(velocity, std::vector<double>(velocity.size(), 0.0), 1.0e-8);
  }
}

// A sphere that meets a free wall shares its momentum with it.
void test_sphere_meets_a_free_wall()
{
  SerialHost host;
  for (const std::string &name : SOLVERS) {
    ContactProblem problem = make_problem({0.0, 0.0, -1.0}, {1.0});
    problem.inverse_mass.back() = 0.25;
    problem.contacts.add(0, problem.slot_of_wall(0), UP, 0.0, 0.0);
    const auto solver = make_solver(name);
    solver->solve(problem, {1.0e-13, 100000}, host);
    std::vector<double> velocity(problem.predicted_velocity.size());
    solver->gap_operator().velocity(problem, problem.contacts.impulse.data(), velocity.data(),
                                    host);
    // The residual over h.
    CHECK_ALL_NEAR(velocity, (std::vector<double>{0.0, 0.0, -0.2, 0.0, 0.0, -0.2}), 1.0e-11);
  }
}

void test_frozen_particle()
{
  SerialHost host;
  for (const std::string &name : SOLVERS) {
    ContactProblem problem = make_problem({0.0, 0.0, -1.0, 0.0, 0.0, 0.5}, {1.0, 0.0});
    add_contact(problem, 0, 1, UP, 0.0);
    AllContactsKnown source;
    std::vector<double> velocity;
    const auto solver = make_solver(name);
    project(problem, source, *solver, {TOLERANCE, 1000}, 1, host, velocity);
    CHECK_ALL_NEAR(velocity, std::vector<double>({0.0, 0.0, 0.5, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0}),
                   TOLERANCE / TIMESTEP);
  }
}

void test_column()
{
  SerialHost host;
  constexpr int COUNT = 8;
  for (const std::string &name : SOLVERS) {
    ContactProblem problem = make_column(COUNT, true);
    const SolverResult result = make_solver(name)->solve(problem, {TOLERANCE, 10000}, host);
    CHECK(result.status == Status::CONVERGED);
    CHECK_AT_MOST(result.residual.feasibility, TOLERANCE);
    // Relative velocities add up to velocities, and those to impulses.
    CHECK_ALL_NEAR(problem.contacts.impulse, column_weights(COUNT),
                   COUNT * COUNT * TOLERANCE / TIMESTEP);
  }
}

void test_crystal(const ContactProblem &crystal)
{
  SerialHost host;
  std::vector<double> other_solver;
  for (const std::string &name : SOLVERS) {
    ContactProblem problem = crystal;
    const SolverResult result = make_solver(name)->solve(problem, {TOLERANCE, 10000}, host);
    CHECK(result.status == Status::CONVERGED);
    const std::vector<double> gaps = gaps_of(problem, velocity_of(problem));
    const Residual worst = residual(gaps.data(), problem.contacts);
    CHECK_AT_MOST(worst.feasibility, TOLERANCE + ROUNDING * TIMESTEP);
    CHECK_AT_MOST(worst.complementarity, TOLERANCE + ROUNDING * TIMESTEP);
    CHECK_NEAR(result.residual.feasibility, worst.feasibility, ROUNDING * TIMESTEP);
    CHECK_NEAR(result.residual.complementarity, worst.complementarity, ROUNDING * TIMESTEP);
    for (const double impulse : problem.contacts.impulse) CHECK(impulse >= 0.0);
    // Two answers differ by a few times the tolerance over the step along each of 100 contacts.
    if (!other_solver.empty())
      CHECK_ALL_NEAR(velocity_of(problem), other_solver, 100.0 * TOLERANCE / TIMESTEP);
    other_solver = velocity_of(problem);
  }
}

// Sweeps alone, which work in single precision: what they find is refined until double precision
// takes it, to a part of 1e-9 of the gaps at the start.
void test_sweeps_refine_what_they_find(const ContactProblem &crystal)
{
  SerialHost host;
  SearchChain::Searches searches;
  searches.push_back(std::make_unique<ColouredSweeps>());
  SearchChain sweeps(std::move(searches));
  ContactProblem problem = crystal;
  const SolverResult result = sweeps.solve(problem, {TOLERANCE, 10000}, host);
  CHECK(result.status == Status::CONVERGED);
  const std::vector<double> gaps = gaps_of(problem, velocity_of(problem));
  CHECK_AT_MOST(residual(gaps.data(), problem.contacts).largest(), TOLERANCE + ROUNDING * TIMESTEP);
}

void test_iteration_limit()
{
  SerialHost host;
  for (const std::string &name : SOLVERS)
    for (const long limit : {0L, 1L, 5L}) {
      ContactProblem problem = make_crystal(3);
      const SolverResult result = make_solver(name)->solve(problem, {TOLERANCE, limit}, host);
      CHECK(result.status == Status::OUT_OF_ITERATIONS);
      CHECK_EQUAL(result.iterations, limit);
    }
}

// A residual of 1/n falls by half from a half of the iterations on, and one that stays does not.
void test_residual_trend()
{
  for (const long last : {4L, 7L, 8L, 100L, 1023L}) {
    ResidualTrend falling, staying;
    for (long k = 1; k <= last; ++k) {
      falling.see(k, 1.0 / static_cast<double>(k));
      staying.see(k, k % 2 == 0 ? 1.0 : 2.0);
    }
    CHECK_NEAR(falling.least(), 1.0 / static_cast<double>(last), ROUNDING);
    CHECK_AT_MOST(falling.least(), 0.5 * falling.earlier());
    CHECK_AT_MOST(falling.earlier(), 4.0 * falling.least());
    CHECK_EQUAL(staying.least(), 1.0);
    CHECK_EQUAL(staying.earlier(), 1.0);
  }
  ResidualTrend short_one;
  short_one.see(1, 1.0);
  CHECK(std::isinf(short_one.earlier()));
}

// A floor and a ceiling that a column cannot be between: the overlap is shared by all its contacts.
// The same with a body, of half of its particles.
void test_no_room()
{
  SerialHost host;
  constexpr int COUNT = 6;
  constexpr double MISSING = 0.07;
  constexpr double REACH = 10.0;
  const double down[3] = {0.0, 0.0, -1.0};
  for (const std::string &name : SOLVERS)
    for (const bool joined : {false, true}) {
      ContactProblem problem = make_column(COUNT, true);
      problem.contacts.add(COUNT - 1, problem.slot_of_wall(0), down, -MISSING, 0.0);
      if (joined) {
        const int members[1] = {2};
        const double arm[3] = {}, inertia[6] = {1.0, 1.0, 1.0, 0.0, 0.0, 0.0};
        problem.bodies.clear(problem.particles);
        problem.bodies.add(members, arm, 1, 1, problem.inverse_mass[2], inertia);
      }
      const auto solver = make_solver(name);
      ContactProblem feasible = problem;
      feasible.contacts.gap.back() = MISSING;
      CHECK(solver->solve(feasible, {TOLERANCE, 100000, REACH}, host).status != Status::INFEASIBLE);
      AllContactsKnown source;
      std::vector<double> velocity;
      const ProjectionResult result =
          project(problem, source, *solver, {TOLERANCE, 100000, REACH}, 10, host, velocity);
      CHECK(result.status == Status::INFEASIBLE);
      CHECK(result.iterations < 100000);
      CHECK(result.worst < problem.contacts.size());
      CHECK_NEAR(result.worst_gap, -MISSING / (COUNT + 1), 0.1 * MISSING);
    }
}

// The weights of this column are so large that their round-off, as a length, is above the
// tolerance.
void test_tolerance_below_round_off()
{
  SerialHost host;
  ContactProblem problem = make_column(6, true);
  for (double &velocity : problem.predicted_velocity) velocity *= 1.0e8;
  const SolverResult result = make_solver("apgd")->solve(problem, {TOLERANCE, 100000}, host);
  CHECK(result.status == Status::ROUND_OFF);
  CHECK(result.iterations < 100000);
  CHECK_ABOVE(result.round_off, TOLERANCE);
}

void test_numbers_that_are_not_finite()
{
  SerialHost host;
  for (const std::string &name : SOLVERS)
    for (const double value :
         {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
      ContactProblem problem = make_column(3, true);
      problem.predicted_velocity[5] = value;
      AllContactsKnown source;
      std::vector<double> velocity;
      const auto solver = make_solver(name);
      const ProjectionResult result =
          project(problem, source, *solver, {TOLERANCE, 1000}, 10, host, velocity);
      CHECK(result.status == Status::NOT_FINITE);
      CHECK(std::isinf(result.residual.feasibility));
    }
}

void test_status_of_two_projections()
{
  CHECK(worse(Status::CONVERGED, Status::CONVERGED) == Status::CONVERGED);
  for (const Status failure : {Status::OUT_OF_ROUNDS, Status::OUT_OF_ITERATIONS, Status::ROUND_OFF,
                               Status::NOT_FINITE, Status::INFEASIBLE}) {
    CHECK(worse(Status::CONVERGED, failure) == failure);
    CHECK(worse(failure, Status::CONVERGED) == failure);
    CHECK(worse(failure, Status::INFEASIBLE) == Status::INFEASIBLE);
    CHECK(worse(Status::INFEASIBLE, failure) == Status::INFEASIBLE);
  }
}

// One solver for steps with other numbers of particles and contacts, as in a run.
void test_solver_is_used_again()
{
  SerialHost host;
  for (const std::string &name : SOLVERS) {
    const auto solver = make_solver(name);
    for (const int count : {5, 1, 0, 12, 3}) {
      ContactProblem problem = make_column(count, true);
      CHECK(solver->solve(problem, {TOLERANCE, 10000}, host).status == Status::CONVERGED);
      CHECK_ALL_NEAR(problem.contacts.impulse, column_weights(count),
                     count * count * TOLERANCE / TIMESTEP + ROUNDING);
    }
  }
}

void test_first_guess()
{
  SerialHost host;
  ContactProblem problem = make_column(5, true);
  problem.contacts.impulse = column_weights(5);
  CHECK_EQUAL(make_solver("apgd")->solve(problem, {TOLERANCE, 1000}, host).iterations, 0L);
  CHECK_ABOVE(make_solver("uzawa")->solve(problem, {TOLERANCE, 1000}, host).iterations, 0L);
}

void test_largest_eigenvalue()
{
  SerialHost host;
  ContactProblem problem = make_problem(std::vector<double>(9, 1.0), {1.0, 1.0, 1.0});
  add_contact(problem, 1, 0, UP, 0.3);
  add_contact(problem, 2, 1, UP, 0.3);
  // h [[2, -1], [-1, 2]], to about 1e-3.
  CHECK_NEAR(largest_eigenvalue(problem, host), 3.0 * TIMESTEP, 2.0e-3 * 3.0 * TIMESTEP);
}

void test_names_of_solvers()
{
  for (const std::string &name : SOLVERS) CHECK(make_solver(name) != nullptr);
  CHECK(make_solver("") == nullptr);
  CHECK(make_solver("APGD") == nullptr);
}

/* ----------------------------------------------------------------------
   constraints that are found on the way
------------------------------------------------------------------------- */

// Knows all contacts of a problem and hands out those that a velocity violates, with a first guess
// of their impulses.
class HiddenContacts final : public ConstraintSource {
 public:
  explicit HiddenContacts(const ContactProblem &all, double guess = 0.0) :
      all_(all), guess_(guess), known_(all.contacts.size(), false)
  {
  }

  Refined refine(const std::vector<double> &velocity, ContactProblem &problem) override
  {
    CHECK_EQUAL(velocity.size(), 3 * static_cast<std::size_t>(problem.slots()));
    const std::vector<double> gaps = gaps_of(all_, velocity);
    const ContactSet &hidden = all_.contacts;
    long added = 0;
    for (std::size_t c = 0; c < gaps.size(); ++c) {
      if (known_[c] || gaps[c] >= -TOLERANCE) continue;
      problem.contacts.add(hidden.first[c], hidden.second[c], &hidden.normal[3 * c], hidden.gap[c],
                           guess_);
      known_[c] = true;
      ++added;
    }
    return {added, {}, false};
  }

 private:
  ContactProblem all_;
  double guess_;
  std::vector<bool> known_;
};

// A falling column finds its contacts one by one from below: while the lower spheres rest, those
// above still fall side by side.
void test_contacts_are_found_in_rounds()
{
  SerialHost host;
  constexpr int COUNT = 6;
  for (const std::string &name : SOLVERS) {
    ContactProblem problem = make_column(COUNT, false);
    HiddenContacts source(make_column(COUNT, true));
    std::vector<double> velocity;
    const auto solver = make_solver(name);
    const ProjectionResult result =
        project(problem, source, *solver, {TOLERANCE, 100000}, 100, host, velocity);
    CHECK(result.status == Status::CONVERGED);
    CHECK_EQUAL(result.rounds, COUNT + 1);    // the last one finds nothing
    CHECK_ABOVE(result.iterations, long{COUNT - 1});
    CHECK_AT_MOST(result.residual.feasibility, TOLERANCE);
    CHECK_ALL_NEAR(problem.contacts.impulse, column_weights(COUNT),
                   COUNT * COUNT * TOLERANCE / TIMESTEP);
    CHECK_ALL_NEAR(velocity, std::vector<double>(3 * problem.slots(), 0.0),
                   COUNT * TOLERANCE / TIMESTEP);
  }
}

void test_same_answer_as_with_all_contacts()
{
  SerialHost host;
  const ContactProblem all = make_crystal(4);
  std::vector<double> at_once, in_rounds;
  const auto solver = make_solver("apgd");
  ContactProblem complete = all;
  AllContactsKnown nothing_to_add;
  project(complete, nothing_to_add, *solver, {TOLERANCE, 10000}, 10, host, at_once);
  ContactProblem growing = all;
  growing.contacts.clear();
  HiddenContacts source(all);
  const ProjectionResult result =
      project(growing, source, *solver, {TOLERANCE, 10000}, 100, host, in_rounds);
  CHECK(result.status == Status::CONVERGED);
  CHECK_ABOVE(result.rounds, 2);
  CHECK(growing.contacts.size() < all.contacts.size());
  // As in test_crystal.
  CHECK_ALL_NEAR(in_rounds, at_once, 100.0 * TOLERANCE / TIMESTEP);
}

// Hands out hidden contacts; once all are known the gaps of some are others, too. It may say that
// the problem is to be solved anew.
class LaterGaps final : public ConstraintSource {
 public:
  LaterGaps(const ContactProblem &all, bool anew) : hidden_(all), anew_(anew) {}

  Refined refine(const std::vector<double> &velocity, ContactProblem &problem) override
  {
    Refined refined = hidden_.refine(velocity, problem);
    if (refined.number == 0 && !changed_) {
      changed_ = true;
      for (std::size_t c = 0; c < problem.contacts.size(); c += 7) {
        const double by = (c % 2 == 0 ? 1.0 : -1.0) * CHANGE;
        problem.contacts.gap[c] += by;
        refined.gaps.push_back({c, by});
        ++refined.number;
      }
    }
    refined.anew = anew_;
    return refined;
  }

  static constexpr double CHANGE = 0.01;

 private:
  HiddenContacts hidden_;
  bool anew_, changed_ = false;
};

// A solve that goes on from the last one, with new constraints and other gaps, ends where one does
// that begins anew.
void test_rounds_go_on()
{
  SerialHost host;
  SolverLimits limits = {TOLERANCE, 100000};
  limits.accuracy = 1.0e-6;
  const ContactProblem all = make_crystal(4);
  std::vector<double> velocity[2];
  for (const bool anew : {false, true}) {
    const auto solver = make_solver("sweeps");
    ContactProblem growing = all;
    growing.contacts.clear();
    LaterGaps source(all, anew);
    const ProjectionResult result =
        project(growing, source, *solver, limits, 100, host, velocity[anew]);
    CHECK(result.status == Status::CONVERGED);
    CHECK(result.accurate);
    CHECK_ALL_NEAR(velocity[anew], velocity_of(growing), ROUNDING);
    CHECK_ABOVE(result.rounds, 3);
  }
  CHECK(velocity[0] != velocity[1]);    // the last bits tell that they went two ways
  // As in test_crystal.
  CHECK_ALL_NEAR(velocity[0], velocity[1], 100.0 * TOLERANCE / TIMESTEP);
}

// Sweeps have solved an earlier problem. The first round of this one is solved without them, by the
// first guess where nothing is known, or in double precision where the first guess is far off.
// What is added then is not put to what they hold, which is of the earlier problem.
void test_rounds_begin_with_their_own_problem(bool far_off)
{
  SerialHost host;
  const ContactProblem all = make_crystal(4);
  ContactProblem beginning = all;
  beginning.contacts.clear();
  // [momentum] 1e3 of what the crystal has; 1e13 tolerances as a length.
  if (far_off) {
    add_contact(beginning, 0, WALL, UP, 0.0);
    beginning.contacts.impulse[0] = 1.0e4;
  }
  std::vector<double> velocity[2];
  long iterations[2];
  for (const bool used : {false, true}) {
    const auto solver = make_solver("sweeps");
    if (used) {
      ContactProblem earlier = make_column(6, true);
      const SolverResult solved = solver->solve(earlier, {TOLERANCE, 1000}, host);
      CHECK(solved.status == Status::CONVERGED);
      CHECK_ABOVE(solved.iterations, 0L);
    }
    ContactProblem growing = beginning;
    HiddenContacts source(all);
    const ProjectionResult result =
        project(growing, source, *solver, {TOLERANCE, 100000}, 100, host, velocity[used]);
    CHECK(result.status == Status::CONVERGED);
    CHECK_ABOVE(result.rounds, 2);
    iterations[used] = result.iterations;
  }
  CHECK_EQUAL(iterations[1], iterations[0]);
  CHECK(velocity[1] == velocity[0]);
}

void test_round_limit()
{
  SerialHost host;
  const auto solver = make_solver("apgd");
  for (const int limit : {1, 3}) {
    ContactProblem problem = make_column(6, false);
    HiddenContacts source(make_column(6, true), 1.0);
    std::vector<double> velocity;
    const ProjectionResult result =
        project(problem, source, *solver, {TOLERANCE, 100000}, limit, host, velocity);
    CHECK_EQUAL(result.rounds, limit);
    // The contacts that were found last have a first guess, which has pushed nobody.
    CHECK_ALL_NEAR(velocity, velocity_of(problem), ROUNDING);
    CHECK(result.status == Status::OUT_OF_ROUNDS);
    CHECK_ABOVE(result.residual.feasibility, TOLERANCE);    // of what was found and not solved
    CHECK_EQUAL(velocity.size(), std::size_t{21});          // of six particles and a wall
  }
}

void test_iterations_of_all_rounds_are_limited()
{
  SerialHost host;
  const auto solver = make_solver("apgd");
  ContactProblem problem = make_column(6, false);
  HiddenContacts source(make_column(6, true), 1.0);
  std::vector<double> velocity;
  const ProjectionResult result =
      project(problem, source, *solver, {TOLERANCE, 40}, 100, host, velocity);
  CHECK_EQUAL(result.iterations, 40L);
  CHECK(result.status == Status::OUT_OF_ITERATIONS);
  // The last round still found a contact, whose first guess has pushed nobody.
  CHECK_EQUAL(problem.contacts.impulse.back(), 0.0);
  // The velocities are those of the impulses reached.
  CHECK_ALL_NEAR(velocity, velocity_of(problem), ROUNDING);
}

// A particle inside a round pipe of radius 1 about the z axis, linearised about where it ends up.
class Pipe final : public ConstraintSource {
 public:
  Pipe(double x, double y) : x_(x), y_(y) {}

  Refined refine(const std::vector<double> &velocity, ContactProblem &problem) override
  {
    const double x = x_ + TIMESTEP * velocity[0], y = y_ + TIMESTEP * velocity[1];
    const double from_axis = std::hypot(x, y);
    overlap = from_axis - 1.0;
    if (overlap <= TOLERANCE) return {};
    const double normal[3] = {-x / from_axis, -y / from_axis, 0.0};
    // So that gap + h n . V is the true gap for this velocity.
    const double gap = -overlap - TIMESTEP * (normal[0] * velocity[0] + normal[1] * velocity[1]);
    problem.contacts.clear();
    problem.contacts.add(0, problem.particles, normal, gap, 0.0);
    return {1, {}, true};
  }

  double overlap = 0.0;

 private:
  double x_, y_;
};

void test_concave_wall_is_linearised_again()
{
  SerialHost host;
  for (const std::string &name : SOLVERS) {
    ContactProblem problem = make_problem({30.0, 40.0, 1.0}, {0.5});
    const double inwards[3] = {-1.0, 0.0, 0.0};
    add_contact(problem, 0, WALL, inwards, 0.2);    // the pipe as seen from the start
    Pipe pipe(0.8, 0.0);
    std::vector<double> velocity;
    const auto solver = make_solver(name);
    const ProjectionResult result =
        project(problem, pipe, *solver, {TOLERANCE, 10000}, 50, host, velocity);
    CHECK(result.status == Status::CONVERGED);
    CHECK_ABOVE(result.rounds, 2);
    CHECK_AT_MOST(pipe.overlap, TOLERANCE);
    // The nearest point of the pipe to (0.8 + 0.3, 0.4). An error along the wall shows in the
    // overlap only squared: the root of the tolerance, over the step.
    const double distance = std::hypot(1.1, 0.4);
    const double accuracy = std::sqrt(2.0 * TOLERANCE) / TIMESTEP;
    CHECK_ALL_NEAR(velocity,
                   std::vector<double>({(1.1 / distance - 0.8) / TIMESTEP,
                                        0.4 / distance / TIMESTEP, 1.0, 0.0, 0.0, 0.0}),
                   accuracy);
  }
}

/* ----------------------------------------------------------------------
   several ranks: threads, each with a part of the problem and copies of others' particles
------------------------------------------------------------------------- */

// Which particles a rank has: owned ones first, then copies.
struct Share {
  std::vector<int> particles;
  int owned = 0;
};

class Ranks {
 public:
  Ranks(std::vector<Share> shares, int particles) :
      shares_(std::move(shares)), particles_(particles), arrays_(shares_.size())
  {
  }

  static constexpr auto PATIENCE = std::chrono::seconds(20);

  int rank_colours = 2;    // of Host::rank_colours

  struct Arrays {
    double *per_particle = nullptr;
    int numbers = 3;    // per particle
    double *sums = nullptr, *maxima = nullptr;
    int number_of_sums = 0, number_of_maxima = 0;
    const std::vector<char> *chosen = nullptr;    // copies that count; null = all
  };

  // Waits until every rank has made the same call, then does it for all of them.
  void call(const std::string &name, std::size_t rank, const Arrays &arrays,
            const std::function<void(Ranks &)> &exchange)
  {
    std::unique_lock<std::mutex> lock(mutex_);
    arrays_[rank] = arrays;
    if (waiting_ == 0)
      calls.push_back(name);
    else if (calls.back() != name)
      give_up("one rank calls " + calls.back() + ", another " + name);
    if (++waiting_ == static_cast<int>(shares_.size())) {
      exchange(*this);
      waiting_ = 0;
      ++exchanges_;
      all_here_.notify_all();
      return;
    }
    const long mine = exchanges_;
    if (!all_here_.wait_for(lock, PATIENCE, [&] {
          return exchanges_ > mine;
        }))
      give_up("one rank waits in " + name + " for the others");
  }

  void sum_over_ghosts()
  {
    std::vector<double> sums(arrays_[0].numbers * static_cast<std::size_t>(particles_), 0.0);
    for_each_value(false, [&](double &mine, std::size_t k) {
      sums[k] += mine;
    });
    for_each_value(false, [&](double &mine, std::size_t k) {
      mine = sums[k];
    });
  }

  void choose_ghosts() {}    // every host keeps its own choice

  void share_with_ghosts()
  {
    std::vector<double> owned(arrays_[0].numbers * static_cast<std::size_t>(particles_), 0.0);
    for_each_value(true, [&](double &mine, std::size_t k) {
      owned[k] = mine;
    });
    for_each_value(false, [&](double &mine, std::size_t k) {
      mine = owned[k];
    });
  }

  void reduce()
  {
    for (int k = 0; k < arrays_[0].number_of_sums; ++k) {
      double sum = 0.0;
      for (const Arrays &rank : arrays_) sum += rank.sums[k];
      for (const Arrays &rank : arrays_) rank.sums[k] = sum;
    }
    for (int k = 0; k < arrays_[0].number_of_maxima; ++k) {
      double most = arrays_[0].maxima[k];
      for (const Arrays &rank : arrays_) most = std::max(most, rank.maxima[k]);
      for (const Arrays &rank : arrays_) rank.maxima[k] = most;
    }
  }

  // What a rank has sent, with the slots that it is of.
  struct Message {
    std::vector<char> chosen;
    std::vector<float> values;
  };

  void send(std::size_t rank, const Message &message)
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (std::size_t to = 0; to < shares_.size(); ++to) sent_[{rank, to}].push_back(message);
    somebody_sent_.notify_all();
  }

  Message receive(std::size_t from, std::size_t rank)
  {
    std::unique_lock<std::mutex> lock(mutex_);
    std::deque<Message> &messages = sent_[{from, rank}];
    if (!somebody_sent_.wait_for(lock, PATIENCE, [&] {
          return !messages.empty();
        }))
      give_up("one rank waits for what another tells");
    Message message = messages.front();
    messages.pop_front();
    return message;
  }

  const std::vector<Share> &shares() const { return shares_; }

  std::vector<std::string> calls;    // each once, not once per rank

 private:
  void for_each_value(bool owned_only, const std::function<void(double &, std::size_t)> &visit)
  {
    for (std::size_t rank = 0; rank < shares_.size(); ++rank) {
      const Share &share = shares_[rank];
      const std::size_t count = owned_only ? static_cast<std::size_t>(share.owned)
                                           : share.particles.size();
      const std::vector<char> *const chosen = arrays_[rank].chosen;
      for (std::size_t i = 0; i < count; ++i) {
        if (chosen && i >= static_cast<std::size_t>(share.owned) && !(*chosen)[i]) continue;
        const auto numbers = static_cast<std::size_t>(arrays_[rank].numbers);
        for (std::size_t d = 0; d < numbers; ++d)
          visit(arrays_[rank].per_particle[numbers * i + d],
                numbers * static_cast<std::size_t>(share.particles[i]) + d);
      }
    }
  }

  // The other threads wait for ever: nothing can be tidied up.
  [[noreturn]] static void give_up(const std::string &reason)
  {
    std::cerr << "core_test.cpp: " << reason << std::endl;
    std::_Exit(1);
  }

  std::vector<Share> shares_;
  int particles_;
  std::vector<Arrays> arrays_;
  std::mutex mutex_;
  std::condition_variable all_here_, somebody_sent_;
  std::map<std::pair<std::size_t, std::size_t>, std::deque<Message>> sent_;    // by from and to
  int waiting_ = 0;
  long exchanges_ = 0;
};

class RankHost final : public Host {
 public:
  RankHost(Ranks &ranks, std::size_t rank) : ranks_(ranks), rank_(rank) {}

  void sum_over_ghosts(double *per_particle, int numbers) override
  { sum(per_particle, numbers, numbers, nullptr); }

  bool has_ghosts() const override { return true; }
  int rank_colours() const override { return ranks_.rank_colours; }
  int rank_colour() const override { return static_cast<int>(rank_) % ranks_.rank_colours; }
  void choose_ghosts(const std::vector<char> &chosen) override
  {
    chosen_ = chosen;
    ranks_.call("choose_ghosts", rank_, {}, &Ranks::choose_ghosts);
  }
  void sum_over_chosen_ghosts(double *per_particle) override { sum(per_particle, 4, 3, &chosen_); }
  void sum_over_chosen_ghosts(float *per_particle) override { sum(per_particle, 4, 3, &chosen_); }

  void choose_shared(const std::vector<char> &chosen, bool images) override
  {
    sent_ = chosen;
    images_ = images;
    ranks_.call("choose_shared", rank_, {}, &Ranks::choose_ghosts);
  }

  void send(const float *per_particle) override
  { ranks_.send(rank_, {sent_, {per_particle, per_particle + 4 * sent_.size()}}); }

  void receive(int colour, float *per_particle) override
  {
    const std::vector<Share> &shares = ranks_.shares();
    for (std::size_t from = 0; from < shares.size(); ++from) {
      if (static_cast<int>(from) % ranks_.rank_colours != colour) continue;
      const Ranks::Message message = ranks_.receive(from, rank_);
      if (from == rank_ && !images_) continue;
      for (std::size_t i = 0; i < shares[rank_].particles.size(); ++i)
        for (std::size_t k = 0; sent_[i] && k < shares[from].particles.size(); ++k) {
          if (!message.chosen[k] || shares[from].particles[k] != shares[rank_].particles[i])
            continue;
          if (from == rank_ && k == i) continue;
          for (std::size_t d = 0; d < 3; ++d) per_particle[4 * i + d] += message.values[4 * k + d];
        }
    }
  }

  void sum_over_ranks(double *of_walls, int count) override
  {
    const Ranks::Arrays arrays = {nullptr, 0, of_walls, nullptr, count, 0};
    ranks_.call("sum_over_ranks", rank_, arrays, &Ranks::reduce);
  }

  void share_with_ghosts(double *per_particle, int numbers) override
  {
    Ranks::Arrays arrays;
    arrays.per_particle = per_particle;
    arrays.numbers = numbers;
    ranks_.call("share_with_ghosts", rank_, arrays, &Ranks::share_with_ghosts);
  }

  void reduce(double *sums, int number_of_sums, double *maxima, int number_of_maxima) override
  {
    const Ranks::Arrays arrays = {nullptr, 0, sums, maxima, number_of_sums, number_of_maxima};
    ranks_.call("reduce " + std::to_string(number_of_sums) + " sums and " +
                    std::to_string(number_of_maxima) + " maxima",
                rank_, arrays, &Ranks::reduce);
  }

 private:
  template <typename Real>
  void sum(Real *per_particle, int stride, int numbers, const std::vector<char> *chosen)
  {
    const std::size_t count = ranks_.shares()[rank_].particles.size();
    std::vector<double> packed(numbers * count);
    for (std::size_t i = 0; i < count; ++i)
      for (int d = 0; d < numbers; ++d) packed[numbers * i + d] = per_particle[stride * i + d];
    Ranks::Arrays arrays;
    arrays.per_particle = packed.data();
    arrays.numbers = numbers;
    arrays.chosen = chosen;
    ranks_.call("sum_over_ghosts", rank_, arrays, &Ranks::sum_over_ghosts);
    for (std::size_t i = 0; i < count; ++i)
      for (int d = 0; d < numbers; ++d)
        per_particle[stride * i + d] = static_cast<Real>(packed[numbers * i + d]);
  }

  Ranks &ranks_;
  std::size_t rank_;
  std::vector<char> chosen_, sent_;
  bool images_ = false;
};

// The bodies among a rank's particles. The first time that a particle is there counts as the
// original, whoever owns it; a rank has all of a body or nothing.
RigidBodies bodies_of(const RigidBodies &whole, const std::vector<int> &particles)
{
  RigidBodies bodies;
  bodies.clear(static_cast<int>(particles.size()));
  for (std::size_t b = 0; b < whole.size(); ++b) {
    std::vector<int> members;
    std::vector<double> arms;
    int originals = 0;
    for (const bool original : {true, false}) {
      for (int k = whole.start[b]; k < whole.start[b + 1]; ++k) {
        const double *const arm = &whole.arm[3 * static_cast<std::size_t>(k)];
        bool seen = false;
        for (std::size_t l = 0; l < particles.size(); ++l) {
          if (particles[l] != whole.member[static_cast<std::size_t>(k)]) continue;
          if (seen != original) {
            members.push_back(static_cast<int>(l));
            arms.insert(arms.end(), arm, arm + 3);
          }
          seen = true;
        }
      }
      if (original) originals = static_cast<int>(members.size());
    }
    if (members.empty()) continue;
    CHECK_EQUAL(originals, whole.originals[b]);
    bodies.add(members.data(), arms.data(), static_cast<int>(members.size()), originals,
               whole.inverse_mass[b], &whole.inverse_inertia[6 * b]);
  }
  return bodies;
}

// What one rank has of a problem: its particles, the contacts that are given to it, and copies of
// the particles of other ranks that those touch. The copies' velocities come from the host. Where a
// particle is there several times, the last one is in every other contact.
ContactProblem part_of(const ContactProblem &whole, const Share &share,
                       const std::vector<std::size_t> &contacts)
{
  std::vector<int> local(static_cast<std::size_t>(whole.particles), WALL), image = local;
  std::vector<double> velocity, inverse_mass;
  for (std::size_t k = 0; k < share.particles.size(); ++k) {
    const auto i = static_cast<std::size_t>(share.particles[k]);
    if (local[i] == WALL) local[i] = static_cast<int>(k);
    image[i] = static_cast<int>(k);
    const bool owned = k < static_cast<std::size_t>(share.owned);
    for (std::size_t d = 0; d < 3; ++d)
      velocity.push_back(owned ? whole.predicted_velocity[3 * i + d]
                               : std::numeric_limits<double>::quiet_NaN());
    inverse_mass.push_back(whole.inverse_mass[i]);
  }
  ContactProblem part = make_problem(velocity, inverse_mass);
  for (const std::size_t c : contacts) {
    const int second = whole.contacts.second[c];
    const std::vector<int> &here = c % 2 == 0 ? local : image;
    add_contact(part, here[static_cast<std::size_t>(whole.contacts.first[c])],
                second == whole.particles ? WALL : here[static_cast<std::size_t>(second)],
                &whole.contacts.normal[3 * c], whole.contacts.gap[c]);
  }
  if (!whole.bodies.empty()) part.bodies = bodies_of(whole.bodies, share.particles);
  part.inverse_mass.back() = whole.inverse_mass.back();
  std::copy(whole.predicted_velocity.end() - 3, whole.predicted_velocity.end(),
            part.predicted_velocity.end() - 3);
  return part;
}

struct RankOutcome {
  ProjectionResult result;
  std::vector<double> velocity;
};

// Solves on as many ranks as there are shares; contacts[r] are those of rank r, which it knows from
// the start or has to find.
std::vector<RankOutcome> solve_on_ranks(const ContactProblem &whole, Ranks &ranks,
                                        const std::vector<std::vector<std::size_t>> &contacts,
                                        const std::string &solver_name, double tolerance,
                                        bool hide_contacts)
{
  std::vector<RankOutcome> outcomes(ranks.shares().size());
  std::vector<std::thread> threads;
  for (std::size_t rank = 0; rank < outcomes.size(); ++rank)
    threads.emplace_back([&, rank] {
      RankHost host(ranks, rank);
      ContactProblem problem = part_of(whole, ranks.shares()[rank], contacts[rank]);
      host.share_with_ghosts(problem.predicted_velocity.data(), 3);
      const auto solver = make_solver(solver_name);
      RankOutcome &outcome = outcomes[rank];
      if (hide_contacts) {
        HiddenContacts source(problem);
        problem.contacts.clear();
        outcome.result =
            project(problem, source, *solver, {tolerance, 100000}, 100, host, outcome.velocity);
      } else {
        AllContactsKnown source;
        outcome.result =
            project(problem, source, *solver, {tolerance, 100000}, 100, host, outcome.velocity);
      }
    });
  for (std::thread &thread : threads) thread.join();
  return outcomes;
}

std::vector<double> solve_on_one_rank(ContactProblem problem, const std::string &solver_name,
                                      double tolerance)
{
  SerialHost host;
  AllContactsKnown source;
  std::vector<double> velocity;
  const auto solver = make_solver(solver_name);
  project(problem, source, *solver, {tolerance, 100000}, 1, host, velocity);
  return velocity;
}

// All ranks agree on the course of things, and copies on the velocities of their owners.
void check_agreement(const std::vector<RankOutcome> &outcomes, const Ranks &ranks,
                     const std::vector<double> &expected, double bound)
{
  for (std::size_t rank = 0; rank < outcomes.size(); ++rank) {
    const ProjectionResult &mine = outcomes[rank].result, &first = outcomes[0].result;
    CHECK(mine.status == Status::CONVERGED);
    CHECK_EQUAL(mine.iterations, first.iterations);
    CHECK_EQUAL(mine.rounds, first.rounds);
    CHECK_EQUAL(mine.residual.feasibility, first.residual.feasibility);
    CHECK_EQUAL(mine.residual.complementarity, first.residual.complementarity);
    const Share &share = ranks.shares()[rank];
    std::vector<double> expected_here;
    for (const int i : share.particles)
      for (std::size_t d = 0; d < 3; ++d)
        expected_here.push_back(expected[3 * static_cast<std::size_t>(i) + d]);
    const std::ptrdiff_t of_wall = 3;
    expected_here.insert(expected_here.end(), expected.end() - of_wall, expected.end());
    CHECK_ALL_NEAR(outcomes[rank].velocity, expected_here, bound);
    for (std::size_t other = 0; other < outcomes.size(); ++other) {
      const Share &owner = ranks.shares()[other];
      for (std::size_t k = 0; k < share.particles.size(); ++k)
        for (std::size_t o = 0; o < static_cast<std::size_t>(owner.owned); ++o)
          if (owner.particles[o] == share.particles[k])
            CHECK(std::equal(&outcomes[rank].velocity[3 * k], &outcomes[rank].velocity[3 * k] + 3,
                             &outcomes[other].velocity[3 * o]));
    }
  }
}

long count_calls(const Ranks &ranks, const std::string &start)
{
  return std::count_if(ranks.calls.begin(), ranks.calls.end(), [&](const std::string &call) {
    return call.rfind(start, 0) == 0;
  });
}

// Gives every particle i to rank owner(i) and contact c between two ranks to either in turn.
struct Division {
  std::vector<Share> shares;
  std::vector<std::vector<std::size_t>> contacts;
};

Division divide(const ContactProblem &whole, const std::function<int(int)> &owner)
{
  Division division;
  division.shares.resize(2);
  division.contacts.resize(2);
  for (int i = 0; i < whole.particles; ++i) {
    Share &share = division.shares[static_cast<std::size_t>(owner(i))];
    share.particles.push_back(i);
    ++share.owned;
  }
  for (std::size_t c = 0; c < whole.contacts.size(); ++c) {
    const int first = whole.contacts.first[c], second = whole.contacts.second[c];
    const bool wall = second == whole.particles;
    const int rank = wall || c % 2 == 0 ? owner(first) : owner(second);
    division.contacts[static_cast<std::size_t>(rank)].push_back(c);
    std::vector<int> &here = division.shares[static_cast<std::size_t>(rank)].particles;
    for (const int i : {first, wall ? first : second})
      if (std::find(here.begin(), here.end(), i) == here.end()) here.push_back(i);
  }
  return division;
}

// Gives every rank all of the bodies of which it has a part, and another copy of every third
// particle that it has, as over a periodic boundary.
void complete(const RigidBodies &bodies, std::vector<Share> &shares)
{
  for (Share &share : shares) {
    std::vector<int> &here = share.particles;
    for (std::size_t k = 0; k < here.size(); ++k) {    // grows on the way
      const int b = bodies.body[static_cast<std::size_t>(here[k])];
      for (std::size_t m = 0; m < bodies.member.size(); ++m) {
        const int i = bodies.member[m];
        if (b >= 0 && bodies.body[static_cast<std::size_t>(i)] == b &&
            std::find(here.begin(), here.end(), i) == here.end())
          here.push_back(i);
      }
    }
    const std::size_t count = here.size();
    for (std::size_t k = 0; k < count; k += 3) here.push_back(here[k]);
  }
}

// What ranks wait for each other for, however many searches a solver is a chain of. An iteration
// costs one exchange and one reduction, and so does a verdict; a round's first guess costs a
// verdict and a reduction more, and there is one of what the source of contacts has added. The last
// iteration before a verdict may spare its exchange.
void check_calls(const Ranks &ranks, const ProjectionResult &result)
{
  // Verdicts are as dear as iterations, and are to stay few beside them: in these problems `apgd`
  // makes 13 or more of the latter for each (measured).
  constexpr long ITERATIONS_PER_VERDICT = 10;
  const long rounds = result.rounds, iterations = result.iterations;
  const long verdicts = count_calls(ranks, "reduce 0 sums and 5 maxima") - rounds;
  CHECK_AT_MOST(ITERATIONS_PER_VERDICT * verdicts, iterations);
  const long exchanges = count_calls(ranks, "sum_over_ghosts");
  CHECK_AT_MOST(iterations + rounds, exchanges);
  CHECK_AT_MOST(exchanges, iterations + verdicts + rounds);
  CHECK_EQUAL(count_calls(ranks, "reduce"), iterations + verdicts + 3 * rounds);
  CHECK_EQUAL(count_calls(ranks, "reduce 1 sums and 0 maxima"), rounds);
}

// Bodies lie across the ranks, and each rank has some of their particles twice.
void test_bodies_on_two_ranks(double tolerance, int rank_colours)
{
  const double bound = 100.0 * tolerance / TIMESTEP;    // as in test_two_ranks
  const ContactProblem whole = make_crystal_of_bodies();
  const std::vector<std::function<int(int)>> owners = {
      // the rods' ends on two ranks
      [](int i) {
        return i % 2;
      },
      // the angles' ends on two ranks
      [](int i) {
        return i / 16 % 2;
      },
      [](int) {
        return 1;
      },
  };
  for (const std::string &name : SOLVERS)
    for (const auto &owner : owners)
      for (const bool hide_contacts : {false, true}) {
        Division division = divide(whole, owner);
        complete(whole.bodies, division.shares);
        Ranks ranks(division.shares, whole.particles);
        ranks.rank_colours = rank_colours;
        const auto outcomes =
            solve_on_ranks(whole, ranks, division.contacts, name, tolerance, hide_contacts);
        check_agreement(outcomes, ranks, solve_on_one_rank(whole, name, tolerance), bound);
        CHECK_EQUAL(outcomes[0].result.rounds > 1, hide_contacts);
        // Bodies need no exchange of their own.
        if (name == "apgd") check_calls(ranks, outcomes[0].result);
      }
}

void test_two_ranks(double tolerance, int rank_colours)
{
  // Rounding in another order moves the last iteration by no more than the tolerance; along a few
  // contacts that is less than 100 times the tolerance over the step.
  const double bound = 100.0 * tolerance / TIMESTEP;
  const ContactProblem whole = make_crystal(3);
  const std::vector<std::function<int(int)>> owners = {
      // two layers and one
      [](int i) {
        return i / 18;
      },
      // every neighbour is on the other rank
      [](int i) {
        return i % 2;
      },
      // nothing on rank 0
      [](int) {
        return 1;
      },
  };
  for (const std::string &name : SOLVERS)
    for (const auto &owner : owners)
      for (const bool hide_contacts : {false, true}) {
        const Division division = divide(whole, owner);
        Ranks ranks(division.shares, whole.particles);
        ranks.rank_colours = rank_colours;
        const auto outcomes =
            solve_on_ranks(whole, ranks, division.contacts, name, tolerance, hide_contacts);
        check_agreement(outcomes, ranks, solve_on_one_rank(whole, name, tolerance), bound);
        CHECK_EQUAL(outcomes[0].result.rounds > 1, hide_contacts);

        // Only the test itself shares the predicted velocities.
        CHECK_EQUAL(count_calls(ranks, "share_with_ghosts"), 1L);
        if (name == "apgd") check_calls(ranks, outcomes[0].result);
      }
}

// A lid lies on two columns, one on each rank, and half of its weight on each of them.
void test_lid_over_two_ranks()
{
  constexpr int COUNT = 4;
  const double down[3] = {0.0, 0.0, -1.0};
  ContactProblem whole =
      make_problem(std::vector<double>(6 * COUNT, 0.0), std::vector<double>(2 * COUNT, 1.0));
  // The floor is a sphere that is frozen: the only wall is the lid.
  for (const std::string &name : SOLVERS) {
    std::vector<std::vector<std::size_t>> contacts(2);
    std::vector<Share> shares(2);
    whole.contacts.clear();
    for (int i = 0; i < 2 * COUNT; ++i) {
      const auto rank = static_cast<std::size_t>(i / COUNT);
      shares[rank].particles.push_back(i);
      ++shares[rank].owned;
      const bool is_floor = i % COUNT == 0;
      whole.inverse_mass[static_cast<std::size_t>(i)] = is_floor ? 0.0 : 1.0;
      whole.predicted_velocity[3 * static_cast<std::size_t>(i) + 2] = is_floor ? 0.0 : -0.1;
      contacts[rank].push_back(whole.contacts.size());
      if (is_floor)
        whole.contacts.add(i + COUNT - 1, whole.slot_of_wall(0), down, 0.0, 0.0);
      else
        whole.contacts.add(i, i - 1, UP, 0.0, 0.0);
    }
    whole.inverse_mass.back() = 1.0 / LID_MASS;
    whole.predicted_velocity.back() = -0.1;
    Ranks ranks(shares, 2 * COUNT);
    const auto outcomes = solve_on_ranks(whole, ranks, contacts, name, 1.0e-12, false);
    // A residual of 1e-12 at each of four contacts in series, over h, with room for the mass.
    check_agreement(outcomes, ranks, std::vector<double>(whole.predicted_velocity.size(), 0.0),
                    1.0e-8);
  }
}

// No rank has anything at all.
void test_two_ranks_with_nothing()
{
  const ContactProblem nothing = make_problem({}, {});
  for (const std::string &name : SOLVERS) {
    Ranks ranks(std::vector<Share>(2), 0);
    const auto outcomes = solve_on_ranks(nothing, ranks, {{}, {}}, name, TOLERANCE, false);
    check_agreement(outcomes, ranks, nothing.predicted_velocity, 0.0);
  }
}

// One rank whose only copies are periodic images of its own particles: a closed ring of spheres, or
// of pairs of them, can only turn as a whole, at the mean speed.
void test_periodic_images(bool joined)
{
  constexpr int COUNT = 8;
  const double along[3] = {1.0, 0.0, 0.0};
  for (const std::string &name : SOLVERS) {
    Share share;
    std::vector<double> inverse_mass;
    double momentum = 0.0, mass = 0.0;
    for (int i = 0; i < COUNT; ++i) {
      share.particles.push_back(i);
      inverse_mass.push_back(1.0 / (1 + i % 3));
      mass += 1 + i % 3;
      momentum += (1 + i % 3) * 0.1 * (i * i % 5);
    }
    share.owned = COUNT;
    share.particles.push_back(0);    // the image of the first, behind the last
    inverse_mass.push_back(inverse_mass[0]);
    ContactProblem problem = make_problem({}, inverse_mass);
    problem.bodies.clear(problem.particles);
    for (int i = 0; i < COUNT; ++i) {
      problem.predicted_velocity[3 * static_cast<std::size_t>(i)] = 0.1 * (i * i % 5);
      if (!joined || i % 2 == 1) add_contact(problem, i + 1, i, along, 0.0);
    }
    for (int i = 0; joined && i < COUNT; i += 2) {
      const double first = 1 + i % 3, second = 1 + (i + 1) % 3, sum = first + second;
      const double arms[9] = {-second / sum, 0.0,           0.0, first / sum, 0.0,
                              0.0,           -second / sum, 0.0, 0.0};
      const double across = sum / (first * second);
      const double inverse_inertia[6] = {0.0, across, across, 0.0, 0.0, 0.0};
      const int members[3] = {i, i + 1, COUNT};
      problem.bodies.add(members, arms, i == 0 ? 3 : 2, 2, 1.0 / sum, inverse_inertia);
      double *const velocity = &problem.predicted_velocity[3 * static_cast<std::size_t>(i)];
      velocity[0] = velocity[3] = (first * velocity[0] + second * velocity[3]) / sum;
    }
    Ranks ranks({share}, COUNT);
    RankHost host(ranks, 0);
    host.share_with_ghosts(problem.predicted_velocity.data(), 3);
    AllContactsKnown source;
    std::vector<double> velocity;
    const auto solver = make_solver(name);
    const ProjectionResult result =
        project(problem, source, *solver, {TOLERANCE, 100000}, 1, host, velocity);
    CHECK(result.status == Status::CONVERGED);
    std::vector<double> expected;
    for (int i = 0; i <= COUNT; ++i) expected.insert(expected.end(), {momentum / mass, 0.0, 0.0});
    expected.insert(expected.end(), {0.0, 0.0, 0.0});    // the wall
    // Relative velocities add up along the ring, and add up to zero round it.
    CHECK_ALL_NEAR(velocity, expected, COUNT * COUNT * TOLERANCE / TIMESTEP);
  }
}

void test_largest_eigenvalue_on_two_ranks()
{
  const ContactProblem whole = make_crystal_of_bodies();
  SerialHost serial;
  const double expected = largest_eigenvalue(whole, serial);
  Division division = divide(whole, [](int i) {
    return i % 2;
  });
  complete(whole.bodies, division.shares);
  Ranks ranks(division.shares, whole.particles);
  std::array<double, 2> found{};
  std::vector<std::thread> threads;
  for (std::size_t rank = 0; rank < 2; ++rank)
    threads.emplace_back([&, rank] {
      RankHost host(ranks, rank);
      found[rank] =
          largest_eigenvalue(part_of(whole, division.shares[rank], division.contacts[rank]), host);
    });
  for (std::thread &thread : threads) thread.join();
  CHECK_EQUAL(found[0], found[1]);
  CHECK_NEAR(found[0], expected, 2.0e-3 * expected);    // both to about 1e-3
}

/* ----------------------------------------------------------------------
   random numbers
------------------------------------------------------------------------- */

// Random123's tests/kat_vectors, lines "philox4x32 10".
void test_philox_known_answers()
{
  using Words = std::array<std::uint32_t, 4>;
  CHECK((philox({0, 0, 0, 0}, {0, 0}) == Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  CHECK((philox({0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, {0xffffffff, 0xffffffff}) ==
         Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  CHECK((philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}) ==
         Words{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

void test_uniform_vector()
{
  for (std::uint64_t k = 0; k < 1000; ++k)
    for (const double value : uniform_vector(3, k << 40, ~k)) CHECK(std::abs(value) <= 1.0);
  CHECK(uniform_vector(1, 2, 3) == uniform_vector(1, 2, 3));
  CHECK(uniform_vector(1, 2, 3) != uniform_vector(2, 2, 3));
  CHECK(uniform_vector(1, 2, 3) != uniform_vector(1, 3, 2));
  CHECK(uniform_vector(1, 2, 3) != uniform_vector(1, 2 + (std::uint64_t{1} << 32), 3));
  CHECK(uniform_vector(1, 2, 3) != uniform_vector(1, 2, 3 + (std::uint64_t{1} << 32)));
}

}    // namespace

int main()
{
  test_empty_problems();
  test_contact_set();
  test_resize_sets_walls_still();
  test_colours();
  test_residual();
  test_gap_operator();
  test_rigid_bodies();
  test_mobility();
  test_sphere_falling_on_the_floor();
  test_lid_on_a_column();
  test_sphere_meets_a_free_wall();
  test_frozen_particle();
  test_column();
  test_crystal(make_crystal(4));
  test_crystal(make_crystal_of_bodies());
  test_sweeps_refine_what_they_find(make_crystal(4));
  test_sweeps_refine_what_they_find(make_column(100, true));
  test_sweeps_refine_what_they_find(make_column(300, true));
  test_sweeps_refine_what_they_find(make_crystal_of_bodies());
  test_iteration_limit();
  test_residual_trend();
  test_no_room();
  test_tolerance_below_round_off();
  test_numbers_that_are_not_finite();
  test_status_of_two_projections();
  test_solver_is_used_again();
  test_first_guess();
  test_largest_eigenvalue();
  test_names_of_solvers();
  test_contacts_are_found_in_rounds();
  test_same_answer_as_with_all_contacts();
  test_rounds_go_on();
  test_rounds_begin_with_their_own_problem(false);
  test_rounds_begin_with_their_own_problem(true);
  test_round_limit();
  test_iterations_of_all_rounds_are_limited();
  test_concave_wall_is_linearised_again();
  for (const double tolerance : {TOLERANCE, SINGLE_TOLERANCE}) {
    for (const int rank_colours : {1, 2}) {
      test_two_ranks(tolerance, rank_colours);
      test_bodies_on_two_ranks(tolerance, rank_colours);
    }
  }
  test_two_ranks_with_nothing();
  test_lid_over_two_ranks();
  test_periodic_images(false);
  test_periodic_images(true);
  test_largest_eigenvalue_on_two_ranks();
  test_philox_known_answers();
  test_uniform_vector();
  if (failures > 0) std::cerr << failures << " checks failed\n";
  return failures > 0 ? 1 : 0;
}
