#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>

#include "ensemble/members.hpp"
#include "ensemble/sampler.hpp"

namespace cohort {
namespace {

TEST(Sobol, EqualsScipyForTheSameNumbers) {
  const auto sampler = sobol(0, 1024, false);
  std::ifstream in(COHORT_SOURCE_DIR "/tests/reference/sobol.csv");
  std::string line;
  std::getline(in, line);
  std::int64_t member;
  int axis, rows = 0;
  double expected;
  char comma;
  while (in >> member >> comma >> axis >> comma >> expected) {
    EXPECT_EQ(sampler->point(member)[static_cast<std::size_t>(axis)], expected) << member << " " << axis;
    ++rows;
  }
  EXPECT_EQ(rows, 13 * 8);
}

TEST(Sobol, EveryDimensionEqualsScipy) {
  const auto sampler = sobol(0, sobol_dimensions, false);
  uLong crc = crc32(0, nullptr, 0);
  for (int member = 0; member < 2048; ++member) {
    const auto point = sampler->point(member);
    crc = crc32(crc, reinterpret_cast<const Bytef*>(point.data()),
                static_cast<uInt>(point.size() * sizeof(double)));
  }
  EXPECT_EQ(crc, 0x2465a2adu);  // printed by tests/reference/make_samples.py
}

/// How many of 2^m points stand in each box of 2^a by 2^(m-a) of the unit square.
std::vector<int> box_counts(const Sampler& sampler, int m, int a, std::size_t first, std::size_t second,
                            int offset = 0) {
  std::vector<int> counts(std::size_t{1} << m);
  for (int i = 0; i < 1 << m; ++i) {
    const auto u = sampler.point(offset + i);
    const auto row = static_cast<std::size_t>(u[first] * (1 << a));
    const auto column = static_cast<std::size_t>(u[second] * (1 << (m - a)));
    ++counts[(row << (m - a)) + column];
  }
  return counts;
}

TEST(Sobol, ScrambledKeepsTheNet) {
  const int m = 8;
  const std::vector<int> once(1 << m, 1);
  for (const std::uint64_t seed : {0, 1, 7}) {
    const auto sampler = sobol(seed, 40);
    // The first two dimensions are a (0,2)-sequence: each elementary interval of area 2^-m holds one point,
    // in the first 2^m points and in the next.
    for (int a = 0; a <= m; ++a) {
      EXPECT_EQ(box_counts(*sampler, m, a, 0, 1), once) << "seed " << seed << " a " << a;
      EXPECT_EQ(box_counts(*sampler, m, a, 0, 1, 1 << m), once) << "seed " << seed << " a " << a;
    }
    for (std::size_t axis = 0; axis < 40; ++axis) EXPECT_EQ(box_counts(*sampler, m, m, axis, 0), once);
  }
}

TEST(Sobol, ScramblingDiffersBySeedAndMovesPoints) {
  std::set<double> first;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const auto u = sobol(seed, 3)->point(5);
    EXPECT_GT(u[1], 0);
    EXPECT_LT(u[1], 1);
    first.insert(u[1]);
  }
  EXPECT_EQ(first.size(), 100u);
}

TEST(Sobol, ScramblingIsMoreThanAShift) {
  // A digital shift alone leaves the exclusive-or of two points as it was.
  const auto digits = [](double u) { return static_cast<std::uint64_t>(u * 0x1p32); };
  const auto a = sobol(1, 4), b = sobol(2, 4);
  EXPECT_NE(digits(a->point(3)[2]) ^ digits(a->point(9)[2]), digits(b->point(3)[2]) ^ digits(b->point(9)[2]));
}

TEST(Sobol, RefusesMoreDimensionsThanItHas) {
  EXPECT_THROW(sobol(0, sobol_dimensions + 1), std::invalid_argument);
}

TEST(LatinHypercube, OnePointInEachStratum) {
  for (const std::int64_t members : {1, 2, 7, 64, 1000}) {
    const auto sampler = latin_hypercube(3, 5, members);
    std::vector<std::vector<int>> counts(5, std::vector<int>(static_cast<std::size_t>(members)));
    for (std::int64_t i = 0; i < members; ++i) {
      const auto u = sampler->point(i);
      for (std::size_t axis = 0; axis < 5; ++axis)
        ++counts[axis].at(static_cast<std::size_t>(u[axis] * static_cast<double>(members)));
    }
    for (const auto& axis : counts) EXPECT_EQ(axis, std::vector<int>(static_cast<std::size_t>(members), 1));
  }
}

TEST(LatinHypercube, AxesAreShuffledApart) {
  const auto sampler = latin_hypercube(3, 2, 1000);
  double correlation = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto u = sampler->point(i);
    correlation += 12 * (u[0] - 0.5) * (u[1] - 0.5) / 1000;
  }
  EXPECT_NEAR(correlation, 0, 4 / std::sqrt(1000.0));  // four standard errors
}

