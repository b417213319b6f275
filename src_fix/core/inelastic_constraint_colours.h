// Colours of constraints: those of one colour have no grain in common, so that they can be worked
// on together. (A grain is a particle that turns with nothing, or a body.)

#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace inelastic {

class ConstraintColours {
 public:
  // As many as a mask has bits. Constraints of the last one may have grains in common.
  static constexpr int NUMBER = 64, LAST = NUMBER - 1;

  // Colours constraints, given by the grains of both sides, in their order: each gets the first
  // colour that no earlier one of either of its grains has. What no impulse moves (`moves` has an
  // entry for each grain) is shared freely.
  ConstraintColours(const std::vector<int> &first, const std::vector<int> &second,
                    const std::vector<char> &moves);

  std::size_t size() const { return colour_.size(); }
  int operator[](std::size_t constraint) const { return colour_[constraint]; }
  // How many constraints have a colour.
  std::size_t count(int colour) const { return count_[static_cast<std::size_t>(colour)]; }

 private:
  std::vector<unsigned char> colour_;
  std::array<std::size_t, NUMBER> count_{};
};

}    // namespace inelastic
