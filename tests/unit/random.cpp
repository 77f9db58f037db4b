#include "ensemble/random.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace cohort {
namespace {

struct KnownAnswer {
  std::array<std::uint32_t, 4> counter;
  std::array<std::uint32_t, 2> key;
  std::array<std::uint32_t, 4> expected;
};

// Random123 (github.com/DEShawResearch/random123), tests/kat_vectors, the three lines "philox4x32 10".
constexpr KnownAnswer known_answers[] = {
    {{0, 0, 0, 0}, {0, 0}, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
    {{0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff},
     {0xffffffff, 0xffffffff},
     {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}},
    {{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344},
     {0xa4093822, 0x299f31d0},
     {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}},
};

TEST(Philox, KnownAnswersOfRandom123) {
  for (const auto& [counter, key, expected] : known_answers) EXPECT_EQ(philox4x32(counter, key), expected);
}

TEST(Philox, EveryArgumentChangesTheNumber) {
  const auto bits = random_bits(7, Stream::member, 3, 11);
  EXPECT_NE(bits, random_bits(8, Stream::member, 3, 11));
  EXPECT_NE(bits, random_bits(7 + (std::uint64_t{1} << 32), Stream::member, 3, 11));
  EXPECT_NE(bits, random_bits(7, Stream::monte_carlo, 3, 11));
  EXPECT_NE(bits, random_bits(7, Stream::member, 4, 11));
  EXPECT_NE(bits, random_bits(7, Stream::member, 3, 12));
  EXPECT_NE(bits, random_bits(7, Stream::member, 3, 11 + (std::uint64_t{1} << 32)));
}

TEST(Philox, UniformHasTheRightMomentsAndNeverTouchesTheEnds) {
  const int count = 100000;
  double sum = 0, squares = 0;
  for (int i = 0; i < count; ++i) {
    const double u = random_uniform(1, Stream::monte_carlo, 0, i);
    ASSERT_GT(u, 0);
    ASSERT_LT(u, 1);
    sum += u;
    squares += u * u;
  }
  EXPECT_NEAR(sum / count, 0.5, 4 * std::sqrt(1.0 / 12 / count));  // four standard errors
  EXPECT_NEAR(squares / count, 1.0 / 3, 4 * std::sqrt(4.0 / 45 / count));
}

}  // namespace
}  // namespace cohort