TEST(Grid, IsTheFullFactorialWithItsEnds) {
  const auto sampler = grid(2, 9);
  std::set<std::vector<double>> points;
  for (int i = 0; i < 9; ++i) points.insert(sampler->point(i));
  EXPECT_EQ(points.size(), 9u);
  EXPECT_EQ(sampler->point(0), (std::vector<double>{0, 0}));
  EXPECT_EQ(sampler->point(1), (std::vector<double>{0, 0.5}));
  EXPECT_EQ(sampler->point(8), (std::vector<double>{1, 1}));
}

TEST(Grid, NamesTheCountsThatFit) {
  try {
    grid(3, 64 + 1);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("64 or 125"), std::string::npos) << error.what();
  }
  EXPECT_NO_THROW(grid(3, 125));
  EXPECT_NO_THROW(grid(10, 59049));
}

TEST(Grid, HasALevelForEachChoice) {
  Campaign campaign;
  campaign.method = Method::grid;
  campaign.members = 18;
  const Distribution uniform{.kind = Distribution::Kind::uniform, .a = 0, .b = 1, .choices = {}};
  const Distribution choice{.kind = Distribution::Kind::choice, .choices = {7, 8}};
  campaign.parameters = {{"a", uniform}, {"b", choice}, {"c", uniform}};
  const auto samples = sample(campaign);
  std::set<std::vector<double>> points;
  std::multiset<double> chosen;
  for (auto row = samples.physical.begin(); row != samples.physical.end(); row += 3) {
    points.emplace(row, row + 3);
    chosen.insert(row[1]);
  }
  EXPECT_EQ(points.size(), 18u);
  EXPECT_EQ(chosen.count(7), 9u);
  EXPECT_EQ(chosen.count(8), 9u);
}

TEST(Grid, ReachesEveryOfManyChoices) {
  Distribution choice{.kind = Distribution::Kind::choice, .choices = {}};
  for (int count = 1; count <= 200; ++count) {
    choice.choices.push_back(count);
    const auto sampler = grid(std::vector<std::int64_t>{count}, count);
    for (int i = 0; i < count; ++i) EXPECT_EQ(choice.value(sampler->point(i)[0]), i + 1);
  }
}

