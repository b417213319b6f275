#include "inelastic_motion_check.h"

#include "inelastic_atom_state.h"
#include "inelastic_ghost_exchange.h"
#include "inelastic_mover.h"
#include "inelastic_periods.h"

#include "atom.h"
#include "fix.h"
#include "force.h"
#include "group.h"
#include "modify.h"
#include "update.h"

#include "fmt/format.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::norm;

namespace {

// The round-off of a predicted motion, as a part of what it comes from.
constexpr double EXPECTED_RELATIVE = 1.0e-12;

}    // namespace

MotionCheck::MotionCheck(LAMMPS *lmp, const Fix *fix, Step &step, GhostExchange &ranks,
                         AtomState &state, Movers &movers) :
    Pointers(lmp), fix_(fix), step_(step), ranks_(ranks), state_(state), movers_(movers),
    scene_(lmp)
{
}

void MotionCheck::check_other_fixes() const
{ scene_.check(step_.settings.shorten); }

void MotionCheck::begin_run()
{
  const SceneCheck::Group group = {step_.settings.group_bit, step_.settings.frozen_bit,
                                   movers_.any_turns()};
  scene_.check_held(group);
  scene_.warn_of_hidden_pairs(group);
  scene_.warn_of_counts();
  step_.continues = false;
}

void MotionCheck::set_up()
{
  step_.continues = false;
  goes_on_ = true;
  scene_.remember_box();
}

void MotionCheck::end_run(bool pushing)
{
  goes_on_ = false;
  ended_pushing_ = pushing;
}

// All ranks stop together, and before a number that is not finite shortens the time step.
void MotionCheck::before_step()
{
  const std::string broken = break_in_run();
  ranks_.fail_together(broken.empty() ? not_finite() : broken);
  if (step_.continues) compare_all();
}

void MotionCheck::after_step(double largest_change)
{
  // The angular momentum of a body is carried along: so is its round-off.
  largest_change_ = movers_.any_turns() && step_.continues
      ? std::max(largest_change_, largest_change)
      : largest_change;
  for (int i = 0; i < atom->nlocal; ++i)
    state_.expected_radius(i) = step_.in_group(atom, i) ? atom->radius[i] : AtomState::OUTSIDE;
  step_.continues = true;
}

// Names a force or velocity of this rank that is no number; empty if there is none.
std::string MotionCheck::not_finite() const
{
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!step_.in_group(atom, i)) continue;
    const double kick = step_.is_mobile(atom, i)
        ? step_.kicks() * update->dt * force->ftm2v / mass_of(atom, i)
        : 0.0;
    const double *const v = atom->v[i];
    const double *const f = atom->f[i];
    const double after[3] = {v[0] + kick * f[0], v[1] + kick * f[1], v[2] + kick * f[2]};
    if (std::isfinite(norm(v)) && std::isfinite(norm(after))) continue;
    return !std::isfinite(norm(v))
        ? fmt::format("the velocity of atom {} is not a finite number", atom->tag[i])
        : fmt::format("the force on atom {} is not a finite number, or too large to be one",
                      atom->tag[i]);
  }
  return "";
}

// Returns why the step cannot follow from the last one; empty if it can. It cannot where the box
// has changed, nor in a run without a setup (`run pre no`) if the end of the run before took a push
// out of the velocities.
std::string MotionCheck::break_in_run()
{
  first_without_setup_ = false;
  if (!step_.continues) return "";
  const bool went_on = goes_on_;
  goes_on_ = true;
  first_without_setup_ = !went_on;
  if (!went_on && ended_pushing_)
    return "run pre no cannot go on from a step that was pushing overlaps apart: leave out pre no";
  return scene_.change_of_box();
}

/* ----------------------------------------------------------------------
   what moved, and what the last step predicted
------------------------------------------------------------------------- */

void MotionCheck::compare_all()
{
  std::string message;
  for (int i = 0; i < atom->nlocal && message.empty(); ++i)
    if (step_.in_group(atom, i)) message = compare(i);
  if (movers_.any_turns()) {
    double failed = message.empty() ? 0.0 : 1.0;
    ranks_.reduce(nullptr, 0, &failed, 1);
    // Masses and moments agreed when the run began.
    if (failed > 0.0) {
      if (!movers_.measure().empty())
        message = fmt::format("the spheres of a body have moved against one another: another fix "
                              "moves them beside fix {}",
                              movers_.fix()->id);
    }
  }
  ranks_.fail_together(message);
}

