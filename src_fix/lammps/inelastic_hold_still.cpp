#include "inelastic_hold_still.h"

#include "inelastic_ghost_exchange.h"
#include "inelastic_make_solver.h"
#include "inelastic_mover.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

// The moving particles were solved for already: only where they would end deeper by so many
// tolerances, because others are at rest, do their velocities change.
constexpr double DEEPER = 0.1;
// Where more iterations would be needed, moving particles have no room beside those at rest:
// nothing is stopped in the step.
constexpr long MOST_ITERATIONS = 2000;

}    // namespace

HoldStill::HoldStill(Step &step, GhostExchange &ranks, Movers &movers) :
    step_(step), ranks_(ranks), movers_(movers), solver_(inelastic::make_solver("apgd"))
{
}

std::vector<char> HoldStill::with_ghosts(const std::vector<char> &stopped) const
{
  std::vector<double> marks(3 * stopped.size(), 0.0);
  for (std::size_t i = 0; i < stopped.size(); ++i) marks[3 * i] = stopped[i];
  ranks_.share_with_ghosts(marks.data());
  std::vector<char> all(stopped.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = marks[3 * i] != 0.0;
  const inelastic::RigidBodies &bodies = step_.problem.bodies;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const auto first = bodies.member.begin() + bodies.start[b];
    const auto last = bodies.member.begin() + bodies.start[b + 1];
    const bool any = std::any_of(first, last, [&all](int i) {
      return all[i] != 0;
    });
    std::for_each(first, last, [&all, any](int i) {
      all[i] = any;
    });
  }
  return all;
}

long HoldStill::run(const std::vector<char> &stopped, const std::function<long()> &add_violated,
                    const std::function<double()> &excess)
{
  // Moving particles may meet stopped ones that they would not have met, and then come upon others.
  constexpr int MOST_ROUNDS = 20;
  const std::vector<char> still = with_ghosts(stopped);
  const std::vector<double> velocity = step_.velocity;
  std::vector<double> &impulse = step_.problem.contacts.impulse;
  std::vector<double> impulse_before = impulse;
  const double excess_before = step_.excess;
  long iterations = 0;
  for (int round = 0; round < MOST_ROUNDS; ++round) {
    const inelastic::SolverResult result = project(still);
    iterations += result.iterations;
    if (result.status != inelastic::Status::CONVERGED) break;
    turn_bodies();
    const std::size_t known = impulse.size();
    if (add_violated() == 0) {
      if (excess() > excess_before) break;
      note_stop();
      return iterations;
    }
    std::fill(impulse.begin() + static_cast<std::ptrdiff_t>(known), impulse.end(), 0.0);
  }
  impulse_before.resize(impulse.size(), 0.0);
  impulse = impulse_before;
  step_.velocity = velocity;
  step_.excess = excess_before;
  turn_bodies();
  return iterations;
}

// Projects the velocities of the step with the marked particles as obstacles; changes nothing if it
// does not converge.
inelastic::SolverResult HoldStill::project(const std::vector<char> &still)
{
  const inelastic::ContactProblem &problem = step_.problem;
  moving_.timestep = problem.timestep;
  static_cast<inelastic::Unknowns &>(moving_) = problem;
  moving_.predicted_velocity = step_.velocity;
  for (std::size_t i = 0; i < still.size(); ++i) {
    if (!still[i]) continue;
    moving_.inverse_mass[i] = 0.0;
    std::fill_n(&moving_.predicted_velocity[3 * i], 3, 0.0);
    if (!step_.is_member(static_cast<int>(i))) continue;
    const auto b = static_cast<std::size_t>(problem.bodies.body[i]);
    moving_.bodies.inverse_mass[b] = 0.0;
    std::fill_n(&moving_.bodies.inverse_inertia[6 * b], 6, 0.0);
  }
  inelastic::ContactSet &contacts = moving_.contacts;
  contacts.clear();
  std::vector<std::size_t> source;
  for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
    const double *const n = &problem.contacts.normal[3 * c];
    const int i = problem.contacts.first[c], j = problem.contacts.second[c];
    if (moving_.mobility_of_pair(i, j, n) == 0.0) continue;
    // A contact that counts as closed, and overlaps, is to end within the tolerance, the residual
    // included.
    const double ends_within = step_.contact_of(c).gap_now - step_.rows[c].wall_motion +
        (1.0 - DEEPER) * step_.settings.tolerance;
    contacts.add_of(problem.contacts, c);
    contacts.gap.back() = std::min(problem.contacts.gap[c], ends_within);
    // With the step's own impulse the contact still pushes, or pulls by no more than it may.
    const auto changes = problem.contacts.set[c].changes_of(problem.contacts.impulse[c]);
    contacts.set.back() = {std::min(0.0, changes.least)};
    source.push_back(c);
  }
  inelastic::SolverLimits limits;
  limits.tolerance = DEEPER * step_.settings.tolerance;
  limits.max_iterations = std::min(MOST_ITERATIONS, step_.settings.max_iterations);
  const inelastic::SolverResult result = solver_->solve(moving_, limits, ranks_);
  if (result.status != inelastic::Status::CONVERGED) return result;
  solver_->gap_operator().velocity_applied(moving_, step_.velocity.data());
  for (std::size_t k = 0; k < source.size(); ++k)
    step_.problem.contacts.impulse[source[k]] += contacts.impulse[k];
  return result;
}

void HoldStill::turn_bodies()
{ movers_.turn(step_.problem, step_.velocity, step_.motion_of_bodies); }

// Tells the movers that bodies at rest are to have other velocities than the contact forces give
// them.
void HoldStill::note_stop()
{
  if (!movers_.any_turns()) return;
  const inelastic::ContactProblem &problem = step_.problem;
  std::vector<double> by_contacts(step_.velocity.size());
  inelastic::GapOperator gap_operator;
  gap_operator.prepare(problem);
  gap_operator.velocity(problem, problem.contacts.impulse.data(), by_contacts.data(), ranks_);
  movers_.note_stop(problem, by_contacts, step_.velocity);
  turn_bodies();
}