TEST(Grid, OfChoicesNamesTheCountsThatFit) {
  const auto message = [](std::vector<std::int64_t> levels, std::int64_t members) -> std::string {
    try {
      grid(std::move(levels), members);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message({0, 3, 0}, 20).find("did you mean 12 or 27?"), std::string::npos);
  EXPECT_NE(message({0, 3, 0}, 2).find("did you mean 3?"), std::string::npos);
  EXPECT_NE(message({2, 3}, 9).find("did you mean 6?"), std::string::npos);
  EXPECT_EQ(message({2, 3}, 6), "");
}

TEST(Samplers, AMemberIsTheSameWhateverIsAskedForFirst) {
  for (const auto method : {Method::sobol, Method::latin_hypercube, Method::grid, Method::monte_carlo}) {
    const auto forwards = make_sampler(method, 7, 3, 64), backwards = make_sampler(method, 7, 3, 64);
    std::vector<std::vector<double>> points(64);
    for (int i = 63; i >= 0; --i) points[static_cast<std::size_t>(i)] = backwards->point(i);
    for (int i = 0; i < 64; ++i) EXPECT_EQ(forwards->point(i), points[static_cast<std::size_t>(i)]);
  }
}

TEST(Samplers, PointsDoNotDependOnTheNumberOfMembersWhereThereAreNoStrata) {
  for (const auto method : {Method::sobol, Method::monte_carlo})
    EXPECT_EQ(make_sampler(method, 7, 3, 64)->point(13), make_sampler(method, 7, 3, 100000)->point(13));
}

Campaign campaign_of_three() {
  Campaign campaign;
  auto& table = campaign.scene.parameters;
  table.add({.path = "a", .unit = "mm", .value = 1, .lower = 0, .upper = 10, .meaning = "", .source = ""});
  table.add({.path = "b", .unit = "mm", .value = 2, .lower = 0, .upper = 10, .meaning = "", .source = ""});
  table.add({.path = "c",
             .unit = "mm",
             .value = inherited,
             .lower = 0,
             .upper = 10,
             .meaning = "",
             .source = "",
             .inherits = "b"});
  table.add({.path = "grid.dx_mm",
             .unit = "mm",
             .value = 1,
             .lower = 0,
             .upper = 10,
             .meaning = "",
             .source = "",
             .inherits = "",
             .structural = true});
  campaign.parameters = {{"b", {.kind = Distribution::Kind::uniform, .a = 4, .b = 6, .choices = {}}}};
  campaign.members = 16;
  campaign.seed = 3;
  return campaign;
}

TEST(Members, HoldTheSceneWithItsSamplesResolved) {
  const auto campaign = campaign_of_three();
  const auto all = members(campaign);
  const auto sampler = sobol(3, 1);
  ASSERT_EQ(all.size(), 16u);
  for (const auto& member : all) {
    EXPECT_EQ(member.id, &member - all.data());
    EXPECT_EQ(member.values[0], 1);
    EXPECT_EQ(member.values[1], 4 + 2 * sampler->point(member.id)[0]);
    EXPECT_EQ(member.values[2], member.values[1]);
  }
}

class Csv : public ::testing::Test {
 protected:
  std::string write(const std::string& text) {
    const auto path = ::testing::TempDir() + "points.csv";
    std::ofstream(path) << text;
    return path;
  }
  std::string mistake(const std::string& text) {
    auto campaign = campaign_of_three();
    campaign.method = Method::csv;
    campaign.points_file = write(text);
    campaign.members = 2;
    try {
      members(campaign);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  }
};

TEST_F(Csv, GivesPhysicalValues) {
  auto campaign = campaign_of_three();
  campaign.method = Method::csv;
  campaign.members = 2;
  campaign.points_file = write("# from a table\nb, a\n1.5, 2\n\n3e0,4\r\n9,9\n");
  const auto all = members(campaign);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].values, (std::vector<double>{2, 1.5, 1.5, 1}));
  EXPECT_EQ(all[1].values, (std::vector<double>{4, 3, 3, 1}));
}

TEST_F(Csv, NamesEveryMistakeWithItsLine) {
  const auto text = mistake("a,x,a,grid.dx_mm\n1,2\n1,two,3,4\n99,1,1,1\n");
  EXPECT_NE(text.find("points.csv:1: the scene has no parameter \"x\""), std::string::npos) << text;
  EXPECT_NE(text.find("points.csv:1: a occurs twice"), std::string::npos) << text;
  EXPECT_NE(text.find("points.csv:1: grid.dx_mm is shared"), std::string::npos) << text;
  EXPECT_NE(text.find("points.csv:2: 2 values for 4"), std::string::npos) << text;
  EXPECT_NE(text.find("points.csv:3: \"two\" is no number for x"), std::string::npos) << text;
  EXPECT_NE(text.find("points.csv:4: a = 99 is outside"), std::string::npos) << text;
  EXPECT_NE(mistake("a,b\n1,2\n").find("1 rows for 2 members"), std::string::npos);
  EXPECT_NE(mistake("\n").find("header"), std::string::npos);
}

}  // namespace
}  // namespace cohort
