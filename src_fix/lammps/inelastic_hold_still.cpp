#include "inelastic_hold_still.h"

#include "inelastic_ghost_exchange.h"
#include "inelastic_mover.h"

#include <algorithm>
#include <utility>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

// The moving particles were solved for already: only where they would end deeper than this, because
// others are at rest, do their velocities change.
using in_eps::ADDED_BESIDE_REST;
// Where more iterations would be needed, moving particles have no room beside those at rest:
// nothing is stopped in the step.
constexpr long MOST_ITERATIONS = 300;

}    // namespace

HoldStill::HoldStill(Step &step, GhostExchange &ranks, Movers &movers,
                     std::unique_ptr<inelastic::Solver> solver) :
    step_(step), ranks_(ranks), movers_(movers), solver_(std::move(solver))
{
}

void HoldStill::begin()
{
  velocity_before_ = step_.velocity;
  impulse_before_ = step_.problem.contacts.impulse;
  excess_before_ = step_.excess;
  iterations_ = 0;
}

void HoldStill::go_back()
{
  // Constraints that were added since had no impulse.
  impulse_before_.resize(step_.problem.contacts.size(), 0.0);
  step_.problem.contacts.impulse = impulse_before_;
  step_.velocity = velocity_before_;
  step_.excess = excess_before_;
  turn_bodies();
}

bool HoldStill::run(const Held &held, const Constraints &constraints)
{
  // Moving particles may meet stopped ones that they would not have met, and then come upon others.
  constexpr int MOST_ROUNDS = 20;
  std::vector<double> &impulse = step_.problem.contacts.impulse;
  solved_ = step_.velocity;
  for (int round = 0; round < MOST_ROUNDS; ++round) {
    // Mostly the moving particles have room as they are: all contacts take part only where those of
    // held particles ask for a change.
    inelastic::SolverResult result;
    if (round == 0) result = project(held, Of::HELD, 0);
    if (round > 0 || result.status != inelastic::Status::CONVERGED)
      result = project(held, Of::ALL, std::min(MOST_ITERATIONS, step_.settings.max_iterations));
    iterations_ += result.iterations;
    if (result.status != inelastic::Status::CONVERGED) return false;
    turn_bodies();
    const std::size_t known = impulse.size();
    if (constraints.add_violated() > 0) {
      std::fill(impulse.begin() + static_cast<std::ptrdiff_t>(known), impulse.end(), 0.0);
      continue;
    }
    double lacking = has_room(held) && !opens_under_force(held) ? 0.0 : 1.0;
    ranks_.reduce(nullptr, 0, &lacking, 1);
    return lacking == 0.0 && constraints.excess() <= excess_before_;
  }
  return false;
}

bool HoldStill::is_held(const Held &held, int slot) const
{ return !step_.problem.is_wall(slot) && held.particles[slot]; }

bool HoldStill::is_still(const Held &held, int slot) const
{ return is_held(held, slot) || !step_.problem.is_mobile(slot); }

// Tells whether what is held may go on as it is to, beside what cannot give way.
bool HoldStill::has_room(const Held &held) const
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const int i = contacts.first[c], j = contacts.second[c];
    if (!is_still(held, i) || !is_still(held, j)) continue;
    double opening = 0.0;
    for (int d = 0; d < 3; ++d)
      opening +=
          contacts.normal[3 * c + d] * (step_.velocity[3 * i + d] - step_.velocity[3 * j + d]);
    const double closing = -step_.problem.timestep * opening;
    if (closing > 0.0 && closing - contacts.gap[c] > step_.eps(ADDED_BESIDE_REST)) return false;
  }
  return true;
}

// Tells whether moving particles end apart by more than the tolerance under a force, and did not:
// what this room leaves of its residual may come on top of a gap that counted as closed.
bool HoldStill::opens_under_force(const Held &held) const
{
  const std::vector<double> &impulse = step_.problem.contacts.impulse;
  const double tolerance = step_.settings.tolerance;
  for (std::size_t c = 0; c < impulse.size(); ++c) {
    const int i = step_.problem.contacts.first[c], j = step_.problem.contacts.second[c];
    if (!(impulse[c] > 0.0) || is_held(held, i) || is_held(held, j)) continue;
    const bool pushed = c < impulse_before_.size() && impulse_before_[c] > 0.0;
    const bool was_open = pushed && step_.linear_gap_at_end(c, velocity_before_) > tolerance;
    if (!was_open && step_.linear_gap_at_end(c, step_.velocity) > tolerance) return true;
  }
  return false;
}

