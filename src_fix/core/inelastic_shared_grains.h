// What ranks share in coloured sweeps: grains that other ranks have constraints of, too, and what
// ranks send one another of them.
//
// A rank visits its constraints of shared grains, those at cuts, first or in the middle of a sweep,
// by its colour (Host::rank_colour), and sends others what they change. Ranks of the second colour
// receive the first one's changes before they visit theirs. Ranks of one colour that push the same
// grain push too far together. So such constraints have a larger diagonal, by the sum of the
// off-diagonal entries with those of other ranks of this colour (the l1 smoother of Baker, Falgout,
// Kolev and Yang, SIAM J. Sci. Comput. 33 (2011) 2864), or a bound of it. A periodic image that a
// rank has of its own particle counts as one of another rank.

#pragma once

#include "inelastic_host.h"
#include "inelastic_swept_grains.h"

#include <vector>

namespace inelastic {

template <typename Batch> class SharedGrains {
 public:
  using State = typename Batch::State;
  using Vector = packed::Vector<float>;

  explicit SharedGrains(const SweptGrains<Batch> &grains) : grains_(grains) {}

  // Finds the grains that are shared, in a problem of which `working` constraints are to be visited
  // first. Collective.
  void find(const ContactProblem &problem, const std::vector<std::size_t> &working, Host &host);

  // Whether ranks share anything, and whether this one is of the second colour.
  bool any() const { return has_ghosts_; }
  bool is_second() const { return rank_colour_ > 0; }
  // Tells whether other ranks have constraints of either side, too.
  bool is_at_cut(int first, int second) const
  { return has_ghosts_ && (is_shared(first) || is_shared(second)); }
  // Returns the bound of the sum of |A_cd| over the constraints d of other ranks [time / mass].
  double from_other_ranks(const ContactProblem &problem, std::size_t c) const;

  // Keeps what a visit to the constraints at cuts changes, of particles the states, of bodies the
  // impulses, extrapolated by `along` times their last change; then sends others what it has
  // changed.
  void keep_before_visit(const PackedBatches<Batch> &at_cuts, const std::vector<State> &states,
                         float along);
  void send_changes(const PackedBatches<Batch> &at_cuts, const std::vector<State> &states,
                    Host &host);
  // Sends others what the impulses at cuts make of the states, which have nothing else so far.
  void send_all(const PackedBatches<Batch> &at_cuts, swept::When when,
                const std::vector<State> &states, Host &host);

  // Adds to the states what the ranks of the first colour, of the second, or of all have sent.
  void receive_first(std::vector<State> &states, Host &host) { receive(0, states, host); }
  void receive_second(std::vector<State> &states, Host &host)
  {
    if (rank_colours_ > 1) receive(1, states, host);
  }
  void receive_all(std::vector<State> &states, Host &host)
  {
    receive_first(states, host);
    receive_second(states, host);
  }

 private:
  // How many numbers from_other_ranks needs of each grain.
  static constexpr std::size_t NUMBERS = HAS_BODIES<Batch> ? 1 : 6;

  bool is_shared(int slot) const
  { return grains_.moves()[grains_.of(slot)] && shared_[grains_.of(slot)]; }
  std::vector<double> sums_of(const ContactProblem &problem,
                              const std::vector<std::size_t> &working) const;
  void list(Host &host);
  void sum_up_changes(const PackedBatches<Batch> &at_cuts);
  void receive(int colour, std::vector<State> &states, Host &host);

  const SweptGrains<Batch> &grains_;
  bool has_ghosts_ = false;
  int rank_colours_ = 1, rank_colour_ = 0;
  std::vector<char> shared_;         // per grain
  std::vector<float> of_others_;     // per grain: what from_other_ranks needs
  std::vector<int> shared_slots_;    // those of shared grains
  // While the constraints at cuts are visited: of particles the states of shared slots before, of
  // bodies the impulses of these constraints before, and then their changes.
  std::vector<State> before_visit_;
  std::vector<float> changes_;
  std::vector<Vector> sent_, received_;    // per slot; received_ for bodies alone
};

}    // namespace inelastic
