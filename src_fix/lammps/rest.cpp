#include "rest.h"

#include "ghost_exchange.h"

#include "atom.h"

#include <algorithm>

using namespace LAMMPS_NS;
using inelastic::norm;

namespace {

// A step is quiet if nothing is faster than this (Rest::Motion). Beds that give way somewhere are not, for long.
constexpr double QUIET = 0.3;
// So many quiet steps come first: an unstable bed doubles its velocities in two steps, and a force that
// nothing balances would show.
constexpr long PATIENCE = 100;
// The scene is at rest if nothing is faster than so many accuracies.
constexpr double AT_REST = 5.0;
constexpr double COARSEST_ACCURACY = 1.0e-3;
// Where it is quiet, but not at rest, the accuracy is halved from step to step, down to this part, which
// tells errors of the solver from motion. What moves then is slowed down by contacts and drag only, in a time
// and not in a number of steps: if it takes longer than so many steps, more are tried after twice as many
// quiet ones.
constexpr double LEAST_PART = 1.0e-2;
constexpr long FINER_STEPS = 120;
constexpr double FINER_PART = 0.5;    // of the quiet steps, where these are more

double part(double speed, double of)
{ return speed > 0.0 ? speed / std::max(of, speed / EXTREME) : 0.0; }

}    // namespace

Rest::Rest(LAMMPS *lmp, Step &step, GhostExchange &ranks) :
    Pointers(lmp), step_(step), ranks_(ranks), patience_(PATIENCE)
{
}

void Rest::judge(const inelastic::ProjectionResult &result)
{
  step_.at_rest = false;
  // What a shortened step, or one that pushes spheres apart, ends with is no rest.
  const bool regular = step_.problem.timestep == step_.regular_timestep && !step_.bad_start &&
      result.status == inelastic::Status::CONVERGED;
  // Uzawa starts every step from no forces at all: rest would save it nothing.
  const bool warm = step_.settings.solver != "uzawa";
  if (!regular || !warm) {
    wake();
    return;
  }
  const Motion motion = measure();
  const bool quiet = motion.fastest <= QUIET && motion.supported && !motion.driven;
  // In the half kick with which a run starts forces do half of what they do in a step.
  if (step_.kick == Kick::WHOLE && quiet)
    at_rest_ = find_out(motion);
  else if (step_.kick == Kick::WHOLE)
    wake();
  step_.at_rest = at_rest_ && quiet;
}

bool Rest::find_out(const Motion &motion)
{
  if (++quiet_steps_ < patience_) return false;
  const double limit = AT_REST * std::min(step_.settings.accuracy, COARSEST_ACCURACY);
  if (motion.fastest <= limit) return true;
  part_of_accuracy_ = std::max(0.5 * part_of_accuracy_, LEAST_PART);
  const long finer_steps = std::max(FINER_STEPS, static_cast<long>(FINER_PART * patience_));
  if (!at_rest_ && ++finer_steps_ < finer_steps) return false;
  const long longer = 2 * patience_;
  wake();
  patience_ = longer;
  return false;
}

void Rest::wake()
{
  at_rest_ = false;
  quiet_steps_ = finer_steps_ = 0;
  patience_ = PATIENCE;
  part_of_accuracy_ = 1.0;
}

// The mean alone would not do where large forces act on a few particles, nor the other for particles on
// which hardly any acts.
Rest::Motion Rest::measure() const
{
  const inelastic::ContactProblem &problem = step_.problem;
  const inelastic::ContactSet &contacts = problem.contacts;
  enum { SPEED, PART_OF_OWN, SUPPORTED, DRIVEN, MAXIMA };
  double sums[2] = {}, maxima[MAXIMA] = {};    // sums: of predicted speeds, and their number
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!step_.in_group(atom, i)) continue;
    const double *const v = &step_.velocity[3 * i];
    const double *const predicted = &problem.predicted_velocity[3 * i];
    const double speed = norm(v);
    if (problem.inverse_mass[i] == 0.0) {
      if (speed > 0.0) maxima[DRIVEN] = 1.0;
      continue;
    }
    double taken[3];
    for (int d = 0; d < 3; ++d) taken[d] = predicted[d] - v[d];
    maxima[SPEED] = std::max(maxima[SPEED], speed);
    maxima[PART_OF_OWN] = std::max(maxima[PART_OF_OWN], part(speed, norm(taken)));
    sums[0] += norm(predicted);
    sums[1] += 1.0;
  }
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const bool fixed = step_.sides[c].wall != 0 || problem.inverse_mass[contacts.first[c]] == 0.0 ||
        problem.inverse_mass[contacts.second[c]] == 0.0;
    if (fixed && contacts.impulse[c] != 0.0) maxima[SUPPORTED] = 1.0;
    if (step_.sides[c].wall_motion != 0.0) maxima[DRIVEN] = 1.0;
  }
  ranks_.reduce(sums, 2, maxima, MAXIMA);
  const double mean = sums[1] > 0.0 ? sums[0] / sums[1] : 0.0;
  return {std::max(maxima[PART_OF_OWN], part(maxima[SPEED], mean)), maxima[SUPPORTED] > 0.0,
          maxima[DRIVEN] > 0.0};
}