// What moves, and obstacles in place of what is held.
void HoldStill::set_up(const Held &held)
{
  const inelastic::ContactProblem &problem = step_.problem;
  moving_.timestep = problem.timestep;
  static_cast<inelastic::Unknowns &>(moving_) = problem;
  moving_.predicted_velocity = step_.velocity;
  for (std::size_t i = 0; i < held.particles.size(); ++i) {
    if (!held.particles[i]) continue;
    moving_.inverse_mass[i] = 0.0;
    std::copy_n(&held.velocity[3 * i], 3, &moving_.predicted_velocity[3 * i]);
    if (!step_.is_member(static_cast<int>(i))) continue;
    const auto b = static_cast<std::size_t>(problem.bodies.body[i]);
    moving_.bodies.inverse_mass[b] = 0.0;
    std::fill_n(&moving_.bodies.inverse_inertia[6 * b], 6, 0.0);
  }
}

// Projects the velocities of the step with the held particles as obstacles.
inelastic::SolverResult HoldStill::project(const Held &held, Of of, long most_iterations)
{
  const inelastic::ContactProblem &problem = step_.problem;
  set_up(held);
  inelastic::ContactSet &contacts = moving_.contacts;
  contacts.clear();
  std::vector<std::size_t> source;
  for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
    const double *const n = &problem.contacts.normal[3 * c];
    const int i = problem.contacts.first[c], j = problem.contacts.second[c];
    if (of == Of::HELD && !is_held(held, i) && !is_held(held, j)) continue;
    if (moving_.mobility_of_pair(i, j, n) == 0.0) continue;
    // An obstacle counts as if it went on as it was solved for: what is not known of its velocity
    // takes no force away from what it touches. But a contact that counts as closed, and overlaps,
    // is to end within the tolerance, the residual included.
    double along = 0.0;
    for (const auto &[slot, sign] : {std::pair{i, 1.0}, std::pair{j, -1.0}}) {
      if (!is_held(held, slot)) continue;
      for (std::size_t d = 0; d < 3; ++d) {
        const std::size_t k = 3 * static_cast<std::size_t>(slot) + d;
        along += sign * n[d] * (solved_[k] - held.velocity[k]);
      }
    }
    const double ends_within = step_.contact_of(c).gap_now - step_.rows[c].wall_motion +
        step_.eps(in_eps::ALLOWED - ADDED_BESIDE_REST);
    // What the step has left of its residual stays: it is not for this room to solve it once more.
    double opens = 0.0;
    for (std::size_t d = 0; d < 3; ++d)
      opens += n[d] *
          (solved_[3 * static_cast<std::size_t>(i) + d] -
           solved_[3 * static_cast<std::size_t>(j) + d]);
    const double left = problem.contacts.gap[c] + problem.timestep * opens;
    const double residual = problem.contacts.is_loaded(c) ? left : std::min(left, 0.0);
    contacts.add_of(problem.contacts, c);
    contacts.gap.back() =
        std::min(problem.contacts.gap[c] + problem.timestep * along - residual, ends_within);
    // With the step's own impulse the contact still pushes, or pulls by no more than it may.
    contacts.set.back() =
        problem.contacts.set[c].changes_of(problem.contacts.impulse[c]).after(0.0);
    source.push_back(c);
  }
  inelastic::SolverLimits limits;
  limits.tolerance = step_.eps(ADDED_BESIDE_REST);
  limits.max_iterations = most_iterations;
  const inelastic::SolverResult result = solver_->solve(moving_, limits, ranks_);
  if (result.status != inelastic::Status::CONVERGED) return result;
  solver_->gap_operator().velocity_applied(moving_, step_.velocity.data());
  for (std::size_t k = 0; k < source.size(); ++k)
    step_.problem.contacts.impulse[source[k]] += contacts.impulse[k];
  return result;
}

void HoldStill::turn_bodies()
{ movers_.turn(step_.problem, step_.velocity, step_.motion_of_bodies); }

const std::vector<double> &HoldStill::find_by_contacts()
{
  const inelastic::ContactProblem &problem = step_.problem;
  by_contacts_.resize(step_.velocity.size());
  inelastic::GapOperator gap_operator;
  gap_operator.prepare(problem);
  gap_operator.velocity(problem, problem.contacts.impulse.data(), by_contacts_.data(), ranks_);
  return by_contacts_;
}

// Bodies at rest are to have other velocities than the contact forces give them.
void HoldStill::stop(const Held &held)
{
  for (std::size_t i = 0; i < held.particles.size(); ++i)
    if (held.particles[i]) std::copy_n(&held.velocity[3 * i], 3, &step_.velocity[3 * i]);
  if (!movers_.any_turns()) return;
  movers_.note_stop(step_.problem, by_contacts_, step_.velocity);
  turn_bodies();
}
