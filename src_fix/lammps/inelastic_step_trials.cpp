#include "inelastic_step_trials.h"

#include "inelastic_constraints.h"
#include "inelastic_ghost_exchange.h"
#include "inelastic_make_solver.h"
#include "inelastic_phase_clock.h"
#include "inelastic_run_summary.h"
#include "inelastic_step_length.h"

#include "update.h"

#include <limits>
#include <utility>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

constexpr int MAX_ROUNDS = 100;    // of adding constraints; a handful is usual

}    // namespace

StepTrials::StepTrials(LAMMPS *lmp, Step &step, Constraints &constraints, StepLength &length,
                       Movers &movers, GhostExchange &ranks, RunSummary &summary, PhaseClock &clock,
                       std::function<void()> predict) :
    Pointers(lmp), step_(step), constraints_(constraints), length_(length),
    predict_(std::move(predict)), ranks_(ranks), summary_(summary), clock_(clock),
    solver_(inelastic::make_solver(step.settings.solver)),
    push_apart_(lmp, step, constraints, ranks, movers), hard_(lmp, step, constraints, ranks),
    energy_(lmp, step, constraints.rules(), ranks, movers),
    unsolved_(lmp, step, constraints, hard_, ranks, movers), squeezed_(lmp, step, ranks),
    record_(lmp, step, ranks)
{
}

void StepTrials::begin_summary()
{
  hard_.begin_run();
  energy_.begin_run();
}

inelastic::ProjectionResult StepTrials::solve()
{
  length_.begin_step();
  unsolved_.begin_step();
  hard_.begin_step();
  step_.keeps_overlaps = constraints_.overlaps().pushed_before();
  step_.waits = energy_.waits_on();
  inelastic::ProjectionResult result;
  while (try_once(result) != Again::NO) {}
  return result;
}

StepTrials::Again StepTrials::try_once(inelastic::ProjectionResult &result)
{
  step_.keeps_overlaps = step_.keeps_overlaps || step_.waits;
  unsolved_.begin_trial();
  length_.fit_to_list();
  predict_();
  constraints_.collect();
  constraints_.overlaps().share();
  // Beside bad overlaps, which count as touching and may leave no room, regular ones are kept.
  const bool keeps = step_.waits || step_.bad_start;
  if (keeps != step_.keeps_overlaps) {
    step_.keeps_overlaps = keeps;
    return Again::KEEPS_OVERLAPS;
  }
  result = project(step_.settings.max_iterations);
  record(result);
  push(result);
  const Again again = judge(result);
  if (again != Again::NO) return again;
  const bool solved = result.status == inelastic::Status::CONVERGED;
  look_for_squeezed(solved);
  return length_.accepts(solved, unsolved_.named(), squeezed_.said()) ? Again::NO : Again::TOO_FAR;
}

void StepTrials::record(const inelastic::ProjectionResult &result)
{
  const long every = step_.settings.record_every;
  if (every > 0 && step_.kick == Kick::WHOLE && update->ntimestep % every == 0)
    record_.write(result);
}

void StepTrials::push(inelastic::ProjectionResult &result)
{
  if (!step_.bad_start) {
    push_apart_.skip();
    return;
  }
  push_apart_.run(result, [this](long iterations) {
    return project(iterations);
  });
  if (push_apart_.in_vain()) unsolved_.report_jam(push_apart_.left());
}

void StepTrials::look_for_squeezed(bool solved)
{
  if (solved && !step_.bad_start && constraints_.walls_move())
    squeezed_.look();
  else
    squeezed_.skip();
}

