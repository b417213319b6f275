#include "inelastic_unsolved_step.h"

#include "inelastic_constraints.h"
#include "inelastic_ghost_exchange.h"
#include "inelastic_hard_steps.h"
#include "inelastic_mover.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "update.h"

#include "fmt/format.h"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

UnsolvedStep::UnsolvedStep(LAMMPS *lmp, const Step &step, const Constraints &constraints,
                           const HardSteps &hard, GhostExchange &ranks, const Movers &movers) :
    Pointers(lmp), step_(step), constraints_(constraints), hard_(hard), ranks_(ranks),
    movers_(movers)
{
}

void UnsolvedStep::note_worst(const inelastic::ProjectionResult &result)
{
  double size = -1.0;
  std::string named;
  if (result.worst != inelastic::ProjectionResult::NONE) {
    const std::size_t c = result.worst;
    const Contact &contact = step_.contact_of(c);
    const tagint first = atom->tag[step_.problem.contacts.first[c]];
    const std::string sides = contact.is_with_wall()
        ? fmt::format("atom {} and wall {}", first, contact.wall())
        : fmt::format("atoms {} and {}", first, atom->tag[step_.problem.contacts.second[c]]);
    size = std::abs(result.worst_gap);
    named = result.worst_gap < 0.0
        ? fmt::format("{} overlap by {:.4g} at its end", sides, size)
        : fmt::format("{} keep a gap of {:.4g} under a force", sides, size);
  }
  double largest;
  const int rank = ranks_.rank_of_largest(size, &largest);
  named = ranks_.said_by(rank, named);
  if (largest < worst_) return;
  worst_ = largest;
  named_ = named;
}

// [radians] By which a body would turn in the step without contacts. Collective.
double UnsolvedStep::largest_angle() const
{
  double angle = 0.0;
  for (int i = 0; i < atom->nlocal; ++i)
    if (step_.is_member(i)) angle = std::max(angle, movers_.angle_predicted(step_.problem, i));
  ranks_.reduce(nullptr, 0, &angle, 1);
  return angle;
}

bool UnsolvedStep::law_parts() const
{
  double any = 0.0;
  for (const Contact &contact : step_.contacts)
    if (contact.asked.parts && contact.asked.parting_speed > 0.0) any = 1.0;
  ranks_.reduce(nullptr, 0, &any, 1);
  return any > 0.0;
}

void UnsolvedStep::report(const inelastic::ProjectionResult &result)
{
  constexpr double LONG_ARC = 1.0;    // [radians]
  std::string cause;
  if (!no_room_ && hard_.is_hardly_solved(result)) {
    cause = hard_.cause();
    const std::string &longer = named_or_last();
    error->all(
        FLERR,
        "Fix inelastic: step {}: no time step down to {:.3g} is solved: even there {:.2g} of "
        "what contacts change is left{}. {}",
        update->ntimestep, update->dt, result.unresolved,
        longer.empty() ? "" : ", and in a longer one " + longer, cause);
  }
  const std::string message = no_room_ ? no_room(result, cause) : out_of_iterations(result, cause);
  // Gaps that follow spheres on long arcs may contradict one another where there is room enough.
  const double angle = movers_.any_turns() && constraints_.relinearised() ? largest_angle() : 0.0;
  const char *const or_shorter = step_.settings.shorten ? "" : ", or use shorten yes";
  constexpr double BEYOND_ORDINARY = 1.0e6;    // ratios of masses
  const std::string masses = no_room_ ? "" : hard_.of_masses(BEYOND_ORDINARY);
  if (!masses.empty())
    cause = masses;
  else if (angle > LONG_ARC)
    cause = fmt::format("Bodies spin by up to {:.3g} radians in this step: lower the timestep{}",
                        angle, or_shorter);
  else if (law_parts())
    cause = fmt::format(
        "The contact law asks more surfaces to part than may have room to do so "
        "in one step: lower the timestep{}{}",
        or_shorter,
        hard_.obstacles_move() ? ". Or walls or frozen spheres close in, and leave no room" : "");
  if (!step_.settings.warn_only) error->all(FLERR, "Fix inelastic: {}. {}", message, cause);
  if (comm->me == 0) error->warning(FLERR, "Fix inelastic: {}", message);
}

void UnsolvedStep::report_energy(double times)
{
  const std::string message =
      fmt::format("step {}: contacts add {:.3g} times as much kinetic energy as they may, though "
                  "they give no overlaps back",
                  update->ntimestep, times);
  const std::string cause = hard_.cause();
  if (!step_.settings.warn_only) error->all(FLERR, "Fix inelastic: {}. {}", message, cause);
  if (comm->me == 0) error->warning(FLERR, "Fix inelastic: {}", message);
}

