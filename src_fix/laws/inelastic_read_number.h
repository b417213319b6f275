// Numbers in the words of a law.

#pragma once

#include <charconv>
#include <cmath>
#include <string>

namespace inelastic {

// Reads the whole word as a finite number. Returns whether it is one.
inline bool read_number(const std::string &word, double &number)
{
  const char *const end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, number);
  return error == std::errc() && stop == end && std::isfinite(number);
}

}    // namespace inelastic
