// The kinetic energy that contacts add in a step. A projection takes energy away, but for what it
// gives back of overlaps, what a law or a moving wall adds, and what its residuals leave. Where a
// network has no room for what it is to give back, the force that this takes, and the energy, have
// no bound: such a step is to be solved again, with overlaps as deep as they are.
//
// For a cluster of mass M (inelastic_clusters.h), of whose overlaps none is given back faster than
// b [length / time], a step may add
//
//   1/2 M (10 b)^2 + sum over contacts of |lambda| (t + s) / h
//
// t is the target of the contact [length] (inelastic_contact_targets.h), s the length by which its
// gap closes because bodies turn, or walls curve, in the step: velocities open it by as much more.
// Targets grow with the velocities that they are for, and would allow what throws a grain out of a
// wedge: where that is less, a cluster has A, the accuracy, times the fastest approach of two of
// its surfaces without contacts in place of t / h, but no less in sum than 1/2 M (10 A EPS / h)^2,
// h of the regular step: residuals as slow as that are no sign of a network without room.

#ifndef INELASTIC_ENERGY_WATCH_H
#define INELASTIC_ENERGY_WATCH_H

#include "inelastic_clusters.h"
#include "inelastic_step.h"

#include "pointers.h"

#include <vector>

namespace LAMMPS_NS::Inelastic_NS {

class GapRules;
class GhostExchange;
class Movers;

class EnergyWatch : protected Pointers {
 public:
  EnergyWatch(class LAMMPS *lmp, const Step &step, const GapRules &rules, GhostExchange &ranks,
              const Movers &movers);

  void begin_run()
  {
    most_ = 0.0;
    steps_of_law_ = 0;
  }
  // Tells at the start of a step whether it is to give nothing back, since one before had no room
  // for that: every second step tries, then every third, fifth and so on, up to every 65th.
  bool waits_on();
  // Notes that the step has no room for what it gives back.
  void note_no_room();
  // Tells whether the step asks for overlaps to open, on any rank. Collective.
  bool gives_back() const;
  // Tells whether the contacts of a cluster that gives back overlaps add more than they may in the
  // step, which is solved; `target` [length] has one number per constraint. Collective.
  bool adds_too_much(const std::vector<double> &target);
  // How many times as much as they may the contacts of a cluster added when it told so.
  double times_too_much() const { return times_too_much_; }
  // Tells whether energy is added where the law has surfaces part, though each collision alone
  // takes some or none: a surface that parts meets another one in the same step, or bodies turn
  // too far in it, so that their surfaces go other ways than at first, or that LAMMPS, which keeps
  // the angular momentum of each, does not keep its energy. Known once adds_too_much() was asked.
  bool law_adds() const { return law_adds_; }
  // Notes that the step is taken as adds_too_much() has seen it.
  void end_step();

  // The most that the contacts of a cluster have added in a step of the run beside what laws and
  // walls that move do [energy].
  double most() const;
  // Steps of the run in which the law has added energy.
  long steps_of_law() const { return steps_of_law_; }

 private:
  double along(std::size_t c, const std::vector<double> &v) const;
  double fastest_given_back();
  void add_up(const std::vector<double> &target);

  const Step &step_;
  const GapRules &rules_;
  GhostExchange &ranks_;
  const Movers &movers_;
  Clusters clusters_;
  // Per cluster: its mass; what contacts add, those of a law beside others, and the sizes of what
  // they take and give; what targets and turning allow [energy]; and the sizes of its impulses.
  // Whether it gives overlaps back, whether the law has surfaces part, and the fastest approach.
  enum { MASS, ADDED, BY_LAW, SIZE, TARGETS, TURNS, IMPULSES, SUMS };
  enum { GIVES_BACK, PARTS, APPROACH, DOES };
  std::vector<double> sums_, does_;
  double added_ = 0.0, most_ = 0.0, times_too_much_ = 0.0;
  bool parts_ = false;    // some surfaces have been asked to part since the fix was defined
  bool law_adds_ = false;
  long steps_of_law_ = 0;
  int pause_ = 0, left_ = 0;    // steps from one try to give overlaps back to the next
};

}    // namespace LAMMPS_NS::Inelastic_NS

#endif
