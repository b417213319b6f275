// Batches of packed constraints (inelastic_sweep_kernels.h), colour after colour. A place is a lane
// of a batch: eight times the batch's number, and the lane in it.

#pragma once

#include "inelastic_constraint_colours.h"
#include "inelastic_sweep_kernels.h"

#include <cstddef>
#include <type_traits>
#include <vector>

namespace inelastic {

template <typename Batch> constexpr bool HAS_BODIES = std::is_same_v<Batch, swept::BodyBatch>;

template <typename Batch> class PackedBatches {
 public:
  static constexpr int WIDTH = swept::WIDTH;

  swept::Array<Batch> batches;
  swept::Array<swept::Details> details;

  // Empties all. Lanes that are empty have the states of nobody, a grain that nothing moves.
  void clear(int nobody, bool has_springs);
  std::size_t lanes() const { return batches.size() * WIDTH; }
  bool is_empty(std::size_t place) const
  { return details_of(place).source[place % WIDTH] == swept::NONE; }
  // How many lanes are left when the empty ones at the end are left out.
  std::size_t used() const;

  Batch &batch(std::size_t place) { return batches[place / WIDTH]; }
  const Batch &batch(std::size_t place) const { return batches[place / WIDTH]; }
  // As the passes of inelastic_sweep_kernels.h take them.
  const swept::Details *springs() const { return has_springs_ ? details.data() : nullptr; }
  swept::Details &details_of(std::size_t place) { return details[place / WIDTH]; }
  const swept::Details &details_of(std::size_t place) const { return details[place / WIDTH]; }

  // Adds batches for constraints with these colours, in which those of the last colour have one
  // each. Returns the place of each constraint.
  std::vector<std::size_t> add(const ConstraintColours &colours);
  // Makes the number of lanes the least that is enough for so many; more ones are empty. New ones
  // up to there have no value yet, and must be written.
  void resize_for(std::size_t lanes);
  void clear_lane(std::size_t place);
  // Copies the lane at a place of other batches to one of these.
  void copy(const PackedBatches &from, std::size_t source, std::size_t place);
  // Lanes in use move up to where lanes are empty. Not for colours.
  void close_up();
  // Leaves out these places, in ascending order: the others move up within their colour.
  void leave_out(const std::vector<std::size_t> &places);

 private:
  void add_colour(std::size_t lanes);

  std::vector<std::size_t> colour_end_;    // in batches, one after the other
  int nobody_ = 0;
  bool has_springs_ = false;    // some constraint has a compliance
};

}    // namespace inelastic
