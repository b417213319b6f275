#include "inelastic_rest.h"

#include "inelastic_atom_state.h"
#include "inelastic_ghost_exchange.h"
#include "inelastic_make_solver.h"
#include "inelastic_mover.h"

#include "atom.h"

#include <algorithm>
#include <cmath>
#include <utility>

using namespace LAMMPS_NS;
using namespace Inelastic_NS;
using inelastic::norm;

namespace {

// The part of the accuracy to which contacts are solved in a trial, and before a cluster at rest is
// let go. The residuals of a bed, which is isostatic, make velocities of some fifty times their
// size.
constexpr double REFINED = 1.0 / 4.0;
// A trial that does not tell motion from errors is solved again to this part of it, down to the
// finest.
constexpr double FINER = 1.0 / 4.0, FINEST = 1.0 / 64.0;
// So often a step is solved on trial: more accurately, or without particles that it does not find
// held.
constexpr int MOST_TRIALS = 12;
// What is at rest shows it in few iterations, since its forces are known: the first trial takes as
// many as the step, or this number, and more accurate ones so many times that.
constexpr long MOST_ITERATIONS = 250, MORE_ITERATIONS = 4;

}    // namespace

Rest::Rest(LAMMPS *lmp, Step &step, GhostExchange &ranks, AtomState &state, Movers &movers) :
    Pointers(lmp), step_(step), ranks_(ranks), state_(state), rules_(step),
    motions_(lmp, step, ranks, state), trial_(step, ranks, movers),
    hold_still_(step, ranks, movers, inelastic::make_solver("apgd"))
{
}

void Rest::compare_loads()
{
  step_.load_change.clear();
  if (!any_stopped_) return;
  const inelastic::ContactProblem &problem = step_.problem;
  step_.load_change.assign(problem.particles, 0.0);
  for (int i = 0; i < atom->nlocal; ++i) {
    const double before = step_.impulse_per_force * state_.load_at_rest(i);
    if (before == 0.0) continue;
    step_.load_change[i] =
        norm(&problem.predicted_velocity[3 * static_cast<std::size_t>(i)]) / before;
  }
  ranks_.share_with_ghosts(step_.load_change.data(), 1);
}

bool Rest::look(const inelastic::ProjectionResult &result)
{
  // A step that is shortened, or pushes spheres apart, or whose contacts are not as accurate as
  // they should be, tells nothing of rest. Uzawa starts every step from no forces at all: rest
  // would save it nothing. Without atoms there are no bodies, either.
  looks_ = step_.settings.rest && step_.settings.solver != "uzawa" && step_.largest_radius > 0.0 &&
      step_.problem.timestep == step_.regular_timestep && !step_.bad_start &&
      result.status == inelastic::Status::CONVERGED && result.accurate;
  if (!looks_) {
    forget();
    return false;
  }
  iterations_ = result.iterations;
  motions_.find();
  look_again();
  inelastic::ContactSet &contacts = step_.problem.contacts;
  const Clusters &clusters = motions_.clusters();
  double any = 0.0;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const int one = clusters.of(contacts.first[c]), other = clusters.of(contacts.second[c]);
    const bool refines = (one != Clusters::NONE && rules_.needs_refinement(motions_[one])) ||
        (other != Clusters::NONE && rules_.needs_refinement(motions_[other]));
    contacts.refinement[c] = std::min(refines ? REFINED : 1.0, step_.contact_of(c).refinement());
    if (refines) any = 1.0;
  }
  ranks_.reduce(nullptr, 0, &any, 1);
  return any > 0.0;
}

void Rest::look_again()
{ motions_.measure(RestRules::PATIENCE); }

void Rest::forget()
{
  for (int i = 0; i < atom->nlocal; ++i)
    state_.quiet_steps(i) = std::min(state_.quiet_steps(i), 0.0);
}

/* ----------------------------------------------------------------------
   which clusters rest
------------------------------------------------------------------------- */

long Rest::hold(const HoldStill::Constraints &constraints, double least_length)
{
  step_.at_rest = any_stopped_ = false;
  if (!looks_) return 0;
  decide();
  long iterations = try_clusters(least_length);
  HoldStill::Held held;
  hold_still_.begin();
  while (any_stopped()) {
    take_trial();
    held = held_now();
    const bool has_room = hold_still_.run(held, constraints);
    if (has_room && !let_go_unbalanced(hold_still_.find_by_contacts(), held)) {
      hold_still_.stop(held);
      break;
    }
    hold_still_.go_back();
    held = HoldStill::Held{};
    // Without room nothing is stopped in this step; what rests does so again in the next, perhaps.
    if (!has_room) break;
  }
  end_step(held);
  return iterations + hold_still_.iterations();
}

