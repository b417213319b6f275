#include "inelastic_shared_grains.h"

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
template <typename Batch>
std::vector<double> SharedGrains<Batch>::sums_of(const ContactProblem &problem,
                                                 const std::vector<std::size_t> &working) const
{
  const ContactSet &contacts = problem.contacts;
  std::vector<double> sums(NUMBERS * grains_.slots(), 0.0);
  for (const std::size_t c : working) {
    const double *const n = &contacts.normal[3 * c];
    for (const int slot : {contacts.first[c], contacts.second[c]}) {
      double *const of_slot = &sums[NUMBERS * static_cast<std::size_t>(slot)];
      if constexpr (HAS_BODIES<Batch>) {
        of_slot[0] += std::sqrt(mobility_of(problem, c, slot));
      } else {
        const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
        for (int k = 0; k < 6; ++k) of_slot[k] += n[row[k]] * n[column[k]];
      }
    }
  }
  return sums;
}

template <typename Batch>
void SharedGrains<Batch>::find(const ContactProblem &problem,
                               const std::vector<std::size_t> &working, Host &host)
{
  has_ghosts_ = host.has_ghosts();
  rank_colours_ = has_ghosts_ ? host.rank_colours() : 1;
  rank_colour_ = has_ghosts_ ? host.rank_colour() : 0;
  sent_.assign(grains_.slots(), Vector{});
  received_ = sent_;
  shared_slots_.clear();
  if (!has_ghosts_) return;
  const ContactSet &contacts = problem.contacts;
  const std::size_t slots = grains_.slots();
  std::vector<double> count(slots, 0.0);
  for (std::size_t c = 0; c < contacts.size(); ++c)
    for (const int slot : {contacts.first[c], contacts.second[c]}) count[slot] += 1.0;
  const std::vector<double> sums = sums_of(problem, working);
  const std::vector<double> all_count = of_all_ranks(count, 1, host);
  const std::vector<double> none(sums.size(), 0.0);
  std::vector<double> all_sums;
  for (int colour = 0; colour < rank_colours_; ++colour) {
    const std::vector<double> of_colour =
        of_all_ranks(colour == rank_colour_ ? sums : none, NUMBERS, host);
    if (colour == rank_colour_) all_sums = of_colour;
  }
  shared_.assign(grains_.number(), 0);
  of_others_.assign(NUMBERS * static_cast<std::size_t>(grains_.number()), 0.0f);
  for (int slot = 0; slot < static_cast<int>(slots); ++slot) {
    const auto i = static_cast<std::size_t>(slot), m = static_cast<std::size_t>(grains_.of(slot));
    if (problem.is_wall(slot) || !grains_.moves()[m]) continue;
    // A slot of a particle that is in no constraint receives nothing.
    const bool is_here = HAS_BODIES<Batch> || count[i] > 0.5;
    if (is_here && all_count[i] > count[i] + 0.5) shared_[m] = 1;
    for (std::size_t k = 0; k < NUMBERS; ++k)
      of_others_[NUMBERS * m + k] += static_cast<float>(
          (grains_.is_copy(slot) ? 0.0 : all_sums[NUMBERS * i + k]) - sums[NUMBERS * i + k]);
  }
  list(host);
}

// Lists the slots of the shared grains.
template <typename Batch> void SharedGrains<Batch>::list(Host &host)
{
  std::vector<char> chosen(grains_.slots());
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    chosen[i] = is_shared(static_cast<int>(i));
    if (chosen[i]) shared_slots_.push_back(static_cast<int>(i));
  }
  before_visit_.resize(shared_slots_.size());
  // A body's images on this rank move with it; those of a particle are grains of their own.
  host.choose_shared(chosen, !HAS_BODIES<Batch>);
}

