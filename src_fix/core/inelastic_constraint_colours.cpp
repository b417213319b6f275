#include "inelastic_constraint_colours.h"

#include <algorithm>
#include <cstdint>

namespace inelastic {

ConstraintColours::ConstraintColours(const std::vector<int> &first, const std::vector<int> &second,
                                     const std::vector<char> &moves) : colour_(first.size())
{
  std::vector<std::uint64_t> taken(moves.size(), 0);    // a bit for each colour, per grain
  for (std::size_t k = 0; k < first.size(); ++k) {
    const bool one = moves[first[k]], other = moves[second[k]];
    const std::uint64_t both = (one ? taken[first[k]] : 0) | (other ? taken[second[k]] : 0);
    const int colour = ~both == 0 ? LAST : std::min(LAST, __builtin_ctzll(~both));
    colour_[k] = static_cast<unsigned char>(colour);
    ++count_[static_cast<std::size_t>(colour)];
    const std::uint64_t bit = colour == LAST ? 0 : std::uint64_t{1} << colour;
    if (one) taken[first[k]] |= bit;
    if (other) taken[second[k]] |= bit;
  }
}

}    // namespace inelastic
