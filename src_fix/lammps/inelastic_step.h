// One time step as all rooms of the fix know it: the contact problem, its contacts, and where the
// step takes the particles.

#ifndef INELASTIC_STEP_H
#define INELASTIC_STEP_H

#include "inelastic_contact.h"
#include "inelastic_contact_problem.h"
#include "inelastic_settings.h"
#include "inelastic_thresholds.h"
#include "inelastic_vector3.h"

#include "atom.h"

#include <cstddef>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

// LAMMPS applies half a kick (the change of velocities by the forces) before the first move of a
// run, and a whole one before every other move.
enum class Kick { HALF, WHOLE };

// A bad start, an overlap beyond the regular ones, counts as touching in the first phase, and is
// pushed apart in a second one.
enum class Phase { CONTACT, PUSH };

// The largest push out of a bad start in a step of regular length, as a part of the sum of radii.
constexpr double PUSH_LIMIT = 0.05;
// Two centres that are nearer to one another than this part of the sum of radii have no normal.
constexpr double COINCIDENT = 1.0e-10;
// This value is below (with a minus sign) or above every value that is compared with it.
constexpr double EXTREME = 1.0e300;

// What lives as long as a run. The room that writes a field stands behind it, here and below.
struct RunState {
  // A step of this run came before: bodies that made it carry momenta along
  // (inelastic_carried_momenta.h), and its prediction can be compared with what moved.
  // (motion_check)
  bool continues = false;
  // [time] as the deck sets it; problem.timestep may be shorter (step_length)
  double regular_timestep = 0.0;
  double largest_radius = 0.0;    // [length] in the group, on all ranks (step_length)
};

// What is known of a step beside its problem. It is made anew for each step, so that nothing of the
// last one can be taken for something of this one.
struct StepState {
  Kick kick = Kick::WHOLE;    // (fix_inelastic)
  // The time for which forces act before the next move, in units that turn a force into a momentum.
  // (fix_inelastic)
  double impulse_per_force = 0.0;

  std::vector<Contact> contacts;    // (contact_rows)
  std::vector<Row> rows;            // one per row of the problem (contact_rows, gap_rules)
  // One per contact; empty without a contact law. (law_contacts)
  std::vector<LawState> law_states;
  // 3 per slot, before forces; only with a law (the movers)
  std::vector<double> velocity_before;
  // Per particle: the factor by which the forces on one that is at rest have changed since the last
  // step; 0 where this is not known. Empty if nothing is at rest.
  // (rest)
  std::vector<double> load_change;

  // What solves the step.
  std::vector<double> velocity;    // 3 per slot, the projection (the core, hold_still)
  // 3 per slot, the mean velocity during the step; only in a scene with bodies, which turn (the
  // movers)
  std::vector<double> motion_of_bodies;

  // What is known once constraints are collected.
  Phase phase = Phase::CONTACT;    // (constraints, push_apart)
  bool bad_start = false;    // some overlap at the start is beyond the regular ones (overlap_watch)
  // Regular overlaps are given back by the push out of bad ones alone. (fix_inelastic)
  bool keeps_overlaps = false;
  // Nor are they in a step in which the network has no room for it. (fix_inelastic)
  bool waits = false;
  // Bad overlaps may become as deep as the deepest while they are pushed apart. (push_apart)
  bool gives_way = false;
  double largest_overlap = 0.0;    // [length] at the start (overlap_watch)
  // [length] the overlap at the end beyond the regular ones (constraints; gap_rules,
  // wall_constraints)
  double excess = 0.0;
  // Rounds that have looked at the end of the step. (constraints, push_apart)
  int relinearisations = 0;
  // By row, of those alone whose gaps the end of the step has changed. (gap_rules;
  // begun anew with the rows, contact_rows, and with each trial, push_apart)
  std::unordered_map<std::size_t, Approach> approaches;
  bool at_rest = false;    // nothing moves in this step (rest)
  // What went wrong on this rank while constraints were collected; empty if nothing.
  // (pair_constraints, wall_constraints, law_contacts)
  std::string problem_found;
};

