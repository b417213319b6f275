#include "inelastic_run_summary.h"

#include "comm.h"
#include "error.h"
#include "utils.h"

#include "fmt/format.h"

#include <algorithm>
#include <string>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

RunSummary::RunSummary(LAMMPS *lmp, const Step &step, PhaseClock &clock) :
    Pointers(lmp), step_(step), clock_(clock)
{
}

void RunSummary::begin(long shortened_steps)
{
  steps_ = at_rest_ = waited_ = unconverged_ = pushed_at_start_ = pushed_later_ = 0;
  shortened_before_ = shortened_steps;
  iterations_ = constraint_iterations_ = 0.0;
  overlap_of_start_ = largest_overlap_ = largest_excess_ = 0.0;
  clock_.reset();
}

void RunSummary::add_solve(long iterations)
{
  constraint_iterations_ +=
      static_cast<double>(iterations) * static_cast<double>(step_.problem.contacts.size());
}

void RunSummary::add_step(const inelastic::ProjectionResult &result)
{
  ++steps_;
  if (step_.at_rest) ++at_rest_;
  if (step_.waits && step_.largest_overlap > step_.settings.tolerance) ++waited_;
  iterations_ += static_cast<double>(result.iterations);
  largest_excess_ = std::max(largest_excess_, step_.excess);
  const bool of_start = step_.bad_start && pushed_at_start_ == steps_ - 1;
  if (step_.bad_start) ++(of_start ? pushed_at_start_ : pushed_later_);
  double &overlap = of_start ? overlap_of_start_ : largest_overlap_;
  overlap = std::max(overlap, step_.largest_overlap);
}

void RunSummary::log(long shortened_steps, long unexpected_steps, const HardSteps::Counts &hard,
                     const PushApart::Left &left, const EnergyWatch &energy,
                     const Unrest &unrest) const
{
  const bool all_pushed = pushed_at_start_ == steps_;
  const double overlap = all_pushed ? overlap_of_start_ : largest_overlap_;
  if (comm->me == 0) {
    utils::logmesg(
        lmp,
        "Fix inelastic: {} projections, {:.0f} iterations, largest overlap {:.6g} = {:.4g} "
        "tolerances, {} shortened steps\n",
        steps_, iterations_, overlap, overlap / step_.settings.tolerance,
        shortened_steps - shortened_before_);
    log_overlaps(unexpected_steps, left);
    log_given_back(energy);
    log_hard_steps(hard);
    log_unrest(unrest);
  }
  log_times();
}

void RunSummary::log_overlaps(long unexpected_steps, const PushApart::Left &left) const
{
  if (pushed_at_start_ > 0 && pushed_at_start_ < steps_)
    utils::logmesg(
        lmp, "  before that, {} steps pushed the overlaps of the start, up to {:.6g}, apart\n",
        pushed_at_start_, overlap_of_start_);
  else if (pushed_at_start_ > 0 && left.number == 0.0)
    utils::logmesg(lmp, "  all steps pushed the overlaps of the start apart\n");
  if (left.number > 0.0)
    error->warning(
        FLERR,
        "Fix inelastic: {:.0f} overlaps of more than 2 tolerances, up to {:.4g} ({:.3g} "
        "tolerances; {}), are left after {} steps that pushed them apart: let more steps "
        "pass, or make more room",
        left.number, left.largest, left.largest / step_.settings.tolerance, left.named,
        pushed_at_start_ + pushed_later_);
  if (largest_excess_ > 0.0)
    utils::logmesg(
        lmp,
        "  {} left overlaps of up to {:.6g} beyond 2 tolerances: a shorter timestep, or shorten "
        "yes, avoids them\n",
        step_.has_bodies ? "turning bodies, or the curvature of walls," : "the curvature of walls",
        largest_excess_);
  if (pushed_later_ > 0)
    utils::logmesg(
        lmp,
        "  {} later steps began with overlaps of more than 2 tolerances, and pushed them apart\n",
        pushed_later_);
  if (unexpected_steps > 0)
    utils::logmesg(lmp, "  in {} steps such an overlap had appeared that no step had left\n",
                   unexpected_steps);
  if (at_rest_ > 0)
    utils::logmesg(lmp, "  in {} steps the scene was at rest, and nothing moved\n", at_rest_);
}

void RunSummary::log_given_back(const EnergyWatch &energy) const
{
  if (waited_ > 0)
    utils::logmesg(
        lmp, "  in {} steps overlaps stayed, since there was no room to give them back\n", waited_);
  const double most_added = energy.most();
  if (most_added > 0.0)
    utils::logmesg(lmp,
                   "  contacts added at most {:.3g} to the kinetic energy in a step, by overlaps "
                   "that they gave back\n",
                   most_added);
  if (energy.steps_of_law() > 0)
    utils::logmesg(lmp, "  in {} steps collisions, or bodies that turned far, added energy{}\n",
                   energy.steps_of_law(),
                   step_.settings.shorten ? ", however short the step"
                                          : ": a shorter timestep, or shorten yes, avoids it");
}

void RunSummary::log_hard_steps(const HardSteps::Counts &hard) const
{
  if (hard.shortened > 0)
    utils::logmesg(lmp, "  {} steps were shortened because they could not be solved\n",
                   hard.shortened);
  if (hard.inaccurate > 0)
    utils::logmesg(
        lmp, "  in {} steps the accuracy was not reached, only the tolerance{}\n", hard.inaccurate,
        hard.at_maxiter > 0 ? fmt::format("; {} of them ended at maxiter", hard.at_maxiter) : "");
  if (unconverged_ > 0)
    utils::logmesg(lmp, "  {} projections did not reach the tolerance within maxiter\n",
                   unconverged_);
}

// Programs read this line.
void RunSummary::log_unrest(const Unrest &unrest) const
{
  if (!unrest.is_known()) return;
  utils::logmesg(
      lmp, "  at its end the scene is {}: rms speed {:.3g} g h, net force {:.3g} of the weight\n",
      unrest.is_at_rest() ? "at rest" : "NOT AT REST", unrest.speed(), unrest.net_force());
}

void RunSummary::log_times() const
{
  double mine[PhaseClock::OUTSIDE + 1], sums[PhaseClock::OUTSIDE + 1];
  for (int phase = 0; phase < PhaseClock::OUTSIDE; ++phase)
    mine[phase] = clock_.seconds(static_cast<PhaseClock::Phase>(phase));
  mine[PhaseClock::OUTSIDE] = constraint_iterations_;
  MPI_Reduce(mine, sums, PhaseClock::OUTSIDE + 1, MPI_DOUBLE, MPI_SUM, 0, world);
  if (comm->me != 0) return;
  for (double &sum : sums) sum /= comm->nprocs;
  std::string text = fmt::format(
      "  seconds: collect {:.3f}, solve {:.3f}, communicate {:.3f}, check {:.3f}, apply {:.3f}",
      sums[PhaseClock::COLLECT], sums[PhaseClock::SOLVE], sums[PhaseClock::COMMUNICATE],
      sums[PhaseClock::CHECK], sums[PhaseClock::APPLY]);
  if (sums[PhaseClock::OUTSIDE] > 0.0)
    text += fmt::format("; solve takes {:.1f} us an iteration, {:.2f} ns a constraint",
                        1.0e6 * sums[PhaseClock::SOLVE] / iterations_,
                        1.0e9 * sums[PhaseClock::SOLVE] / sums[PhaseClock::OUTSIDE]);
  utils::logmesg(lmp, text + "\n");
}
