#include "push_apart.h"

#include "constraints.h"
#include "rigid_motion.h"
#include "step.h"

#include <algorithm>

using namespace LAMMPS_NS;

namespace {

// Both projections of a step as one result.
void add(inelastic::ProjectionResult &result, const inelastic::ProjectionResult &pushed)
{
  result.iterations += pushed.iterations;
  result.status = inelastic::worse(result.status, pushed.status);
  result.round_off = std::max(result.round_off, pushed.round_off);
  result.residual.feasibility = std::max(result.residual.feasibility, pushed.residual.feasibility);
  result.residual.complementarity =
      std::max(result.residual.complementarity, pushed.residual.complementarity);
}

}    // namespace

void PushApart::run(const Atom *atom, inelastic::ProjectionResult &result, const Project &project)
{
  inelastic::ContactProblem &problem = step_.problem;
  const inelastic::ContactSet contacts = problem.contacts;
  std::copy_n(step_.velocity.begin(), 3 * static_cast<std::size_t>(problem.particles),
              problem.predicted_velocity.begin());
  step_.phase = Phase::PUSH;
  step_.relinearisations = 0;
  if (bodies_) constraints_.entangled().find();
  for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
    const Side &side = step_.sides[c];
    // A gap that counts as closed is one here.
    if (side.gap_now <= step_.settings.tolerance)
      problem.contacts.gap[c] = constraints_.rules().asked_gap(side);
    problem.contacts.impulse[c] = 0.0;
  }
  if (bodies_) constraints_.entangled().disentangle(atom, constraints_.overlaps());
  add(result, project(std::max(0L, step_.settings.max_iterations - result.iterations)));

  problem.contacts = contacts;
  step_.sides.resize(contacts.size());
  if (bodies_) bodies_->note_push(problem, step_.velocity);
}