struct Step : RunState, StepState {
  explicit Step(const Settings &of_fix) : settings(of_fix), has_bodies(of_fix.has_bodies()) {}

  const Settings &settings;
  const bool has_bodies;    // of the settings: asked for every particle

  // The problem. Particles are the owned atoms, then the ghosts. Bodies are those since the last
  // neighbour list, all else is of the step. (sizes: fix_inelastic; velocities and masses: the
  // movers; bodies: body_members, body_inertia; contacts: contact_rows, and their gaps gap_rules
  // and push_apart; impulses: the solver)
  inelastic::ContactProblem problem;

  // Forgets the last step. Arrays keep their room.
  void begin(Kick of_step)
  {
    StepState last;
    std::swap(last, static_cast<StepState &>(*this));
    kick = of_step;
    const auto keep_room = [&](auto... arrays) {
      ((this->*arrays).swap(last.*arrays), ...);
      ((this->*arrays).clear(), ...);
    };
    keep_room(&StepState::contacts, &StepState::rows, &StepState::law_states,
              &StepState::velocity_before, &StepState::load_change, &StepState::velocity,
              &StepState::motion_of_bodies);
  }

  // A threshold [length], by its factor of EPS (inelastic_thresholds.h).
  double eps(double factor) const { return factor * settings.tolerance; }

  // The part of a whole kick for which the forces act.
  double kicks() const { return kick == Kick::WHOLE ? 1.0 : 0.5; }

  bool in_group(const Atom *atom, int i) const { return atom->mask[i] & settings.group_bit; }
  bool is_mobile(const Atom *atom, int i) const
  { return in_group(atom, i) && !(atom->mask[i] & settings.frozen_bit); }

  // The contact of a row.
  Contact &contact_of(std::size_t c) { return contacts[rows[c].contact]; }
  const Contact &contact_of(std::size_t c) const { return contacts[rows[c].contact]; }
  // The same as the law sees it; nullptr without a law.
  const LawState *law_state_of(std::size_t c) const
  { return law_states.empty() ? nullptr : &law_states[rows[c].contact]; }

  // Tells whether the contact of a row may pull.
  bool may_pull(std::size_t c) const { return contact_of(c).asked.set.may_pull(); }

  // Tells whether a row pulls: it may, and with the present impulse it does not open.
  bool pulls(std::size_t c) const
  {
    const inelastic::AdmissibleSet<double> set = problem.contacts.set[c];
    return set.may_pull() && set.is_loaded(problem.contacts.impulse[c]);
  }

  // The gap of a row at the end of the step with velocities (3 per slot), along its normal
  // [length]. A bad overlap may stay, and counts as touching.
  double linear_gap_at_end(std::size_t c, const std::vector<double> &v) const
  {
    const double gap = contact_of(c).gap_now;
    const std::size_t i = 3 * static_cast<std::size_t>(problem.contacts.first[c]);
    const std::size_t j = 3 * static_cast<std::size_t>(problem.contacts.second[c]);
    const double between[3] = {v[i] - v[j], v[i + 1] - v[j + 1], v[i + 2] - v[j + 2]};
    return (gap < -eps(in_eps::REGULAR) ? 0.0 : gap) - rows[c].wall_motion +
        problem.timestep * inelastic::dot(&problem.contacts.normal[3 * c], between);
  }

  // Tells whether a particle belongs to a body.
  bool is_member(int i) const { return problem.is_member(i); }

  const std::vector<double> &motion() const { return has_bodies ? motion_of_bodies : velocity; }

  // The vector from the centre of mass of its body to a particle; zero for a free one.
  const double *arm(int i) const
  {
    static constexpr double NONE[3] = {};
    return is_member(i) ? &problem.bodies.arm[3 * problem.bodies.place[i]] : NONE;
  }
};

inline double mass_of(const Atom *atom, int i)
{ return atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]]; }

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
