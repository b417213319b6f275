// Random numbers that depend on nothing but a key and a counter: they are the same for any number
// of ranks, any order of particles and after a restart.

#pragma once

#include <array>
#include <cstdint>

namespace inelastic {

// Philox 4x32 with 10 rounds. The constants and the round are those of Salmon, Moraes, Dror and
// Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC'11.
inline std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter,
                                           std::array<std::uint32_t, 2> key)
{
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t product0 = std::uint64_t{0xD2511F53} * counter[0];
    const std::uint64_t product1 = std::uint64_t{0xCD9E8D57} * counter[2];
    counter = {static_cast<std::uint32_t>(product1 >> 32) ^ counter[1] ^ key[0],
               static_cast<std::uint32_t>(product1),
               static_cast<std::uint32_t>(product0 >> 32) ^ counter[3] ^ key[1],
               static_cast<std::uint32_t>(product0)};
    key[0] += 0x9E3779B9;
    key[1] += 0xBB67AE85;
  }
  return counter;
}

// Returns three numbers, uniform in [-1, 1], for one particle (its ID) at one step.
inline std::array<double, 3> uniform_vector(std::uint32_t seed, std::uint64_t particle,
                                            std::uint64_t step)
{
  constexpr double SCALE = 2.0 / 4294967295.0;    // 2^32 - 1: both ends are reached
  const std::array<std::uint32_t, 4> bits =
      philox({static_cast<std::uint32_t>(particle), static_cast<std::uint32_t>(particle >> 32),
              static_cast<std::uint32_t>(step), static_cast<std::uint32_t>(step >> 32)},
             {seed, 0});
  return {bits[0] * SCALE - 1.0, bits[1] * SCALE - 1.0, bits[2] * SCALE - 1.0};
}

}    // namespace inelastic