template <typename Batch>
double SharedGrains<Batch>::from_other_ranks(const ContactProblem &problem, std::size_t c) const
{
  if (!has_ghosts_) return 0.0;
  double sum = 0.0;
  for (const int slot : {problem.contacts.first[c], problem.contacts.second[c]}) {
    if (!is_shared(slot)) continue;
    const auto m = static_cast<std::size_t>(grains_.of(slot));
    const double mobility = mobility_of(problem, c, slot);
    if constexpr (HAS_BODIES<Batch>) {
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

template <typename Batch>
void SharedGrains<Batch>::keep_before_visit(const PackedBatches<Batch> &at_cuts,
                                            const std::vector<State> &states, float along)
{
  if (!has_ghosts_) return;
  if constexpr (HAS_BODIES<Batch>) {
    changes_.resize(at_cuts.lanes());
    for (std::size_t k = 0; k < changes_.size(); ++k) {
      const Batch &batch = at_cuts.batch(k);
      const auto lane = k % swept::WIDTH;
      changes_[k] = batch.now[lane] + along * (batch.now[lane] - batch.before[lane]);
    }
  } else {
    for (std::size_t k = 0; k < shared_slots_.size(); ++k)
      before_visit_[k] = states[shared_slots_[k]];
  }
}

template <typename Batch>
void SharedGrains<Batch>::send_changes(const PackedBatches<Batch> &at_cuts,
                                       const std::vector<State> &states, Host &host)
{
  if (!has_ghosts_) return;
  if constexpr (HAS_BODIES<Batch>) {
    for (std::size_t k = 0; k < changes_.size(); ++k)
      changes_[k] = at_cuts.batch(k).now[k % swept::WIDTH] - changes_[k];
    sum_up_changes(at_cuts);
  } else {
    for (std::size_t k = 0; k < shared_slots_.size(); ++k) {
      const int i = shared_slots_[k];
      sent_[i].lanes = states[i].lanes - before_visit_[k].lanes;
    }
  }
  host.send(numbers(sent_));
}

template <typename Batch>
void SharedGrains<Batch>::send_all(const PackedBatches<Batch> &at_cuts, swept::When when,
                                   const std::vector<State> &states, Host &host)
{
  if (!has_ghosts_) return;
  if constexpr (HAS_BODIES<Batch>) {
    changes_.resize(at_cuts.lanes());
    for (std::size_t k = 0; k < changes_.size(); ++k) {
      const Batch &batch = at_cuts.batch(k);
      const swept::Eight &impulses = when == swept::When::NOW ? batch.now : batch.before;
      changes_[k] = impulses[k % swept::WIDTH];
    }
    sum_up_changes(at_cuts);
  } else {
    for (const int slot : shared_slots_) sent_[slot].lanes = states[slot].lanes;
  }
  host.send(numbers(sent_));
}

// Sums up the impulses of changes_, in scaled units, for each member of a shared body, in packed
// units.
template <typename Batch>
void SharedGrains<Batch>::sum_up_changes(const PackedBatches<Batch> &at_cuts)
{
  if constexpr (HAS_BODIES<Batch>) {
    for (const int slot : shared_slots_) sent_[slot] = Vector{};
    for (std::size_t place = 0; place < changes_.size(); ++place) {
      if (changes_[place] == 0.0f) continue;
      const Batch &batch = at_cuts.batch(place);
      const swept::Details &details = at_cuts.details_of(place);
      const auto lane = place % swept::WIDTH;
      for (const bool is_first : {true, false}) {
        const int slot = static_cast<int>(is_first ? details.first[lane] : details.second[lane]);
        if (!is_shared(slot)) continue;
        const swept::Eight &row = is_first ? batch.first_row[lane] : batch.second_row[lane];
        const float by = changes_[place] / grains_.slide_in_single(slot);
        for (int d = 0; d < 3; ++d) sent_[slot].lanes[d] += by * row[d];
      }
    }
  }
}

// Of a particle that this rank has several times every slot hears the same: the first of them
// counts.
template <typename Batch>
void SharedGrains<Batch>::receive(int colour, std::vector<State> &states, Host &host)
{
  if (!has_ghosts_) return;
  if constexpr (HAS_BODIES<Batch>) {
    for (const int slot : shared_slots_) received_[slot] = Vector{};
    host.receive(colour, numbers(received_));
    for (const int slot : shared_slots_)
      if (!grains_.is_copy(slot)) grains_.push(slot, received_[slot], states);
  } else {
    host.receive(colour, numbers(states));
  }
}

template class SharedGrains<swept::ParticleBatch>;
template class SharedGrains<swept::BodyBatch>;

}    // namespace inelastic
