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

// Sets the contacts back to those of the first projection. What earlier trials have found stays: it is known to be in
// the problem, and nobody would find it again.
void PushApart::begin_trial(const inelastic::ContactSet &contacts)
{
  inelastic::ContactSet &present = step_.problem.contacts;
  const inelastic::ContactSet last = present;
  present = contacts;
  for (std::size_t c = contacts.size(); c < last.size(); ++c)
    present.add(last.first[c], last.second[c], &last.normal[3 * c], last.gap[c], 0.0,
                last.compliance[c], last.least[c], last.refinement[c]);
}

void PushApart::run(const Atom *atom, inelastic::ProjectionResult &result, const Project &project)
{
  inelastic::ContactProblem &problem = step_.problem;
  const inelastic::ContactSet contacts = problem.contacts;
  std::copy_n(step_.velocity.begin(), 3 * static_cast<std::size_t>(problem.particles),
              problem.predicted_velocity.begin());
  step_.phase = Phase::PUSH;
  step_.relinearisations = 0;
  if (bodies_) constraints_.entangled().find();
  // All of them may not be had at once: spheres jam for a moment. Then less is.
  constexpr double LESS = 0.25;
  constexpr int TRIALS = 6;
  // Iterations, of thousands of spheres, with room for what they may open: many times what it takes.
  constexpr long MOST = 10000;
  double part = 1.0;
  for (int trial = 0; trial < TRIALS; ++trial, part *= LESS) {
    begin_trial(contacts);
    for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
      const Side &side = step_.sides[c];
      // A gap that counts as closed is one here.
      if (side.gap_now <= step_.settings.tolerance)
        problem.contacts.gap[c] =
            (side.gap_now < 0.0 ? part : 1.0) * constraints_.rules().effective_gap(side) -
            side.wall_motion;
      problem.contacts.impulse[c] = 0.0;
    }
    if (bodies_) constraints_.entangled().disentangle(atom, constraints_.overlaps());
    const long left = std::max(0L, step_.settings.max_iterations - result.iterations);
    const inelastic::ProjectionResult pushed =
        project(trial + 1 < TRIALS ? std::min(MOST, left / 4) : left);
    const bool solved = pushed.status == inelastic::Status::CONVERGED;
    if (solved || trial + 1 == TRIALS) add(result, pushed);
    if (solved) break;
    result.iterations += trial + 1 < TRIALS ? pushed.iterations : 0;
  }

  problem.contacts = contacts;
  step_.sides.resize(contacts.size());
  if (bodies_) bodies_->note_push(problem, step_.velocity);
}
