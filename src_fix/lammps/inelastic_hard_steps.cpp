#include "inelastic_hard_steps.h"

#include "inelastic_constraints.h"
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

HardSteps::HardSteps(LAMMPS *lmp, const Step &step, const Constraints &constraints,
                     GhostExchange &ranks) :
    Pointers(lmp), step_(step), constraints_(constraints), ranks_(ranks)
{
}

// Uzawa's method looks at overlaps alone, and a push is none that an accuracy counts for.
bool HardSteps::judges_accuracy() const
{ return step_.settings.solver != "uzawa" && !step_.bad_start; }

bool HardSteps::is_hardly_solved(const inelastic::ProjectionResult &result) const
{
  return judges_accuracy() && result.status == inelastic::Status::CONVERGED && !result.accurate &&
      result.unresolved > inelastic::HARDLY_RESOLVED;
}

std::string HardSteps::of_masses(double ratio) const
{
  const inelastic::ContactProblem &problem = step_.problem;
  double heaviest = 0.0, lightest = EXTREME;
  tagint heavy = 0, light = 0;
  for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
    if (!problem.contacts.is_loaded(c)) continue;
    for (const int i : {problem.contacts.first[c], problem.contacts.second[c]}) {
      if (problem.is_wall(i) || !problem.is_mobile(i)) continue;
      const double mass = 1.0 / problem.inverse_mass_of(i);
      if (mass > heaviest) heavy = atom->tag[i];
      if (mass < lightest) light = atom->tag[i];
      heaviest = std::max(heaviest, mass);
      lightest = std::min(lightest, mass);
    }
  }
  const auto said = [this](double size, double mass, tagint atom_id, double *largest) {
    const int rank = ranks_.rank_of_largest(size, largest);
    return ranks_.said_by(rank, fmt::format("{:.4g} (atom {})", mass, atom_id));
  };
  double most, least;
  const std::string of_heavy = said(heaviest, heaviest, heavy, &most);
  const std::string of_light = said(-lightest, lightest, light, &least);
  least = -least;
  if (!(most >= ratio * least)) return "";
  return fmt::format(
      "Masses of {} and {} push one another, {:.2g} : 1: make them less different, or "
      "lower the timestep",
      of_heavy, of_light, most / least);
}

std::string HardSteps::cause() const
{
  constexpr double DIFFERENT = 1.0e3;
  const std::string masses = of_masses(DIFFERENT);
  double sums[2] = {0.0, 0.0};    // contacts with a force, particles
  for (std::size_t c = 0; c < step_.problem.contacts.size(); ++c)
    if (step_.problem.contacts.is_loaded(c)) sums[0] += 1.0;
  for (int i = 0; i < atom->nlocal; ++i)
    if (step_.is_mobile(atom, i)) sums[1] += 1.0;
  ranks_.reduce(sums, 2, nullptr, 0);
  const char *const or_no_room = obstacles_move()
      ? "The scene leaves no room for the spheres: walls or frozen spheres close in. Or: "
      : "";
  if (!masses.empty()) return or_no_room + masses;
  return fmt::format(
      "{}{:.0f} contacts with a force are too many, or too alike, for {:.0f} particles: "
      "raise maxiter ({}), the tolerance or the accuracy, or lower the timestep",
      or_no_room, sums[0], sums[1], step_.settings.max_iterations);
}

bool HardSteps::obstacles_move() const
{
  double any = constraints_.walls_move() ? 1.0 : 0.0;
  for (int i = 0; i < atom->nlocal; ++i)
    if (step_.in_group(atom, i) && !step_.is_mobile(atom, i) &&
        inelastic::norm(&step_.problem.predicted_velocity[3 * static_cast<std::size_t>(i)]) > 0.0)
      any = 1.0;
  ranks_.reduce(nullptr, 0, &any, 1);
  return any > 0.0;
}

void HardSteps::end_step(const inelastic::ProjectionResult &result)
{
  if (shortened_) ++counts_.shortened;
  const bool inaccurate = judges_accuracy() && result.status == inelastic::Status::CONVERGED &&
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
      "what contacts change is left{}. {}",
      update->ntimestep, in_a_row_, most_unresolved_,
      any_at_maxiter_ ? fmt::format(" after {} iterations", step_.settings.max_iterations) : "",
      cause());
  if (!step_.settings.warn_only) error->all(FLERR, message);
  if (in_a_row_ == MOST_IN_A_ROW + 1 && comm->me == 0) error->warning(FLERR, message);
}
