#include "inelastic_shared_movers.h"

#include <algorithm>
#include <cmath>

namespace inelastic {

namespace {

  // Vectors of 4 numbers, as the host takes them.
  template <typename Vectors> float *numbers(Vectors &vectors)
  {
    static_assert(sizeof(vectors[0]) == 4 * sizeof(float));
    return reinterpret_cast<float *>(vectors.data());
  }

  // Returns sums over all ranks of some numbers per slot. Collective.
  std::vector<double> of_all_ranks(std::vector<double> mine, std::size_t numbers, Host &host)
  {
    host.sum_over_ghosts(mine.data(), static_cast<int>(numbers));
    return mine;
  }

  // Returns what a unit impulse of a constraint adds to its own gap through one of its sides.
  double mobility_of(const ContactProblem &problem, std::size_t c, int slot)
  { return problem.timestep * problem.mobility(slot, &problem.contacts.normal[3 * c]); }

}    // namespace

// Returns what from_other_ranks needs, of this rank's constraints, per slot: of particles sums of n
// n^T, of bodies sums of the roots of mobilities.
template <typename Group>
std::vector<double> SharedMovers<Group>::sums_of(const ContactProblem &problem,
                                                 const std::vector<std::size_t> &working) const
{
  const ContactSet &contacts = problem.contacts;
  std::vector<double> sums(NUMBERS * movers_.slots(), 0.0);
  for (const std::size_t c : working) {
    const double *const n = &contacts.normal[3 * c];
    for (const int slot : {contacts.first[c], contacts.second[c]}) {
      double *const of_slot = &sums[NUMBERS * static_cast<std::size_t>(slot)];
      if constexpr (HAS_BODIES<Group>) {
        of_slot[0] += std::sqrt(mobility_of(problem, c, slot));
      } else {
        const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
        for (int k = 0; k < 6; ++k) of_slot[k] += n[row[k]] * n[column[k]];
      }
    }
  }
  return sums;
}

template <typename Group>
void SharedMovers<Group>::find(const ContactProblem &problem,
                               const std::vector<std::size_t> &working, Host &host)
{
  has_ghosts_ = host.has_ghosts();
  turns_ = has_ghosts_ ? host.turns() : 1;
  turn_ = has_ghosts_ ? host.turn() : 0;
  told_.assign(movers_.slots(), Vector{});
  heard_ = told_;
  shared_slots_.clear();
  if (!has_ghosts_) return;
  const ContactSet &contacts = problem.contacts;
  const std::size_t slots = movers_.slots();
  std::vector<double> count(slots, 0.0);
  for (std::size_t c = 0; c < contacts.size(); ++c)
    for (const int slot : {contacts.first[c], contacts.second[c]}) count[slot] += 1.0;
  const std::vector<double> sums = sums_of(problem, working);
  const std::vector<double> all_count = of_all_ranks(count, 1, host);
  const std::vector<double> none(sums.size(), 0.0);
  std::vector<double> all_sums;
  for (int turn = 0; turn < turns_; ++turn) {
    const std::vector<double> of_turn = of_all_ranks(turn == turn_ ? sums : none, NUMBERS, host);
    if (turn == turn_) all_sums = of_turn;
  }
  shared_.assign(movers_.number(), 0);
  of_others_.assign(NUMBERS * static_cast<std::size_t>(movers_.number()), 0.0f);
  for (int slot = 0; slot < static_cast<int>(slots); ++slot) {
    const auto i = static_cast<std::size_t>(slot), m = static_cast<std::size_t>(movers_.of(slot));
    if (problem.is_wall(slot) || !movers_.moves()[m]) continue;
    // A slot of a particle that is in no constraint need not hear of others.
    const bool is_here = HAS_BODIES<Group> || count[i] > 0.5;
    if (is_here && all_count[i] > count[i] + 0.5) shared_[m] = 1;
    for (std::size_t k = 0; k < NUMBERS; ++k)
      of_others_[NUMBERS * m + k] += static_cast<float>(
          (movers_.is_copy(slot) ? 0.0 : all_sums[NUMBERS * i + k]) - sums[NUMBERS * i + k]);
  }
  list(host);
}

// Lists the slots of the shared movers.
template <typename Group> void SharedMovers<Group>::list(Host &host)
{
  std::vector<char> chosen(movers_.slots());
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    chosen[i] = is_shared(static_cast<int>(i));
    if (chosen[i]) shared_slots_.push_back(static_cast<int>(i));
  }
  before_visit_.resize(shared_slots_.size());
  // A body's images on this rank move with it; those of a particle are movers of their own.
  host.choose_told(chosen, !HAS_BODIES<Group>);
}

