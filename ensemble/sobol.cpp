#include <array>
#include <bit>
#include <stdexcept>
#include <string>

#include "ensemble/random.hpp"
#include "ensemble/sampler.hpp"

namespace cohort {
namespace {

constexpr std::uint16_t direction_numbers[] = {
#include "ensemble/sobol_directions.inc"
};

constexpr int index_bits = 32;   // the sequence has 2^32 points
constexpr int output_bits = 52;  // scrambled digits beyond 32 are random, so that points are dense in (0, 1)

/// Columns of a generator matrix: bit 31 is the first binary digit.
using Directions = std::array<std::uint32_t, index_bits>;

/// `entry` stands at the dimension's polynomial.
Directions directions(const std::uint16_t* entry) {
  const std::uint32_t polynomial = entry[0];
  const int degree = std::bit_width(polynomial) - 1;
  Directions v;
  for (int k = 0; k < index_bits; ++k) {
    if (k < degree) {
      v[k] = std::uint32_t{entry[1 + k]} << (31 - k);
      continue;
    }
    v[k] = v[k - degree] ^ (v[k - degree] >> degree);
    for (int j = 1; j < degree; ++j)
      if (polynomial >> (degree - j) & 1) v[k] ^= v[k - j];
  }
  return v;
}

Directions van_der_corput() {
  Directions v;
  for (int k = 0; k < index_bits; ++k) v[k] = std::uint32_t{1} << (31 - k);
  return v;
}

/// `v` times a random lower triangular matrix with unit diagonal, output_bits rows. Row r is a word of random
/// bits of which those of its first r columns count.
std::uint64_t scramble(std::uint32_t v, const std::array<std::uint32_t, output_bits>& rows) {
  std::uint64_t out = 0;
  for (int r = 0; r < output_bits; ++r)
    out |= std::uint64_t(std::popcount(rows[r] & v) & 1) << (output_bits - 1 - r);
  return out;
}

std::array<std::uint32_t, output_bits> scrambling_matrix(std::uint64_t seed, std::uint32_t axis) {
  std::array<std::uint32_t, output_bits> rows;
  for (int r = 0; r < output_bits; ++r) {
    rows[r] = static_cast<std::uint32_t>(
        random_bits(seed, Stream::sobol_matrix, axis, static_cast<std::uint64_t>(r)));
    if (r >= index_bits) continue;
    const std::uint32_t diagonal = std::uint32_t{1} << (31 - r);
    const std::uint32_t left = ~(diagonal | (diagonal - 1));
    rows[r] = (rows[r] & left) | diagonal;
  }
  return rows;
}

class Sobol final : public Sampler {
 public:
  Sobol(std::uint64_t seed, int dimensions, bool scrambled) : half_(scrambled ? 0.5 : 0.0) {
    const std::uint16_t* entry = direction_numbers;
    for (std::uint32_t axis = 0; axis < static_cast<std::uint32_t>(dimensions); ++axis) {
      Directions v;
      if (axis == 0) {
        v = van_der_corput();
      } else {
        v = directions(entry);
        entry += std::bit_width(std::uint32_t{*entry});
      }
      const auto rows = scrambled ? scrambling_matrix(seed, axis) : std::array<std::uint32_t, output_bits>{};
      std::array<std::uint64_t, index_bits> columns;
      for (int k = 0; k < index_bits; ++k)
        columns[k] = scrambled ? scramble(v[k], rows) : std::uint64_t{v[k]} << (output_bits - index_bits);
      columns_.push_back(columns);
      shifts_.push_back(scrambled ? random_bits(seed, Stream::sobol_shift, axis, 0) >> (64 - output_bits)
                                  : 0);
    }
  }

  std::vector<double> point(std::int64_t member) const override {
    const auto index = static_cast<std::uint64_t>(member);
    if (index >> index_bits) throw std::out_of_range("the Sobol' sequence ends after 2^32 members");
    const std::uint64_t gray = index ^ (index >> 1);
    std::vector<double> u(columns_.size());
    for (std::size_t axis = 0; axis < u.size(); ++axis) {
      std::uint64_t digits = shifts_[axis];
      for (int k = 0; k < index_bits; ++k)
        if (gray >> k & 1) digits ^= columns_[axis][k];
      u[axis] = (static_cast<double>(digits) + half_) * 0x1p-52;
    }
    return u;
  }

 private:
  double half_;  // centres a scrambled point in its last digit: never 0 or 1
  std::vector<std::array<std::uint64_t, index_bits>> columns_;
  std::vector<std::uint64_t> shifts_;
};

}  // namespace

std::unique_ptr<Sampler> sobol(std::uint64_t seed, int dimensions, bool scrambled) {
  if (dimensions > sobol_dimensions)
    throw std::invalid_argument("sobol has direction numbers for " + std::to_string(sobol_dimensions) +
                                " parameters, the campaign samples " + std::to_string(dimensions) +
                                "; use latin_hypercube or monte_carlo");
  return std::make_unique<Sobol>(seed, dimensions, scrambled);
}

}  // namespace cohort