// Finds what becomes of the clusters by what the step shows.
void Rest::decide()
{
  fates_.assign(motions_.size(), Fate::MOVES);
  held_in_trial_.assign(motions_.size(), Directions{});
  held_.assign(step_.problem.particles, 0);
  unit_.assign(step_.problem.particles, 0.0);
  for (std::size_t k = 0; k < fates_.size(); ++k) {
    const ClusterMotion &cluster = motions_[k];
    if (rules_.is_at_rest(cluster))
      fates_[k] = rules_.is_quiet(cluster) && !rules_.moves(cluster) ? Fate::RESTS : Fate::LET_GO;
    // In the half kick of a run nothing is tried: velocities may have been given.
    else if ((cluster.quiet_steps == RestRules::PATIENCE || rules_.was_at_rest(cluster)) &&
             rules_.is_quiet(cluster) && rules_.is_slow(cluster) && step_.kick == Kick::WHOLE)
      fates_[k] = Fate::FAILS;
  }
  mark_held(Fate::RESTS);
}

// Marks the held particles of the clusters of one fate, as the step is now.
void Rest::mark_held(Fate fate)
{
  for (std::size_t i = 0; i < held_.size(); ++i) {
    const int k = motions_.clusters().of(static_cast<int>(i));
    if (k != Clusters::NONE && fates_[k] == fate) held_[i] = 0;
  }
  std::vector<double> marks(held_.size(), 0.0);
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!motions_.counts(i) || fates_[motions_.clusters().of(i)] != fate) continue;
    const Motion motion = motions_.motion_of(i);
    if (!motions_.is_held(i, motion)) continue;
    marks[i] = 1.0;
    unit_[i] = motions_.unit(i, motion);
  }
  ranks_.share_with_ghosts(marks.data(), 1);
  const inelastic::RigidBodies &bodies = step_.problem.bodies;
  for (std::size_t i = 0; i < held_.size(); ++i)
    if (marks[i] != 0.0) held_[i] = 1;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const auto first = bodies.member.begin() + bodies.start[b];
    const auto last = bodies.member.begin() + bodies.start[b + 1];
    const bool any = std::any_of(first, last, [&](int i) {
      return marks[i] != 0.0;
    });
    if (!any) continue;
    std::for_each(first, last, [this](int i) {
      held_[i] = 1;
    });
  }
}

RestTrial::Begun Rest::begin_trial() const
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  const Clusters &clusters = motions_.clusters();
  const auto is_tried = [&](int slot) {
    const int k = clusters.of(slot);
    return k != Clusters::NONE && fates_[k] == Fate::FAILS;
  };
  RestTrial::Begun begun;
  begun.particles.assign(held_.size(), 0);
  for (std::size_t i = 0; i < held_.size(); ++i)
    begun.particles[i] = held_[i] && is_tried(static_cast<int>(i));
  begun.common = common_velocities(atom, clusters, held_directions(), trial_.velocity_before(),
                                   begun.particles);
  for (std::size_t c = 0; c < contacts.size(); ++c)
    begun.constraints.push_back(is_tried(contacts.first[c]) || is_tried(contacts.second[c]));
  return begun;
}

// Tries the clusters that fail as long as no trial shows that they rest.
long Rest::try_clusters(double least_length)
{
  double any = std::count(fates_.begin(), fates_.end(), Fate::FAILS) > 0 ? 1.0 : 0.0;
  ranks_.reduce(nullptr, 0, &any, 1);
  if (any == 0.0) return 0;
  mark_held(Fate::FAILS);
  trial_.begin();
  begun_ = begin_trial();
  for (std::size_t i = 0; i < held_.size(); ++i)
    if (begun_.particles[i]) held_[i] = 0;
  std::vector<ClusterMotion> of_trial(motions_.size()), of_coarser(motions_.size());
  const long most = std::max(MOST_ITERATIONS, iterations_);
  double refinement = REFINED;
  for (int k = 0; k < MOST_TRIALS; ++k) {
    const long iterations = refinement < REFINED ? MORE_ITERATIONS * most : most;
    const bool solved = trial_.run(begun_, refinement, least_length, iterations);
    const bool undecided = judge_trial(solved, of_coarser, of_trial);
    if (!solved) break;
    if (drop_what_is_not_held()) continue;
    if (!undecided || refinement <= FINEST) break;
    refinement *= FINER;
    of_coarser.swap(of_trial);
  }
  // One that fails goes on as in the step, and may push another one.
  while (fail_pushed_by_others()) {}
  return trial_.iterations();
}

