// configs/niederer.yaml against the eleven codes of Niederer et al. 2011, on the coarser of the published
// grids; jobs/niederer.sh runs the finer ones.
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "tests/campaign_run.hpp"

namespace cohort::test {
namespace {

struct Published {
  std::array<double, 3> point;
  double mean, deviation;
};

// Rows of tests/reference/niederer2011.csv for one spacing.
std::vector<Published> published(const std::string& dx) {
  std::ifstream file(std::string(COHORT_SOURCE_DIR) + "/tests/reference/niederer2011.csv");
  std::vector<Published> result;
  std::vector<std::string> columns;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::vector<std::string> cells;
    std::istringstream words(line);
    for (std::string word; std::getline(words, word, ',');) cells.push_back(word);
    if (columns.empty()) {
      columns = cells;
      continue;
    }
    const auto cell = [&](const std::string& name) {
      const auto column = std::find(columns.begin(), columns.end(), name);
      if (column == columns.end()) throw std::out_of_range("no column " + name);
      return std::stod(cells.at(static_cast<std::size_t>(column - columns.begin())));
    };
    result.push_back({{cell("x_mm"), cell("y_mm"), cell("z_mm")}, cell("mean_" + dx), cell("sd_" + dx)});
  }
  return result;
}

std::string number(double x) {
  std::ostringstream text;
  text << x;
  return text.str();
}

// Runs a spacing; every point within one standard deviation of the mean. Returns the largest distance along
// the fibres from it, at (20, 0, 0).
double along_fibres(const std::string& dx, const std::string& end_ms) {
  const std::vector<Published> points = published(dx);
  EXPECT_EQ(points.size(), 9u);
  std::string probes = "outputs.activation.probes={";
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto& [x, y, z] = points[k].point;
    probes.append("p").append(std::to_string(k));
    probes += "_mm: [" + number(x) + ", " + number(y) + ", " + number(z) + "], ";
  }
  const CampaignRun run("configs/niederer.yaml", {"grid.dx_mm=" + dx, "time.end_ms=" + end_ms, probes + "}"});
  EXPECT_EQ(run.recording().outcome, Outcome::done) << run.recording().reason;
  double along = std::nan("");
  for (std::size_t k = 0; k < points.size(); ++k) {
    const double time = run.feature("activation_p" + std::to_string(k) + "_ms");
    const auto& [point, mean, deviation] = points[k];
    std::printf("dx %s  (%4.1f, %3.1f, %3.1f)  %7.2f ms, eleven codes %6.2f +- %5.2f\n", dx.c_str(), point[0],
                point[1], point[2], time, mean, deviation);
    EXPECT_LE(std::abs(time - mean), deviation) << "point " << k;
    if (point == std::array<double, 3>{20, 0, 0}) along = std::abs(time - mean);
  }
  return along;
}

TEST(Niederer, AllPointsWithinOneDeviationAtHalfAMillimetre) {
  along_fibres("0.5", "200");
}

TEST(Niederer, AllPointsWithinOneDeviationAtAFifthOfAMillimetre) {
  EXPECT_LT(along_fibres("0.2", "60"), 0.6) << "at (20, 0, 0), ms";
}

}  // namespace
}  // namespace cohort::test
