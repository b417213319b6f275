// Groups of packed constraints (inelastic_sweep_kernels.h), colour after colour. A place is a lane
// of a group: eight times the group's number, and the lane in it.

#pragma once

#include "inelastic_constraint_colours.h"
#include "inelastic_sweep_kernels.h"

#include <cstddef>
#include <type_traits>
#include <vector>

namespace inelastic {

template <typename Group> constexpr bool HAS_BODIES = std::is_same_v<Group, swept::BodyGroup>;

template <typename Group> class PackedGroups {
 public:
  static constexpr int WIDTH = swept::WIDTH;

  std::vector<Group> groups;
  std::vector<swept::Rest> rest;

  // Empties all. Lanes that are empty have the states of nobody, a mover that nothing moves.
  void clear(int nobody, bool has_springs);
  std::size_t lanes() const { return groups.size() * WIDTH; }
  bool is_empty(std::size_t place) const
  { return rest_of(place).source[place % WIDTH] == swept::NONE; }
  // How many lanes are left when the empty ones at the end are left out.
  std::size_t used() const;

  Group &group(std::size_t place) { return groups[place / WIDTH]; }
  const Group &group(std::size_t place) const { return groups[place / WIDTH]; }
  // As the passes of inelastic_sweep_kernels.h take them.
  const swept::Rest *springs() const { return has_springs_ ? rest.data() : nullptr; }
  swept::Rest &rest_of(std::size_t place) { return rest[place / WIDTH]; }
  const swept::Rest &rest_of(std::size_t place) const { return rest[place / WIDTH]; }

  // Adds groups for constraints with these colours, in which those of the last colour have one
  // each. Returns the place of each constraint.
  std::vector<std::size_t> add(const ConstraintColours &colours);
  // Makes the number of lanes the least that is enough for so many; more ones are empty.
  void resize_for(std::size_t lanes);
  void clear_lane(std::size_t place);
  // Copies the lane at a place of other groups to one of these.
  void copy(const PackedGroups &from, std::size_t source, std::size_t place);
  // Lanes in use move up to where lanes are empty. Not for colours.
  void close_up();
  // Leaves out these places, in ascending order: the others move up within their colour.
  void leave_out(const std::vector<std::size_t> &places);

 private:
  void add_colour(std::size_t lanes);

  std::vector<std::size_t> colour_end_;    // in groups, one after the other
  int nobody_ = 0;
  bool has_springs_ = false;    // some constraint has a compliance
};

}    // namespace inelastic
