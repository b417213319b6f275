#include "inelastic_packed_groups.h"

#include <cstdint>
#include <utility>

namespace inelastic {

template <typename Group> void PackedGroups<Group>::clear(int nobody, bool has_springs)
{
  groups.clear();
  rest.clear();
  colour_end_.clear();
  nobody_ = nobody;
  has_springs_ = has_springs;
}

template <typename Group> std::size_t PackedGroups<Group>::used() const
{
  std::size_t used = lanes();
  while (used > 0 && is_empty(used - 1)) --used;
  return used;
}

template <typename Group> void PackedGroups<Group>::resize_for(std::size_t lanes_needed)
{
  const std::size_t from = lanes();
  groups.resize((lanes_needed + WIDTH - 1) / WIDTH);
  rest.resize(groups.size());
  for (std::size_t place = from; place < lanes(); ++place) clear_lane(place);
}

template <typename Group> void PackedGroups<Group>::clear_lane(std::size_t place)
{
  Group &to = group(place);
  swept::Rest &others = rest_of(place);
  const int lane = static_cast<int>(place % WIDTH);
  to.first[lane] = to.second[lane] =
      static_cast<std::uint32_t>(nobody_ * sizeof(typename Group::State));
  for (swept::Eight *const numbers : {&to.idle, &to.now, &to.before, &to.inverse_target})
    (*numbers)[lane] = 0.0f;
  to.gap[lane] = 1.0f;
  if constexpr (HAS_BODIES<Group>) {
    to.first_row[lane] = to.second_row[lane] = swept::Eight{};
  } else {
    for (int d = 0; d < 4; ++d) to.row[lane % 4][4 * (lane / 4) + d] = 0.0f;
  }
  others.source[lane] = swept::NONE;
  others.first[lane] = others.second[lane] = 0;
  others.root[lane] = others.give[lane] = others.part[lane] = 0.0f;
  others.least_target[lane] = 1.0f;    // any that can be divided by
}

template <typename Group> void PackedGroups<Group>::add_colour(std::size_t more)
{
  resize_for(lanes() + more);
  colour_end_.push_back(groups.size());
}

template <typename Group>
std::vector<std::size_t> PackedGroups<Group>::add(const ConstraintColours &colours)
{
  constexpr int LAST = ConstraintColours::LAST;
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

template <typename Group>
void PackedGroups<Group>::copy(const PackedGroups &from, std::size_t source, std::size_t place)
{
  const Group &a = from.group(source);
  const swept::Rest &rest_a = from.rest_of(source);
  Group &b = group(place);
  swept::Rest &rest_b = rest_of(place);
  const int i = static_cast<int>(source % WIDTH), j = static_cast<int>(place % WIDTH);
  b.first[j] = a.first[i];
  b.second[j] = a.second[i];
  b.gap[j] = a.gap[i];
  b.idle[j] = a.idle[i];
  b.now[j] = a.now[i];
  b.before[j] = a.before[i];
  b.inverse_target[j] = a.inverse_target[i];
  if constexpr (HAS_BODIES<Group>) {
    b.first_row[j] = a.first_row[i];
    b.second_row[j] = a.second_row[i];
  } else {
    for (int d = 0; d < 4; ++d) b.row[j % 4][4 * (j / 4) + d] = a.row[i % 4][4 * (i / 4) + d];
  }
  rest_b.source[j] = rest_a.source[i];
  rest_b.first[j] = rest_a.first[i];
  rest_b.second[j] = rest_a.second[i];
  rest_b.root[j] = rest_a.root[i];
  rest_b.give[j] = rest_a.give[i];
  rest_b.least_target[j] = rest_a.least_target[i];
  rest_b.part[j] = rest_a.part[i];
}

template <typename Group> void PackedGroups<Group>::close_up()
{
  std::size_t kept = 0;
  for (std::size_t place = 0; place < lanes(); ++place)
    if (!is_empty(place)) copy(*this, place, kept++);
  resize_for(kept);
  for (std::size_t place = kept; place < lanes(); ++place) clear_lane(place);
}

template <typename Group>
void PackedGroups<Group>::leave_out(const std::vector<std::size_t> &places)
{
  PackedGroups kept;
  kept.clear(nobody_, has_springs_);
  auto next = places.begin();
  std::size_t begin = 0;
  std::vector<std::size_t> of_colour;
  for (const std::size_t end : colour_end_) {
    of_colour.clear();
    for (std::size_t place = begin * WIDTH; place < end * WIDTH; ++place) {
      if (next != places.end() && *next == place)
        ++next;
      else if (!is_empty(place))
        of_colour.push_back(place);
    }
    begin = end;
    if (of_colour.empty()) continue;
    std::size_t to = kept.lanes();
    kept.add_colour(of_colour.size());
    for (const std::size_t place : of_colour) kept.copy(*this, place, to++);
  }
  *this = std::move(kept);
}

template class PackedGroups<swept::ParticleGroup>;
template class PackedGroups<swept::BodyGroup>;

}    // namespace inelastic
