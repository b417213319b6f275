// Coloured sweeps (inelastic_coloured_sweeps.h) on packed groups (inelastic_sweep_kernels.h): this
// class packs a problem, sweeps, and unpacks impulses.
//
// Constraints are coloured in the order of the problem: each gets the first colour that no earlier
// constraint of either of its movers has. (A mover is a particle that turns with nothing, or a
// body.) Constraints of one colour share no mover, and fill groups. What no impulse moves is shared
// freely.
//
// The unknown is the change of the impulses since the start of the search, as in
// inelastic_packed_iterations.h; so are working and idle constraints.
//
// Each rank sweeps over its own constraints. Of some movers other ranks have constraints, too: a
// rank visits its constraints of those first or in the middle of a sweep, by its turn (Host::turn),
// and tells others what they do. Ranks of the second turn hear the first one's before they visit
// theirs. Ranks of one turn that push the same mover push too far together. So such constraints
// have a larger diagonal, by the sum of the off-diagonal entries with those of other ranks of this
// turn (the l1 smoother of Baker, Falgout, Kolev and Yang, SIAM J. Sci. Comput. 33 (2011) 2864), or
// a bound of it. A periodic image that a rank has of its own particle counts as one of another
// rank.

#pragma once

#include "inelastic_contact_problem.h"
#include "inelastic_contact_targets.h"
#include "inelastic_host.h"
#include "inelastic_packed_targets.h"
#include "inelastic_sweep_kernels.h"

#include <algorithm>
#include <cstddef>
#include <type_traits>
#include <vector>