// Lets the clusters that are tried pass or fail by their motions in the trial, which it sets, and
// those in the last less accurate one. Returns whether a more accurate one may let more of them
// pass. Collective.
bool Rest::judge_trial(bool solved, const std::vector<ClusterMotion> &of_coarser,
                       std::vector<ClusterMotion> &of_trial)
{
  std::vector<ClusterMotion> of_step(motions_.size());
  for (std::size_t k = 0; k < of_step.size(); ++k) of_step[k] = motions_[k];
  trial_.exchange();
  look_again();
  double undecided = 0.0;
  for (std::size_t k = 0; k < fates_.size(); ++k) {
    const ClusterMotion &cluster = of_trial[k] = motions_[k];
    if (fates_[k] != Fate::FAILS && fates_[k] != Fate::PASSES) continue;
    fates_[k] = Fate::FAILS;
    if (!solved || !rules_.is_quiet(cluster) || rules_.moves(cluster)) continue;
    // What was at rest before the last step did not slip then.
    if (rules_.was_at_rest(cluster) || !rules_.slips(cluster, of_coarser[k])) {
      fates_[k] = Fate::PASSES;
      held_in_trial_[k] = cluster.held;
    } else
      undecided = 1.0;
  }
  mark_held(Fate::PASSES);
  trial_.exchange();
  motions_.swap(of_step);
  ranks_.reduce(nullptr, 0, &undecided, 1);
  return undecided > 0.0;
}

// A particle that began the trial at rest and is not held when it ends would lose what it had: its
// cluster fails, and the particle is left out of what begins at rest. Returns whether there is one.
// Collective.
bool Rest::drop_what_is_not_held()
{
  std::vector<double> lost(motions_.size(), 0.0);
  for (std::size_t i = 0; i < held_.size(); ++i) {
    const int slot = static_cast<int>(i);
    if (!begun_.particles[i] || held_[i] || !passes(slot)) continue;
    begun_.particles[i] = 0;
    lost[motions_.clusters().of(slot)] = 1.0;
  }
  return fail(lost);
}

// Fails clusters that pass and have a contact whose force in the trial is another one than in the
// step, with something that goes on as it does in the step: that would take no part in the force.
// Returns whether there are some. Collective.
bool Rest::fail_pushed_by_others()
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  std::vector<double> pushed(motions_.size(), 0.0);
  for (std::size_t c = 0; c < trial_.impulse().size() && c < contacts.size(); ++c) {
    const int i = contacts.first[c], j = contacts.second[c];
    if (passes(i) == passes(j) || trial_.impulse()[c] == contacts.impulse[c]) continue;
    const auto [mine, other] = passes(i) ? std::pair{i, j} : std::pair{j, i};
    if (step_.problem.is_mobile(other)) pushed[motions_.clusters().of(mine)] = 1.0;
  }
  return fail(pushed);
}

// Fails those clusters that pass and are marked on some rank. Returns whether there are some.
// Collective.
bool Rest::fail(std::vector<double> marked)
{
  std::vector<double> none(marked.size(), 0.0);
  motions_.clusters().over_ranks(1, none, 1, marked);
  double any = 0.0;
  for (std::size_t k = 0; k < fates_.size(); ++k) {
    if (fates_[k] != Fate::PASSES || marked[k] == 0.0) continue;
    fates_[k] = Fate::FAILS;
    any = 1.0;
  }
  ranks_.reduce(nullptr, 0, &any, 1);
  return any > 0.0;
}

bool Rest::passes(int slot) const
{
  const int k = motions_.clusters().of(slot);
  return k != Clusters::NONE && fates_[k] == Fate::PASSES;
}

bool Rest::is_stopped(int slot) const
{
  const int k = motions_.clusters().of(slot);
  return k != Clusters::NONE && (fates_[k] == Fate::RESTS || fates_[k] == Fate::PASSES);
}

// Over all ranks. Collective.
bool Rest::any_stopped() const
{
  double any = 0.0;
  for (std::size_t i = 0; i < held_.size(); ++i)
    if (held_[i] && is_stopped(static_cast<int>(i))) any = 1.0;
  ranks_.reduce(nullptr, 0, &any, 1);
  return any > 0.0;
}

