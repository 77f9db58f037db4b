#include <numeric>
#include <utility>

#include "ensemble/random.hpp"
#include "ensemble/sampler.hpp"

namespace cohort {
namespace {

__extension__ using uint128 = unsigned __int128;

/// Integer in [0, count): the high half of a product, biased by less than count / 2^64.
std::uint64_t below(std::uint64_t count, std::uint64_t bits) {
  return static_cast<std::uint64_t>((uint128{bits} * count) >> 64);
}

class LatinHypercube final : public Sampler {
 public:
  LatinHypercube(std::uint64_t seed, int dimensions, std::int64_t members)
      : seed_(seed), members_(members), strata_(static_cast<std::size_t>(dimensions)) {
    for (std::uint32_t axis = 0; axis < strata_.size(); ++axis) {
      auto& strata = strata_[axis];
      strata.resize(static_cast<std::size_t>(members));
      std::iota(strata.begin(), strata.end(), 0u);
      for (std::uint64_t i = strata.size(); i > 1; --i)  // Fisher-Yates
        std::swap(strata[i - 1], strata[below(i, random_bits(seed, Stream::latin_permutation, axis, i))]);
    }
  }

  std::vector<double> point(std::int64_t member) const override {
    std::vector<double> u(strata_.size());
    for (std::uint32_t axis = 0; axis < u.size(); ++axis) {
      // 32 bits within a stratum: with all 53 the sum could round up into the next one.
      const auto bits =
          random_bits(seed_, Stream::latin_jitter, axis, static_cast<std::uint64_t>(member)) >> 32;
      const double jitter = (static_cast<double>(bits) + 0.5) * 0x1p-32;
      u[axis] = (strata_[axis][static_cast<std::size_t>(member)] + jitter) / static_cast<double>(members_);
    }
    return u;
  }

 private:
  std::uint64_t seed_;
  std::int64_t members_;
  std::vector<std::vector<std::uint32_t>> strata_;  // (d, N)
};

}  // namespace

std::unique_ptr<Sampler> latin_hypercube(std::uint64_t seed, int dimensions, std::int64_t members) {
  return std::make_unique<LatinHypercube>(seed, dimensions, members);
}

}  // namespace cohort
