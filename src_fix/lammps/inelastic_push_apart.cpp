#include "inelastic_push_apart.h"

#include "inelastic_constraints.h"
#include "inelastic_mover.h"
#include "inelastic_step.h"

#include <algorithm>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;

namespace {

// Spheres that jam for a moment cannot all be taken apart at once: then this part of it is asked
// for.
constexpr double LESS = 0.25;

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

// Sets the contacts back to those of the first projection. What earlier trials have found stays: it
// is known to be in the problem, and nobody would find it again.
void PushApart::begin_trial(const inelastic::ContactSet &contacts)
{
  inelastic::ContactSet &present = step_.problem.contacts;
  const inelastic::ContactSet last = present;
  present = contacts;
  for (std::size_t c = contacts.size(); c < last.size(); ++c) present.add_of(last, c);
  step_.approaches.clear();
}

// A push that begins asks for everything.
void PushApart::begin_push()
{
  part_ = 1.0;
  easy_ = looked_ = 0;
  stuck_ = false;
}

// Where only parts are opened, and overlaps get no smaller by that, there is no room.
void PushApart::look_for_progress()
{
  constexpr int EVERY = 50;    // steps
  constexpr double PROGRESS = 0.9;
  if (part_ == 1.0) looked_ = 0;
  if (looked_ == 0) largest_before_ = step_.largest_overlap;
  if (part_ == 1.0 || ++looked_ <= EVERY) return;
  stuck_ = step_.largest_overlap > PROGRESS * largest_before_;
  looked_ = 0;
}

// Asks for this part of what bad overlaps are to be opened by.
void PushApart::ask_for(double part, const Atom *atom)
{
  inelastic::ContactSet &contacts = step_.problem.contacts;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const Contact &contact = step_.contact_of(c);
    // A gap that counted as closed in the first projection is taken as it is here.
    if (contact.gap_now <= step_.settings.tolerance)
      contacts.gap[c] =
          (contact.gap_now < 0.0 ? part : 1.0) * constraints_.rules().effective_gap(contact) -
          step_.rows[c].wall_motion;
    contacts.impulse[c] = 0.0;
  }
  if (movers_.any_turns()) constraints_.entangled().disentangle(atom, constraints_.overlaps());
}

// The next step begins with the part that was solved, and now and then asks for more.
void PushApart::note_solved(double part, bool at_once)
{
  constexpr int EASY = 8;    // steps
  stuck_ = false;
  easy_ = at_once ? easy_ + 1 : 0;
  part_ = part;
  if (easy_ < EASY) return;
  part_ = std::min(1.0, part / LESS);
  easy_ = 0;
}

void PushApart::run(const Atom *atom, inelastic::ProjectionResult &result, const Project &project)
{
  inelastic::ContactProblem &problem = step_.problem;
  const inelastic::ContactSet contacts = problem.contacts;
  const std::size_t number_of_contacts = step_.contacts.size();
  problem.predicted_velocity = step_.velocity;
  step_.phase = Phase::PUSH;
  step_.relinearisations = 0;
  if (movers_.any_turns()) constraints_.entangled().find();
  if (!constraints_.overlaps().pushed_before()) begin_push();
  look_for_progress();
  // Iterations of a trial. Thousands of spheres that have room for what is asked take far fewer.
  constexpr long MOST = 10000;
  constexpr double LEAST = 1.0e-3;
  double part = stuck_ ? 1.0 : part_;
  bool solved = false;
  for (int trial = 0; !solved; ++trial) {
    begin_trial(contacts);
    ask_for(part, atom);
    const bool last = stuck_ || LESS * part < LEAST;
    const long left = std::max(0L, step_.settings.max_iterations - result.iterations);
    const inelastic::ProjectionResult pushed = project(last ? left : std::min(MOST, left / 4));
    solved = pushed.status == inelastic::Status::CONVERGED;
    if (solved || last) add(result, pushed);
    if (solved) note_solved(part, trial == 0);
    if (solved || last) break;
    result.iterations += pushed.iterations;
    part *= LESS;
  }

  problem.contacts = contacts;
  step_.rows.resize(contacts.size());
  step_.contacts.resize(number_of_contacts);
  if (!step_.law_states.empty()) step_.law_states.resize(number_of_contacts);
  movers_.note_push(problem, step_.velocity);
}