namespace inelastic {

template <typename Group> class PackedSweeps {
 public:
  // Packs a problem, whose impulses are the start; the arguments are those of
  // PackedIterations::prepare, and must outlive the search. Returns false where so many constraints
  // have one mover in common that groups would be mostly empty. Collective; what is returned is
  // this rank's answer.
  bool prepare(const ContactProblem &problem, const std::vector<double> &diagonal,
               const std::vector<double> &gap, double idle_gap, const Scales &scales,
               const ContactTargets &targets, const std::vector<double> &change, double tolerance,
               Host &host);

  // Begins another search from the impulses of the last one, which are those of the problem now, as
  // double precision has judged them: its gaps, changes of velocity and targets, in the places that
  // `prepare` was given, are new. Colours and groups stay.
  void go_on(double idle_gap, const std::vector<double> &change, double tolerance);

  // Leads all impulses on by `along` times their last change, and visits each constraint once.
  // Changes and residuals below `blur`, in scaled units, may be round-off. Collective; what is
  // returned is of this rank's constraints.
  swept::Swept sweep(double along, double blur, Host &host);

  // Returns the largest residual of this rank's working constraints as a part of its target.
  double unsolved(double blur) const
  {
    const auto by = static_cast<float>(blur);
    return std::max(swept::find_unsolved(at_cuts_.groups, states_.data(), by),
                    swept::find_unsolved(inside_.groups, states_.data(), by));
  }

  // Computes the states from the impulses: sums of many changes drift in single precision.
  // Collective.
  void refresh(Host &host);

  // As in PackedIterations. Targets are set four times until there are twice as many sweeps.
  static bool sets_targets(long sweep);
  void set_targets();
  void keep_velocities();
  double moved_since_kept(double accuracy);

  // Makes the idle constraints working whose gaps are near closed: not above some residuals, or
  // `least_idle_gap`, in packed units, where that is more. Makes the working ones idle that have no
  // impulse and larger gaps, where they are more than a few.
  void look_at_idle(double least_idle_gap);

  // Writes the present impulses, in the order of the problem's constraints.
  void impulses(const Scales &scales, std::vector<double> &impulse) const;

 private:
  using State = typename Group::State;
  using Vector = packed::Vector<float>;
  static constexpr int WIDTH = swept::WIDTH;

  using Rest = swept::Rest;

  struct Packed {
    std::vector<Group> groups;
    std::vector<Rest> rest;
    std::vector<std::size_t> colour_end;    // in groups, one after the other

    void clear();
    std::size_t lanes() const { return groups.size() * WIDTH; }
    bool is_empty(std::size_t lane) const
    { return rest[lane / WIDTH].source[lane % WIDTH] == swept::NONE; }
  };

  // A constraint without an impulse, by its place, and its gap.
  struct Unloaded {
    std::size_t place;
    float gap;
  };

  // What `prepare` was given. Until all of it is packed nothing of it changes but the impulses.
  struct Given {
    const ContactProblem *problem;
    const std::vector<double> *diagonal, *gap;
    Scales scales;
    const ContactTargets *targets;
  };

  // How many numbers from_other_ranks needs of each mover.
  static constexpr std::size_t NUMBERS = std::is_same_v<Group, swept::BodyGroup> ? 1 : 6;

  void find_movers(const ContactProblem &problem);
  void find_bodies(const RigidBodies &bodies);
  void find_shared(const ContactProblem &problem, const std::vector<std::size_t> &working,
                   std::size_t constraints, Host &host);
  static std::vector<double> of_all_ranks(const std::vector<double> &mine, std::size_t numbers,
                                          Host &host);
  bool is_at_cut(int first, int second) const;
  bool is_shared(int slot) const;
  double from_other_ranks(const ContactProblem &problem, std::size_t c) const;
  double mobility_of(const ContactProblem &problem, std::size_t c, int slot) const;
  void add_groups(Packed &packed, std::size_t count) const;
  std::size_t colour(const std::vector<int> &first, const std::vector<int> &second, Packed &packed,
                     std::vector<std::size_t> &places);
  void write(std::size_t c, Packed &packed, std::size_t place) const;
  void write_start(Packed &packed, std::size_t place) const;
  void write_idle(const std::vector<std::size_t> &constraints);
  void begin_search(const std::vector<double> &change, double tolerance);
  void write_rows(const ContactProblem &problem, std::size_t c, double root, Group &group,
                  int lane) const;
  static void copy(const Packed &from, std::size_t source, Packed &to, std::size_t place);
  void clear_lane(Packed &packed, std::size_t place) const;
  void wake_near();
  void wake(const std::vector<std::size_t> &near);
  void close_up_idle();
  float look_at(const Packed &packed, std::vector<Unloaded> &unloaded);
  void set_idle(double least_idle_gap);
  void make_idle(const std::vector<Unloaded> &unloaded, Packed &packed);
  void set_targets(Packed &packed, std::size_t from) const;
  float looked_gap(std::size_t place) const;
  void stop(std::vector<State> &states) const;
  void list_shared(Host &host);
  void keep_before_visit(float along);
  void tell_changes(Host &host);
  void sum_up_changes();
  void hear(int turn, std::vector<State> &states, Host &host);
  void push_bodies(std::vector<State> &states) const;
  const std::vector<Vector> &velocities();

  // Working constraints: those of movers that other ranks have constraints of, too, and all others.
  Packed at_cuts_, inside_;
  Packed idle_;
  Given given_{};
  std::vector<std::size_t> far_;    // in the problem: idle constraints that are not packed yet
  std::vector<State> states_, before_;
  std::vector<Vector> velocity_;    // per slot
  std::vector<int> mover_;          // per slot
  std::vector<char> moves_;         // per mover: whether impulses move it
  int movers_ = 0;
  std::vector<float> mobility_;    // per mover: the inverse mass, in packed units
  // Per mover 9: F of F F^T = I^-1 by columns, in packed units; per member of a body its arm.
  std::vector<double> spin_root_, arm_;
  std::vector<char> is_copy_;    // per slot
  double mobility_unit_ = 0.0;

  bool has_ghosts_ = false;
  int turns_ = 1, turn_ = 0;
  std::vector<char> shared_;         // per mover: whether other ranks, or images, have constraints
  std::vector<float> of_others_;     // per mover: what from_other_ranks needs
  std::vector<int> shared_slots_;    // those of shared movers
  // While the constraints at cuts are visited: of particles the states of shared slots before, of
  // bodies the impulses of these constraints before, and then their changes.
  std::vector<State> before_visit_;
  std::vector<float> changes_;
  std::vector<Vector> told_, heard_;    // per slot, of what ranks tell; heard_ of bodies alone
  std::vector<double> start_;           // impulses, in the order of the problem
  std::vector<HalfLine<double>> of_impulses_;    // which impulses are admissible, in that order
  PackedTargets<float> targets_;
  std::vector<swept::Looked> looked_;
  float idle_gap_ = 0.0f;    // above it a constraint without an impulse is idle
};

}    // namespace inelastic
