// This room tells which particles are at rest: those that their own contacts hold, in a cluster
// (inelastic_clusters.h) whose motion is nothing but errors of the solver. Their velocities are
// taken away, the contact forces of one step solve the next one without an iteration, and this
// lasts until something changes.
//
// A velocity of particle i [length / time] is small if it is small beside
//
//   u_i = min(what contacts change of its velocity, w)
//
// w is the mean speed that the particles of the cluster would have without contacts. Velocities are
// without the common one that a cluster has along directions in which nothing outside holds it
// (inelastic_cluster_motions.h).
// The particle is held if contacts resist its motion: if the sum of lambda (n . v)^2 over its
// contacts is at least a tenth of u_i m v^2, and if none of them has still to close a gap. Others,
// which slide, roll or fly, keep their velocities. A cluster is quiet if it is supported by
// something that does not move, its held particles move little, and contacts with walls and frozen
// particles resist its motion as a whole: its velocity and angular velocity, as if it were one
// rigid body.
//
// After some quiet steps, those of most of its particles, the step is solved on trial as if the
// held particles had begun it at rest (inelastic_rest_trial.h). If nothing held then moves, and
// the cluster pushes nothing else that moves, it is at rest; if not the step stays as it was
// solved, and the cluster is looked at again later.
//
// Slow motion looks like an error of the solver: that of a light particle, for instance, which
// follows two heavy ones that it drives apart. Where held particles touch others that are not held,
// the trial is therefore solved again, more accurately: their velocities there must become smaller,
// as errors do.
//
// In a cluster at rest the held particles are stopped, in every step. Moving particles beside them
// are projected once more, with these as obstacles (inelastic_hold_still.h). Where that changes the
// forces on a held particle so that they no longer balance, the step stays as it was solved, and
// the cluster is tried anew in the next one. Contacts that have lost their force by then pass on no
// momentum: what they have connected keeps its own. So what moves loses no momentum, and what is
// stopped no more than errors of the solver are.
//
// A cluster at rest in which something would move is solved more accurately before it is let go.
// Where the loads of a cluster at rest all change by one factor, its contact forces do.

#ifndef INELASTIC_REST_H
#define INELASTIC_REST_H

#include "inelastic_cluster_motions.h"
#include "inelastic_hold_still.h"
#include "inelastic_projection.h"
#include "inelastic_rest_rules.h"
#include "inelastic_rest_trial.h"
#include "inelastic_step.h"

#include "pointers.h"

#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class AtomState;
class GhostExchange;
class Movers;

class Rest : protected Pointers {
 public:
  Rest(class LAMMPS *lmp, Step &step, GhostExchange &ranks, AtomState &state, Movers &movers);

  // Looks at a step that is predicted: finds by what factors the loads of particles at rest have
  // changed. Collective.
  void compare_loads();

  // Looks at a step that is solved. Returns whether it is to be solved once more, with refined
  // contacts, which are marked in the problem; it is then looked at again. Collective.
  bool look(const inelastic::ProjectionResult &result);
  void look_again();

  // Stops in the step, after that, what is at rest, and notes in the step whether the whole scene
  // is. Returns the number of iterations that it took. Collective.
  long hold(const HoldStill::Constraints &constraints, double least_length);

 private:
  // What becomes of a cluster in the step.
  enum class Fate {
    MOVES,
    FAILS,         // its trial
    LET_GO,        // it was at rest
    UNBALANCED,    // it was at rest, and is tried in the next step
    PASSES,        // its trial
    RESTS
  };

  void forget();

  void decide();
  long try_clusters(double least_length);
  bool judge_trial(bool solved, const std::vector<ClusterMotion> &of_coarser,
                   std::vector<ClusterMotion> &of_trial);
  RestTrial::Begun begin_trial() const;
  void mark_held(Fate fate);
  bool drop_what_is_not_held();
  bool fail_pushed_by_others();
  bool fail(std::vector<double> marked);
  bool passes(int slot) const;
  bool is_stopped(int slot) const;
  bool any_stopped() const;
  HoldStill::Held held_now() const;
  void take_trial();
  bool let_go_unbalanced(const std::vector<double> &by_contacts, HoldStill::Held &held);
  std::vector<char> touched_particles() const;
  std::vector<std::size_t> ends_wrong(const HoldStill::Held &held) const;
  std::vector<Directions> held_directions() const;
  bool any_fell_apart() const;
  void end_step(const HoldStill::Held &held);

  Step &step_;
  GhostExchange &ranks_;
  AtomState &state_;
  const RestRules rules_;
  ClusterMotions motions_;
  RestTrial trial_;
  RestTrial::Begun begun_;    // of the trial
  HoldStill hold_still_;
  std::vector<Fate> fates_;                  // by cluster
  std::vector<Directions> held_in_trial_;    // by cluster, of those that pass
  // By particle, ghosts included: whether it is stopped if its cluster rests or passes; and by
  // owned particle its unit then (inelastic_cluster_motions.h).
  std::vector<char> held_;
  std::vector<double> unit_;
  bool looks_ = false;          // in this step
  long iterations_ = 0;         // of its solution
  bool any_stopped_ = false;    // in the last step, on any rank
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