std::string MotionCheck::compare(int i) const
{
  const std::string changed = changed_before(i);
  if (!changed.empty()) return changed;
  const double h = step_.problem.timestep;    // of the step that is over, shortened or not
  const double *const expected_x = state_.expected_position(i);
  const double *const expected_v = state_.expected_velocity(i);
  double off[3] = {atom->x[i][0] - expected_x[0], atom->x[i][1] - expected_x[1],
                   atom->x[i][2] - expected_x[2]};
  Periods(lmp).to_nearest_image(off);
  const double faster[3] = {atom->v[i][0] - expected_v[0], atom->v[i][1] - expected_v[1],
                            atom->v[i][2] - expected_v[2]};
  const bool frozen = (atom->mask[i] & step_.settings.frozen_bit) != 0;
  const double round_off = EXPECTED_RELATIVE *
      (norm(atom->x[i]) + step_.largest_radius + h * (norm(expected_v) + largest_change_)) *
      (movers_.any_turns() ? state_.momenta().round_off_growth(i) : 1.0);
  const double allowed = step_.eps(frozen ? in_eps::ALLOWED : in_eps::PREDICTED) + round_off;
  const double position_error = norm(off);
  const double velocity_error = frozen ? 0.0 : h * norm(faster);
  if (position_error <= allowed && velocity_error <= allowed) return "";
  if (frozen)
    return fmt::format(
        "frozen atom {} is {:.3g} away from where its velocity takes it: give it the velocity "
        "that it moves "
        "with (command velocity), the same during a step, or none if nothing moves it",
        atom->tag[i], position_error);
  return moved_otherwise(i, position_error, velocity_error, norm(faster));
}

// Says how the atom itself is another one than in the last step; empty if it is not.
std::string MotionCheck::changed_before(int i) const
{
  const double expected_radius = state_.expected_radius(i);
  if (expected_radius == AtomState::OUTSIDE)
    return fmt::format("atom {} has joined group {} during the run: change groups between runs",
                       atom->tag[i], group->names[fix_->igroup]);
  if (atom->radius[i] == expected_radius) return "";
  const std::string changing = scene_.fixes_that_change_radii();
  return fmt::format("the radius of atom {} has changed during the run by {:.3g}, and the "
                     "contacts do not follow it: change radii between runs{}{}",
                     atom->tag[i], atom->radius[i] - expected_radius,
                     changing.empty() ? "" : ". Fixes that may have:", changing);
}

std::string MotionCheck::moved_otherwise(int i, double position_error, double velocity_error,
                                         double speed_error) const
{
  std::string unfrozen;
  for (const Fix *fix : modify->get_fix_by_style("^move$"))
    if (atom->mask[i] & fix->groupbit)
      unfrozen = fmt::format("atom {} is moved by fix {} (move) and is not frozen: name its group "
                             "with the keyword frozen",
                             atom->tag[i], fix->id);
  if (!unfrozen.empty()) return unfrozen;
  if (!scene_.is_integrated(i))
    return fmt::format("no fix moves atom {}: a sphere that is to stay where it is needs the "
                       "keyword frozen, others "
                       "fix nve or nve/sphere",
                       atom->tag[i]);
  if (first_without_setup_)
    return fmt::format(
        "the position or velocity of atom {} was changed before run pre no, which goes on from the "
        "last step: leave out pre no",
        atom->tag[i]);
  const std::string mover = !step_.is_member(i)
      ? "nve or nve/sphere"
      : fmt::format("{} (without its keywords gravity and langevin, forces not taken early)",
                    movers_.fix()->id);
  const std::string later = other_fixes();
  const bool misplaced = position_error > velocity_error;
  return fmt::format("atom {} did not move as predicted: its {} is off by {:.3g}. Move it "
                     "with fix {} alone; define every fix that adds forces before fix {}; let "
                     "nothing else change velocities{}{}",
                     atom->tag[i], misplaced ? "position" : "velocity",
                     misplaced ? position_error : speed_error, mover, fix_->id,
                     later.empty() ? "" : ". Fixes that may have:", later);
}

// The fixes that may have changed forces, velocities or positions after this one.
std::string MotionCheck::other_fixes() const
{
  std::string later;
  bool passed = false;
  const auto &fixes = modify->get_fix_list();
  for (std::size_t k = 0; k < fixes.size(); ++k) {
    if (fixes[k] == fix_)
      passed = true;
    else if ((passed && (modify->fmask[k] & FixConst::POST_FORCE)) ||
             (modify->fmask[k] & (FixConst::END_OF_STEP | FixConst::POST_INTEGRATE)))
      later += fmt::format(" {} ({})", fixes[k]->id, fixes[k]->style);
  }
  return later;
}