HoldStill::Held Rest::held_now() const
{
  HoldStill::Held held;
  held.particles.assign(held_.size(), 0);
  for (std::size_t i = 0; i < held_.size(); ++i)
    if (is_stopped(static_cast<int>(i))) held.particles[i] = held_[i];
  held.velocity = common_velocities(atom, motions_.clusters(), held_directions(), step_.velocity,
                                    held.particles);
  return held;
}

// What passes ends as its trial does.
void Rest::take_trial()
{
  inelastic::ContactSet &contacts = step_.problem.contacts;
  for (std::size_t c = 0; c < trial_.impulse().size() && c < contacts.size(); ++c)
    if (passes(contacts.first[c]) || passes(contacts.second[c]))
      contacts.impulse[c] = trial_.impulse()[c];
  for (std::size_t i = 0; i < held_.size(); ++i)
    if (passes(static_cast<int>(i)))
      std::copy_n(&trial_.velocity()[3 * i], 3, &step_.velocity[3 * i]);
}

/* ----------------------------------------------------------------------
   whether forces balance
------------------------------------------------------------------------- */

// Returns by cluster along which directions something outside holds it.
std::vector<Directions> Rest::held_directions() const
{
  std::vector<Directions> held(motions_.size());
  // Contacts of the step may have no force any more in the trial, and then hold nothing.
  for (std::size_t k = 0; k < held.size(); ++k)
    held[k] = fates_[k] == Fate::PASSES ? held_in_trial_[k] : motions_[k].held;
  return held;
}

// Tells whether a contact that connects a cluster which is stopped has no force any more, which it
// had in the step: it passes no momentum on. Collective.
bool Rest::any_fell_apart() const
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  const std::vector<double> &of_step = hold_still_.impulse_before();
  double any = 0.0;
  for (std::size_t c = 0; c < of_step.size(); ++c) {
    const bool lost = of_step[c] != 0.0 && contacts.impulse[c] == 0.0;
    if (lost && (is_stopped(contacts.first[c]) || is_stopped(contacts.second[c]))) any = 1.0;
  }
  ranks_.reduce(nullptr, 0, &any, 1);
  return any > 0.0;
}

// Marks what contacts with a force touch, or touch its body, owned or not. Collective.
std::vector<char> Rest::touched_particles() const
{
  const inelastic::ContactSet &contacts = step_.problem.contacts;
  std::vector<double> touches(held_.size(), 0.0);
  for (std::size_t c = 0; c < contacts.size(); ++c)
    for (const int i : {contacts.first[c], contacts.second[c]})
      if (contacts.impulse[c] != 0.0 && !step_.problem.is_wall(i)) touches[i] = 1.0;
  ranks_.sum_over_ghosts(touches.data(), 1);
  std::vector<char> touched(held_.size());
  for (std::size_t i = 0; i < touched.size(); ++i) touched[i] = touches[i] > 0.0;
  const inelastic::RigidBodies &bodies = step_.problem.bodies;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    char any = 0;
    for (int k = bodies.start[b]; k < bodies.start[b + 1]; ++k) any |= touched[bodies.member[k]];
    for (int k = bodies.start[b]; k < bodies.start[b + 1]; ++k) touched[bodies.member[k]] = any;
  }
  return touched;
}

// Returns the constraints whose gaps end open by more than the tolerance under a force, or deeper
// than the tolerance because of the velocities that held particles are to have.
std::vector<std::size_t> Rest::ends_wrong(const HoldStill::Held &held) const
{
  std::vector<double> ends_with = step_.velocity;
  for (std::size_t i = 0; i < held.particles.size(); ++i)
    if (held.particles[i]) std::copy_n(&held.velocity[3 * i], 3, &ends_with[3 * i]);
  const std::vector<double> &impulse = step_.problem.contacts.impulse;
  const double tolerance = step_.settings.tolerance;
  std::vector<std::size_t> wrong;
  for (std::size_t c = 0; c < impulse.size(); ++c) {
    const double gap = step_.linear_gap_at_end(c, ends_with);
    const bool opened = impulse[c] > 0.0 && gap > tolerance;
    if (opened || gap < std::min(-tolerance, step_.linear_gap_at_end(c, hold_still_.solved())))
      wrong.push_back(c);
  }
  return wrong;
}