template <typename Group>
double SharedMovers<Group>::from_other_ranks(const ContactProblem &problem, std::size_t c) const
{
  if (!has_ghosts_) return 0.0;
  double sum = 0.0;
  for (const int slot : {problem.contacts.first[c], problem.contacts.second[c]}) {
    if (!is_shared(slot)) continue;
    const auto m = static_cast<std::size_t>(movers_.of(slot));
    const double mobility = mobility_of(problem, c, slot);
    if constexpr (HAS_BODIES<Group>) {
      sum += std::sqrt(mobility) * std::max(0.0f, of_others_[m]);
    } else {
      // By the inequality of Cauchy and Schwarz: (sum |n . n_d|)^2 <= count sum (n . n_d)^2.
      const float *const t = &of_others_[6 * m];
      const double *const n = &problem.contacts.normal[3 * c];
      const double squares = t[0] * n[0] * n[0] + t[1] * n[1] * n[1] + t[2] * n[2] * n[2] +
          2.0 * (t[3] * n[0] * n[1] + t[4] * n[0] * n[2] + t[5] * n[1] * n[2]);
      const double count = t[0] + t[1] + t[2];
      sum += mobility * std::sqrt(std::max(0.0, count * squares));
    }
  }
  return sum;
}

template <typename Group>
void SharedMovers<Group>::keep_before_visit(const PackedGroups<Group> &at_cuts,
                                            const std::vector<State> &states, float along)
{
  if (!has_ghosts_) return;
  if constexpr (HAS_BODIES<Group>) {
    changes_.resize(at_cuts.lanes());
    for (std::size_t k = 0; k < changes_.size(); ++k) {
      const Group &group = at_cuts.group(k);
      const auto lane = k % swept::WIDTH;
      changes_[k] = group.now[lane] + along * (group.now[lane] - group.before[lane]);
    }
  } else {
    for (std::size_t k = 0; k < shared_slots_.size(); ++k)
      before_visit_[k] = states[shared_slots_[k]];
  }
}

template <typename Group>
void SharedMovers<Group>::tell_changes(const PackedGroups<Group> &at_cuts,
                                       const std::vector<State> &states, Host &host)
{
  if (!has_ghosts_) return;
  if constexpr (HAS_BODIES<Group>) {
    for (std::size_t k = 0; k < changes_.size(); ++k)
      changes_[k] = at_cuts.group(k).now[k % swept::WIDTH] - changes_[k];
    sum_up_changes(at_cuts);
  } else {
    for (std::size_t k = 0; k < shared_slots_.size(); ++k) {
      const int i = shared_slots_[k];
      told_[i].lanes = states[i].lanes - before_visit_[k].lanes;
    }
  }
  host.tell(numbers(told_));
}

template <typename Group>
void SharedMovers<Group>::tell_all(const PackedGroups<Group> &at_cuts, swept::When when,
                                   const std::vector<State> &states, Host &host)
{
  if (!has_ghosts_) return;
  if constexpr (HAS_BODIES<Group>) {
    changes_.resize(at_cuts.lanes());
    for (std::size_t k = 0; k < changes_.size(); ++k) {
      const Group &group = at_cuts.group(k);
      changes_[k] = (when == swept::When::NOW ? group.now : group.before)[k % swept::WIDTH];
    }
    sum_up_changes(at_cuts);
  } else {
    for (const int slot : shared_slots_) told_[slot].lanes = states[slot].lanes;
  }
  host.tell(numbers(told_));
}

// Sums up the impulses of changes_, in scaled units, for each member of a shared body, in packed
// units.
template <typename Group>
void SharedMovers<Group>::sum_up_changes(const PackedGroups<Group> &at_cuts)
{
  if constexpr (HAS_BODIES<Group>) {
    for (const int slot : shared_slots_) told_[slot] = Vector{};
    for (std::size_t place = 0; place < changes_.size(); ++place) {
      if (changes_[place] == 0.0f) continue;
      const Group &group = at_cuts.group(place);
      const swept::Rest &rest = at_cuts.rest_of(place);
      const auto lane = place % swept::WIDTH;
      for (const bool is_first : {true, false}) {
        const int slot = static_cast<int>(is_first ? rest.first[lane] : rest.second[lane]);
        if (!is_shared(slot)) continue;
        const swept::Eight &row = is_first ? group.first_row[lane] : group.second_row[lane];
        const float by = changes_[place] / movers_.slide_in_single(slot);
        for (int d = 0; d < 3; ++d) told_[slot].lanes[d] += by * row[d];
      }
    }
  }
}

// Of a particle that this rank has several times every slot hears the same: the first of them
// counts.
template <typename Group>
void SharedMovers<Group>::hear(int turn, std::vector<State> &states, Host &host)
{
  if (!has_ghosts_) return;
  if constexpr (HAS_BODIES<Group>) {
    for (const int slot : shared_slots_) heard_[slot] = Vector{};
    host.hear(turn, numbers(heard_));
    for (const int slot : shared_slots_)
      if (!movers_.is_copy(slot)) movers_.push(slot, heard_[slot], states);
  } else {
    host.hear(turn, numbers(states));
  }
}

template class SharedMovers<swept::ParticleGroup>;
template class SharedMovers<swept::BodyGroup>;

}    // namespace inelastic