StepTrials::Again StepTrials::judge(inelastic::ProjectionResult &result)
{
  const auto is_solved = [&] {
    return result.status == inelastic::Status::CONVERGED;
  };
  // Where the step may be without room for what it gives back, it gives nothing back.
  if (!is_solved() && !step_.bad_start && !step_.waits && energy_.gives_back()) {
    waits_for_room();
    return Again::WAITS;
  }
  // What can hardly be solved looks solved in a step that is short enough, in which EPS is more
  // than anything moves.
  const bool hardly = hard_.has_shortened() && hard_.is_hardly_solved(result);
  if (!is_solved() || hardly) {
    const bool no_room = result.status == inelastic::Status::INFEASIBLE;
    if (no_room) unsolved_.note_no_room();
    // Gaps at the end of the step, or speeds at which surfaces part, may be had together in a
    // shorter one. Any other step takes fewer iterations when it is shorter; with warn a run that
    // has few of them goes on, as it is.
    const bool law_parts = unsolved_.law_parts();
    if ((no_room || !step_.settings.warn_only || constraints_.relinearised() || law_parts ||
         hardly) &&
        halves(law_parts)) {
      hard_.note_shortened();
      return Again::UNSOLVED;
    }
    summary_.add_unconverged();
    unsolved_.report(result);
  }
  // A step that is not solved, or pushes a bad start apart, says so itself.
  if (!is_solved() || step_.bad_start) return Again::NO;
  if (adds_too_much(result)) {
    if (!step_.waits) {
      waits_for_room();
      return Again::WAITS;
    }
    if (halves(false)) {
      hard_.note_shortened();
      return Again::ADDS_ENERGY;
    }
    unsolved_.report_energy(energy_.times_too_much());
  }
  return energy_.law_adds() && halves(true) ? Again::LAW_ADDS : Again::NO;
}

// Overlaps stay as deep as they are in the step, which has no room to give them back.
void StepTrials::waits_for_room()
{
  energy_.note_no_room();
  step_.waits = true;
}

// Halves the step if the keyword allows it, and tells whether.
bool StepTrials::halves(bool law_parts)
{
  if (!length_.may_shorten_unsolved(law_parts)) return false;
  length_.shorten(0.5, unsolved_.named());
  return true;
}

// Tells whether contacts add more energy than they may. Where they do though nothing is given back,
// they are not solved as far as they have to be: the step is first solved to its targets here.
bool StepTrials::adds_too_much(inelastic::ProjectionResult &result)
{
  if (!energy_.adds_too_much(solver_->targets().resolved())) return false;
  if (!step_.waits || result.accurate) return true;
  const inelastic::ProjectionResult better = project(step_.settings.max_iterations, true);
  result.iterations += better.iterations;
  result.residual = better.residual;
  result.accurate = better.accurate;
  result.unresolved = better.unresolved;
  return better.status != inelastic::Status::CONVERGED ||
      energy_.adds_too_much(solver_->targets().resolved());
}

bool StepTrials::refine(inelastic::ProjectionResult &result)
{
  const inelastic::ProjectionResult refined =
      project(step_.settings.max_iterations - result.iterations);
  result.iterations += refined.iterations;
  result.status = refined.status;
  result.residual = refined.residual;
  result.accurate = refined.accurate;
  result.unresolved = refined.unresolved;
  if (refined.status == inelastic::Status::CONVERGED) return true;
  summary_.add_unconverged();
  unsolved_.report(result);
  return false;
}

double StepTrials::least_length() const
{ return std::numeric_limits<double>::epsilon() * length_.list().smallest_radius(); }

inelastic::ProjectionResult StepTrials::project(long max_iterations, bool to_targets)
{
  const PhaseClock::Within within(clock_, PhaseClock::SOLVE);
  // No step goes further than the list reaches: it is shortened, or it is an error.
  constexpr double BEYOND_REACH = 10.0;
  const double reach = (step_.settings.shorten ? 1.0 : BEYOND_REACH) * length_.list().reach();
  inelastic::SolverLimits limits = {step_.settings.tolerance, max_iterations, reach};
  limits.least_length = least_length();
  // The accuracy is that of momentum, and a push is none.
  if (step_.phase == Phase::CONTACT) {
    // Bodies turn: their constraints are linearised anew in many rounds, of which only the last
    // ones matter.
    constexpr double COARSE = 32.0;
    limits.accuracy = step_.settings.accuracy;
    limits.to_targets = to_targets;
    if (step_.has_bodies) limits.coarseness = COARSE;
  }
  const inelastic::ProjectionResult result = inelastic::project(
      step_.problem, constraints_, *solver_, limits, MAX_ROUNDS, ranks_, step_.velocity);
  if (result.status != inelastic::Status::CONVERGED) unsolved_.note_worst(result);
  summary_.add_solve(result.iterations);
  return result;
}

void StepTrials::end_step(const inelastic::ProjectionResult &result)
{
  hard_.end_step(result);
  energy_.end_step();
  squeezed_.warn();
}
