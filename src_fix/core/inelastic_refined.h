// What a source of constraints has changed of a problem that was just solved
// (inelastic_projection.h): mostly it adds a few constraints to many, and a search need not begin
// anew.

#pragma once

#include <cstddef>
#include <vector>

namespace inelastic {

// A constraint known before of which the gap alone has changed, and by how much [length].
struct ChangedGap {
  std::size_t constraint;
  double by;
};

struct Refined {
  long number = 0;    // of constraints that this rank added, behind the others, or changed
  std::vector<ChangedGap> gaps;
  bool anew = false;    // more than that has changed
};

}    // namespace inelastic