void UnsolvedStep::report_jam(const PushApart::Left &left)
{
  const double tolerance = step_.settings.tolerance;
  const std::string message = fmt::format(
      "step {}: {:.0f} overlaps of up to {:.4g} ({:.3g} tolerances; {}) do not open any more where "
      "all give way to one another",
      update->ntimestep, left.number, left.largest, left.largest / tolerance, left.named);
  constexpr const char *CAUSE = "The scene leaves no room for the spheres: make the box or the "
                                "container larger, or the spheres smaller or fewer";
  if (!step_.settings.warn_only) error->all(FLERR, "Fix inelastic: {}. {}", message, CAUSE);
  if (comm->me == 0) error->warning(FLERR, "Fix inelastic: {}", message);
}

std::string UnsolvedStep::no_room(const inelastic::ProjectionResult &result,
                                  std::string &cause) const
{
  const std::string shorter = result.status == inelastic::Status::INFEASIBLE
      ? ""
      : fmt::format(", and {} iterations found none for a time step of only {:.3g}",
                    result.iterations, update->dt);
  // With the gaps of the present positions alone there were velocities.
  const bool at_end_alone = constraints_.solved_relinearised() && !step_.settings.shorten;
  cause = at_end_alone
      ? fmt::format("There are some for the gaps as they change at first, and none for those at "
                    "the end of the step, until which {}: lower the timestep, or use shorten yes{}",
                    movers_.any_turns() ? "bodies turn" : "walls curve",
                    constraints_.walls_move() ? ". Or walls that move leave no room" : "")
      : "The scene leaves no room for the spheres: walls or frozen spheres close in, or there "
        "are too many spheres";
  return fmt::format("step {}: no velocities keep the surfaces apart{}{}, where {:.4g} is allowed",
                     update->ntimestep, shorter,
                     named_or_last().empty() ? "" : ": " + named_or_last(),
                     step_.settings.tolerance);
}

std::string UnsolvedStep::out_of_iterations(const inelastic::ProjectionResult &result,
                                            std::string &cause) const
{
  // Up to here a residual can come down, but need not.
  constexpr double NEAR_ROUND_OFF = 10.0;
  // In half of the iterations or more; without room it stays, and otherwise falls by half or
  // faster.
  constexpr double STILL_FALLS = 0.7;
  constexpr double UNSEEN = 100.0;
  // Up to such a part of a radius a tolerance may be raised.
  constexpr double COARSE = 0.1;
  const bool may_raise = step_.settings.tolerance < COARSE * step_.largest_radius;
  const std::string help =
      fmt::format("raise maxiter ({}){} or lower the timestep", step_.settings.max_iterations,
                  may_raise ? ", raise the tolerance," : "");
  double before = result.trend.earlier();
  const double now = result.trend.least();
  // The trend knows nothing of constraints that were found after the last iteration.
  if (result.residual.feasibility > UNSEEN * now) before = std::numeric_limits<double>::infinity();
  const bool falls = now < STILL_FALLS * before && std::isfinite(before);
  if (step_.settings.tolerance < NEAR_ROUND_OFF * result.round_off)
    cause = fmt::format("The tolerance is below the round-off of these forces: raise it to {:.2g}",
                        NEAR_ROUND_OFF * result.round_off);
  else if (constraints_.solved_relinearised() && !step_.settings.shorten)
    cause = fmt::format("The gaps at the end of the step, until which {}, may not all be had "
                        "together: lower the timestep, use shorten yes, or raise maxiter ({})",
                        movers_.any_turns() ? "bodies turn" : "walls curve",
                        step_.settings.max_iterations);
  // (Of a step that is shortened already the residual falls where there is no room, too.)
  else if (falls && update->dt == step_.regular_timestep)
    cause = fmt::format("The residual is still coming down, as it does where there is room "
                        "(from {:.3g} to {:.3g} lately): {}",
                        before, now, help);
  else if (!falls && std::isfinite(before))
    cause =
        fmt::format("The residual no longer comes down (from {:.3g} to {:.3g} lately): the scene "
                    "leaves no room for the spheres, or needs far more iterations: {}",
                    before, now, help);
  else
    cause = fmt::format("Either the scene leaves no room for the spheres, or: {}", help);
  // The numbers may not be finite, and then there is no worst constraint.
  return fmt::format("step {}: {} iterations left a gap short by {:.4g} and a gap under a "
                     "force of {:.4g}, where {:.4g} is allowed{}",
                     update->ntimestep, result.iterations, result.residual.feasibility,
                     result.residual.complementarity, step_.settings.tolerance,
                     named_.empty() ? "" : ": " + named_);
}
