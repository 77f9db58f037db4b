#pragma once

#include <array>
#include <cstdint>

namespace cohort {

/// Philox4x32-10, a counter-based random number generator: the output is a function of counter and key alone.
/// J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11
/// (2011), doi:10.1145/2063384.2063405.
constexpr std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter,
                                                  std::array<std::uint32_t, 2> key) {
  constexpr int rounds = 10;
  constexpr std::uint64_t multipliers[] = {0xD2511F53, 0xCD9E8D57};
  constexpr std::uint32_t weyl[] = {0x9E3779B9, 0xBB67AE85};  // golden ratio, sqrt(3) - 1
  for (int round = 0; round < rounds; ++round) {
    const std::uint64_t p0 = multipliers[0] * counter[0], p1 = multipliers[1] * counter[2];
    counter = {static_cast<std::uint32_t>(p1 >> 32) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(p1),
               static_cast<std::uint32_t>(p0 >> 32) ^ counter[3] ^ key[1], static_cast<std::uint32_t>(p0)};
    key = {key[0] + weyl[0], key[1] + weyl[1]};
  }
  return counter;
}

/// What a stream of random numbers is for; its high half keeps the samplers' numbers apart.
enum class Stream : std::uint32_t {
  monte_carlo,
  latin_permutation,
  latin_jitter,
  sobol_matrix,
  sobol_shift,
  member,
  corners
};

/// 64 random bits, a function of the arguments alone. `dimension` counts within the stream, `index` within
/// the dimension.
constexpr std::uint64_t random_bits(std::uint64_t seed, Stream stream, std::uint32_t dimension,
                                    std::uint64_t index) {
  const auto out = philox4x32({static_cast<std::uint32_t>(index), static_cast<std::uint32_t>(index >> 32),
                               dimension, static_cast<std::uint32_t>(stream)},
                              {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)});
  return std::uint64_t{out[1]} << 32 | out[0];
}

/// Uniform in the open interval (0, 1): odd multiples of 2^-53.
constexpr double random_uniform(std::uint64_t seed, Stream stream, std::uint32_t dimension,
                                std::uint64_t index) {
  return (static_cast<double>(random_bits(seed, stream, dimension, index) >> 12) + 0.5) * 0x1p-52;
}

}  // namespace cohort
