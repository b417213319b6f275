// What ranks share in coloured sweeps: movers that other ranks have constraints of, too, and what
// ranks tell one another of them.
//
// A rank visits its constraints of shared movers, those at cuts, first or in the middle of a sweep,
// by its turn (Host::turn), and tells others what they do. Ranks of the second turn hear the first
// one's before they visit theirs. Ranks of one turn that push the same mover push too far together.
// So such constraints have a larger diagonal, by the sum of the off-diagonal entries with those of
// other ranks of this turn (the l1 smoother of Baker, Falgout, Kolev and Yang, SIAM J. Sci. Comput.
// 33 (2011) 2864), or a bound of it. A periodic image that a rank has of its own particle counts as
// one of another rank.

#pragma once

#include "inelastic_host.h"
#include "inelastic_swept_movers.h"

#include <vector>

namespace inelastic {

template <typename Group> class SharedMovers {
 public:
  using State = typename Group::State;
  using Vector = packed::Vector<float>;

  explicit SharedMovers(const SweptMovers<Group> &movers) : movers_(movers) {}

  // Finds the movers that are shared, in a problem of which `working` constraints are to be visited
  // first. Collective.
  void find(const ContactProblem &problem, const std::vector<std::size_t> &working, Host &host);

  // Whether ranks share anything, and whether this one is of the second turn.
  bool any() const { return has_ghosts_; }
  bool is_second() const { return turn_ > 0; }
  // Tells whether other ranks have constraints of either side, too.
  bool is_at_cut(int first, int second) const
  { return has_ghosts_ && (is_shared(first) || is_shared(second)); }
  // Returns the bound of the sum of |A_cd| over the constraints d of other ranks [time / mass].
  double from_other_ranks(const ContactProblem &problem, std::size_t c) const;

  // Keeps what a visit to the constraints at cuts changes, of particles the states, of bodies the
  // impulses, led on by `along` times their last change; then tells others what it has changed.
  void keep_before_visit(const PackedGroups<Group> &at_cuts, const std::vector<State> &states,
                         float along);
  void tell_changes(const PackedGroups<Group> &at_cuts, const std::vector<State> &states,
                    Host &host);
  // Tells others what the impulses at cuts make of the states, which have nothing else so far.
  void tell_all(const PackedGroups<Group> &at_cuts, swept::When when,
                const std::vector<State> &states, Host &host);

  // Adds to the states what the ranks of the first turn, of the second, or of all have told.
  void hear_first(std::vector<State> &states, Host &host) { hear(0, states, host); }
  void hear_second(std::vector<State> &states, Host &host)
  {
    if (turns_ > 1) hear(1, states, host);
  }
  void hear_all(std::vector<State> &states, Host &host)
  {
    hear_first(states, host);
    hear_second(states, host);
  }

 private:
  // How many numbers from_other_ranks needs of each mover.
  static constexpr std::size_t NUMBERS = HAS_BODIES<Group> ? 1 : 6;

  bool is_shared(int slot) const
  { return movers_.moves()[movers_.of(slot)] && shared_[movers_.of(slot)]; }
  std::vector<double> sums_of(const ContactProblem &problem,
                              const std::vector<std::size_t> &working) const;
  void list(Host &host);
  void sum_up_changes(const PackedGroups<Group> &at_cuts);
  void hear(int turn, std::vector<State> &states, Host &host);

  const SweptMovers<Group> &movers_;
  bool has_ghosts_ = false;
  int turns_ = 1, turn_ = 0;
  std::vector<char> shared_;         // per mover
  std::vector<float> of_others_;     // per mover: what from_other_ranks needs
  std::vector<int> shared_slots_;    // those of shared movers
  // While the constraints at cuts are visited: of particles the states of shared slots before, of
  // bodies the impulses of these constraints before, and then their changes.
  std::vector<State> before_visit_;
  std::vector<float> changes_;
  std::vector<Vector> told_, heard_;    // per slot, of what ranks tell; heard_ of bodies alone
};

}    // namespace inelastic
