#include "inelastic_hard_steps.h"

#include "inelastic_ghost_exchange.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "update.h"

#include "fmt/format.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

// After maxiter iterations so many accuracies may be left.
constexpr double MOST_AT_MAXITER = 10.0;
// So many such steps may come one after the other.
constexpr long MOST_IN_A_ROW = 3;

}    // namespace

HardSteps::HardSteps(LAMMPS *lmp, const Step &step, GhostExchange &ranks) :
    Pointers(lmp), step_(step), ranks_(ranks)
{
}

// Uzawa's method looks at overlaps alone, and a push is none that an accuracy counts for.
bool HardSteps::looks() const
{ return step_.settings.solver != "uzawa" && !step_.bad_start; }

bool HardSteps::is_hardly_solved(const inelastic::ProjectionResult &result) const
{
  return looks() && result.status == inelastic::Status::CONVERGED && !result.accurate &&
      result.unresolved > inelastic::HARDLY_RESOLVED;
}

std::string HardSteps::cause() const
{
  constexpr double DIFFERENT = 1000.0;
  const inelastic::ContactProblem &problem = step_.problem;
  double heaviest = 0.0, lightest = EXTREME;
  tagint heavy = 0, light = 0;
  double loaded = 0.0;
  for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
    if (!problem.contacts.is_loaded(c)) continue;
    loaded += 1.0;
    for (const int i : {problem.contacts.first[c], problem.contacts.second[c]}) {
      if (problem.is_wall(i) || !problem.is_mobile(i)) continue;
      const double mass = 1.0 / problem.inverse_mass_of(i);
      if (mass > heaviest) {
        heaviest = mass;
        heavy = atom->tag[i];
      }
      if (mass < lightest) {
        lightest = mass;
        light = atom->tag[i];
      }
    }
  }
  const std::string with_heavy = fmt::format("{:.4g} (atom {})", heaviest, heavy);
  const std::string with_light = fmt::format("{:.4g} (atom {})", lightest, light);
  const int of_heavy = ranks_.rank_of_largest(heaviest, &heaviest);
  const std::string heavy_said = ranks_.said_by(of_heavy, with_heavy);
  double least = -lightest;
  const int of_light = ranks_.rank_of_largest(-lightest, &least);
  const std::string light_said = ranks_.said_by(of_light, with_light);
  lightest = -least;
  double particles = 0.0;
  for (int i = 0; i < atom->nlocal; ++i)
    if (step_.is_mobile(atom, i)) particles += 1.0;
  double sums[2] = {loaded, particles};
  ranks_.reduce(sums, 2, nullptr, 0);
  if (heaviest >= DIFFERENT * lightest)
    return fmt::format(
        "Masses of {} and {} push one another, {:.2g} : 1: make them less different, "
        "or lower the timestep",
        heavy_said, light_said, heaviest / lightest);
  return fmt::format(
      "{:.0f} contacts with a force are too many, or too alike, for {:.0f} particles: "
      "raise maxiter ({}), the tolerance or the accuracy, or lower the timestep",
      sums[0], sums[1], step_.settings.max_iterations);
}

void HardSteps::end_step(const inelastic::ProjectionResult &result)
{
  if (shortened_) ++counts_.shortened;
  const bool inaccurate = looks() && result.status == inelastic::Status::CONVERGED &&
      step_.settings.accuracy > 0.0 && !result.accurate;
  const bool at_maxiter = inaccurate && result.iterations >= step_.settings.max_iterations;
  if (inaccurate) ++counts_.inaccurate;
  if (at_maxiter) ++counts_.at_maxiter;
  const bool at_maxiter_far_off =
      at_maxiter && result.unresolved > MOST_AT_MAXITER * step_.settings.accuracy;
  if (!at_maxiter_far_off && !is_hardly_solved(result)) {
    in_a_row_ = 0;
    any_at_maxiter_ = false;
    most_unresolved_ = 0.0;
    return;
  }
  ++in_a_row_;
  any_at_maxiter_ = any_at_maxiter_ || at_maxiter;
  most_unresolved_ = std::max(most_unresolved_, result.unresolved);
  if (in_a_row_ <= MOST_IN_A_ROW) return;
  const std::string message = fmt::format(
      "Fix inelastic: step {}: {} steps in a row were solved to the tolerance, but up to {:.2g} of "
      "what "
      "contacts change is left{}. {}",
      update->ntimestep, in_a_row_, most_unresolved_,
      any_at_maxiter_ ? fmt::format(" after {} iterations", step_.settings.max_iterations) : "",
      cause());
  if (!step_.settings.warn_only) error->all(FLERR, message);
  if (in_a_row_ == MOST_IN_A_ROW + 1 && comm->me == 0) error->warning(FLERR, message);
}
