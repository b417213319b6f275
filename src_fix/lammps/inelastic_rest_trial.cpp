#include "inelastic_rest_trial.h"

#include "inelastic_ghost_exchange.h"
#include "inelastic_make_solver.h"
#include "inelastic_mover.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

// Contacts that get a force in the trial count as closed in a further round of it.
constexpr int MOST_ROUNDS = 4;

}    // namespace

RestTrial::RestTrial(Step &step, GhostExchange &ranks, Movers &movers) :
    step_(step), ranks_(ranks), movers_(movers), solver_(inelastic::make_solver("sweeps"))
{
}

void RestTrial::begin()
{
  const inelastic::ContactProblem &problem = step_.problem;
  tried_.contacts.impulse = problem.contacts.impulse;
  iterations_ = 0;
  before_.assign(problem.predicted_velocity.size(), 0.0);
  movers_.find_velocity_before(before_);
  movers_.predict();
  movers_.turn(problem, step_.velocity, step_.motion_of_bodies);
}

void RestTrial::set_up(const Begun &begun, double refinement)
{
  const std::vector<double> reached = tried_.contacts.impulse;
  tried_ = step_.problem;
  inelastic::ContactSet &contacts = tried_.contacts;
  contacts.impulse = reached;
  for (std::size_t c = 0; c < contacts.size(); ++c)
    if (begun.constraints[c]) contacts.refinement[c] = std::min(contacts.refinement[c], refinement);
  for (std::size_t i = 0; i < begun.particles.size(); ++i)
    if (begun.particles[i])
      for (std::size_t k = 3 * i; k < 3 * i + 3; ++k)
        tried_.predicted_velocity[k] += begun.common[k] - before_[k];
}

bool RestTrial::run(const Begun &begun, double refinement, double least_length,
                    long most_iterations)
{
  set_up(begun, refinement);
  inelastic::SolverLimits limits;
  limits.tolerance = step_.settings.tolerance;
  limits.max_iterations = std::min(most_iterations, step_.settings.max_iterations);
  limits.accuracy = step_.settings.accuracy;
  limits.least_length = least_length;
  velocity_.resize(step_.velocity.size());
  for (int round = 0; round < MOST_ROUNDS; ++round) {
    const bool closed = close_contacts(begun);
    if (round > 0 && !closed) break;
    const inelastic::SolverResult result = solver_->solve(tried_, limits, ranks_);
    iterations_ += result.iterations;
    if (result.status != inelastic::Status::CONVERGED || !result.accurate) return false;
    solver_->gap_operator().velocity_applied(tried_, velocity_.data());
  }
  return true;
}

// A contact that has a force, and is not open by more than the tolerance, would count as closed in
// the next step (inelastic_gap_rules.h). Returns whether any does so now that did not. Collective.
bool RestTrial::close_contacts(const Begun &begun)
{
  inelastic::ContactSet &contacts = tried_.contacts;
  double any = 0.0;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const bool closes = begun.constraints[c] && contacts.impulse[c] > 0.0 &&
        contacts.gap[c] > 0.0 && step_.contact_of(c).gap_now <= step_.settings.tolerance &&
        !step_.may_pull(c);
    if (!closes) continue;
    contacts.gap[c] = 0.0;
    any = 1.0;
  }
  ranks_.reduce(nullptr, 0, &any, 1);
  return any > 0.0;
}

void RestTrial::exchange()
{
  step_.problem.predicted_velocity.swap(tried_.predicted_velocity);
  step_.problem.contacts.impulse.swap(tried_.contacts.impulse);
  step_.velocity.swap(velocity_);
}