// Lets clusters go, or fails them, in which the forces on a held particle do not balance, or are
// none, or whose gaps end wrong. Sets the velocities that the others keep. Returns whether there
// are such clusters. Collective.
bool Rest::let_go_unbalanced(const std::vector<double> &by_contacts, HoldStill::Held &held)
{
  // With it the forces of all contacts leave the momentum of a cluster what it is, and of each of
  // its pieces.
  const Clusters &clusters = motions_.clusters();
  if (any_fell_apart()) {
    const ClusterPieces &pieces = motions_.find_pieces();
    held.velocity =
        common_velocities(atom, pieces.clusters(), pieces.held(), by_contacts, held.particles);
  } else
    held.velocity =
        common_velocities(atom, clusters, held_directions(), by_contacts, held.particles);
  // What begins its rest in this step loses what it had beyond the common velocity, too.
  std::vector<double> balanced = held.velocity;
  for (std::size_t i = 0; i < held.particles.size(); ++i) {
    const int k = clusters.of(static_cast<int>(i));
    if (!held.particles[i] || fates_[k] != Fate::PASSES || !begun_.particles[i]) continue;
    for (std::size_t n = 3 * i; n < 3 * i + 3; ++n)
      balanced[n] += trial_.velocity_before()[n] - begun_.common[n];
  }
  std::vector<double> none(clusters.size(), 0.0), unbalanced(clusters.size(), 0.0);
  for (int i = 0; i < atom->nlocal; ++i) {
    if (!held.particles[i]) continue;
    const int k = clusters.of(i);
    if (motions_.speed_between(i, by_contacts, balanced) > rules_.limit() * unit_[i])
      unbalanced[k] = 1.0;
  }
  const std::vector<char> touched = touched_particles();
  for (int i = 0; i < atom->nlocal; ++i)
    if (held.particles[i] && !touched[i]) unbalanced[clusters.of(i)] = 1.0;
  for (const std::size_t c : ends_wrong(held)) {
    const inelastic::ContactSet &contacts = step_.problem.contacts;
    for (const int i : {contacts.first[c], contacts.second[c]})
      if (is_stopped(i)) unbalanced[static_cast<std::size_t>(clusters.of(i))] = 1.0;
  }
  clusters.over_ranks(1, none, 1, unbalanced);
  double any = 0.0;
  for (std::size_t k = 0; k < fates_.size(); ++k) {
    if (unbalanced[k] == 0.0) continue;
    fates_[k] = fates_[k] == Fate::PASSES ? Fate::FAILS : Fate::UNBALANCED;
    any = 1.0;
  }
  ranks_.reduce(nullptr, 0, &any, 1);
  return any > 0.0;
}

// Counts quiet steps, and keeps the loads of what is stopped.
void Rest::end_step(const HoldStill::Held &held)
{
  double maxima[2] = {0.0, 0.0};    // whether any is stopped, and whether any moves
  for (int i = 0; i < atom->nlocal; ++i) {
    state_.load_at_rest(i) = 0.0;
    if (!motions_.counts(i)) continue;
    const ClusterMotion &cluster = motions_.of(i);
    const Fate fate = fates_[motions_.clusters().of(i)];
    const bool stopped = !held.particles.empty() && held.particles[i];
    const std::vector<double> &predicted = fate == Fate::PASSES ? trial_.predicted()
                                                                : step_.problem.predicted_velocity;
    const double drift = norm(cluster.common.data());
    const bool stays = drift <= RestRules::ROUND_OFF * cluster.without_contacts;
    if (stopped) maxima[0] = 1.0;
    if (stopped && stays)
      state_.load_at_rest(i) =
          norm(&predicted[3 * static_cast<std::size_t>(i)]) / step_.impulse_per_force;
    const double own_speed = stopped ? 0.0 : motions_.motion_of(i).speed;
    if (std::max(drift, own_speed) > rules_.limit() * cluster.without_contacts) maxima[1] = 1.0;
    // No time passes in the half kick with which a run starts.
    if (step_.kick == Kick::HALF) continue;
    double &own = state_.quiet_steps(i);
    if (fate == Fate::RESTS || (fate == Fate::PASSES && !held.particles.empty()))
      own = RestRules::RESTS;
    else if (fate == Fate::UNBALANCED)
      own = RestRules::RESTED;
    else if (fate == Fate::FAILS || fate == Fate::PASSES)
      own = rules_.was_at_rest(cluster) ? 0.0 : -RestRules::PAUSE;
    else if (fate == Fate::MOVES && rules_.is_quiet(cluster))
      own = std::min(cluster.quiet_steps, RestRules::PATIENCE - 1.0) + 1.0;
    else
      own = std::min(cluster.quiet_steps, 0.0);
  }
  ranks_.reduce(nullptr, 0, maxima, 2);
  any_stopped_ = maxima[0] > 0.0;
  step_.at_rest = any_stopped_ && maxima[1] == 0.0;
}
