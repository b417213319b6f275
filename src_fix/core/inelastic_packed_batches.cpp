#include "inelastic_packed_batches.h"

#include <algorithm>
#include <cstdint>

namespace inelastic {

template <typename Batch> void PackedBatches<Batch>::clear(int nobody, bool has_springs)
{
  batches.clear();
  details.clear();
  colour_end_.clear();
  nobody_ = nobody;
  has_springs_ = has_springs;
}

template <typename Batch> std::size_t PackedBatches<Batch>::used() const
{
  std::size_t used = lanes();
  while (used > 0 && is_empty(used - 1)) --used;
  return used;
}

template <typename Batch> void PackedBatches<Batch>::resize_for(std::size_t lanes_needed)
{
  const std::size_t from = lanes();
  batches.resize((lanes_needed + WIDTH - 1) / WIDTH);
  details.resize(batches.size());
  for (std::size_t place = std::max(from, lanes_needed); place < lanes(); ++place)
    clear_lane(place);
}

template <typename Batch> void PackedBatches<Batch>::clear_lane(std::size_t place)
{
  Batch &to = batch(place);
  swept::Details &others = details_of(place);
  const int lane = static_cast<int>(place % WIDTH);
  to.first[lane] = to.second[lane] =
      static_cast<std::uint32_t>(nobody_ * sizeof(typename Batch::State));
  for (swept::Eight *const numbers : {&to.idle, &to.now, &to.before, &to.inverse_target})
    (*numbers)[lane] = 0.0f;
  to.gap[lane] = 1.0f;
  if constexpr (HAS_BODIES<Batch>) {
    to.first_row[lane] = to.second_row[lane] = swept::Eight{};
  } else {
    for (int d = 0; d < 4; ++d) to.row[lane % 4][4 * (lane / 4) + d] = 0.0f;
  }
  others.source[lane] = swept::NONE;
  others.first[lane] = others.second[lane] = 0;
  others.root[lane] = others.compliance[lane] = others.part[lane] = 0.0f;
  others.least_target[lane] = 1.0f;    // any that can be divided by
}

template <typename Batch> void PackedBatches<Batch>::add_colour(std::size_t more)
{
  resize_for(lanes() + more);
  colour_end_.push_back(batches.size());
}

template <typename Batch>
std::vector<std::size_t> PackedBatches<Batch>::add(const ConstraintColours &colours)
{
  constexpr int LAST = ConstraintColours::LAST;
  // Where none were packed so far the room for all is made at once.
  if (batches.empty()) {
    const std::size_t most = colours.size() / WIDTH + LAST + colours.count(LAST);
    batches.reserve(most);
    details.reserve(most);
  }
  std::size_t next[ConstraintColours::NUMBER];
  for (int colour = 0; colour <= LAST; ++colour) {
    const std::size_t count = colours.count(colour);
    if (count == 0) continue;
    next[colour] = lanes();
    if (colour < LAST) add_colour(count);
    for (std::size_t k = 0; colour == LAST && k < count; ++k) add_colour(1);
  }
  std::vector<std::size_t> places(colours.size());
  for (std::size_t k = 0; k < places.size(); ++k) {
    places[k] = next[colours[k]];
    next[colours[k]] += colours[k] == LAST ? WIDTH : 1;
  }
  return places;
}

template <typename Batch>
void PackedBatches<Batch>::copy(const PackedBatches &from, std::size_t source, std::size_t place)
{
  const Batch &a = from.batch(source);
  const swept::Details &details_a = from.details_of(source);
  Batch &b = batch(place);
  swept::Details &details_b = details_of(place);
  const int i = static_cast<int>(source % WIDTH), j = static_cast<int>(place % WIDTH);
  b.first[j] = a.first[i];
  b.second[j] = a.second[i];
  b.gap[j] = a.gap[i];
  b.idle[j] = a.idle[i];
  b.now[j] = a.now[i];
  b.before[j] = a.before[i];
  b.inverse_target[j] = a.inverse_target[i];
  if constexpr (HAS_BODIES<Batch>) {
    b.first_row[j] = a.first_row[i];
    b.second_row[j] = a.second_row[i];
  } else {
    for (int d = 0; d < 4; ++d) b.row[j % 4][4 * (j / 4) + d] = a.row[i % 4][4 * (i / 4) + d];
  }
  details_b.source[j] = details_a.source[i];
  details_b.first[j] = details_a.first[i];
  details_b.second[j] = details_a.second[i];
  details_b.root[j] = details_a.root[i];
  details_b.compliance[j] = details_a.compliance[i];
  details_b.least_target[j] = details_a.least_target[i];
  details_b.part[j] = details_a.part[i];
}

template <typename Batch> void PackedBatches<Batch>::close_up()
{
  std::size_t kept = 0;
  for (std::size_t place = 0; place < lanes(); ++place)
    if (!is_empty(place)) copy(*this, place, kept++);
  resize_for(kept);
  for (std::size_t place = kept; place < lanes(); ++place) clear_lane(place);
}

template <typename Batch>
void PackedBatches<Batch>::leave_out(const std::vector<std::size_t> &places)
{
  auto next = places.begin();
  std::size_t begin = 0, to = 0, colours = 0;
  for (const std::size_t end : colour_end_) {
    const std::size_t first = to;
    for (std::size_t place = begin * WIDTH; place < end * WIDTH; ++place) {
      if (next != places.end() && *next == place)
        ++next;
      else if (!is_empty(place)) {
        if (to != place) copy(*this, place, to);
        ++to;
      }
    }
    begin = end;
    if (to == first) continue;
    // What is left of the colour's last batch has been read.
    for (; to % WIDTH != 0; ++to) clear_lane(to);
    colour_end_[colours++] = to / WIDTH;
  }
  colour_end_.resize(colours);
  batches.resize(to / WIDTH);
  details.resize(to / WIDTH);
}

template class PackedBatches<swept::ParticleBatch>;
template class PackedBatches<swept::BodyBatch>;

}    // namespace inelastic
