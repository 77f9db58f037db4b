#include "solver/loop_lobes.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace cohort {

namespace {

constexpr int rows = 512;             // lines of constant y on which winding numbers are told
constexpr double significant = 0.01;  // of the area of all lobes
constexpr double least_area = 1e-3;   // of the curve's box; below it is a line
constexpr double least_width = 1e-4;  // of the curve's box; narrower is between strands that lie together

/// Where a line of constant y meets the curve, and by how much the winding number rises there to the right.
struct Meeting {
  double x;
  int step;
};

/// A stretch of such a line with one sign of the winding number, and the lobe it belongs to.
struct Stretch {
  double left, right;
  bool counterclockwise;
  int lobe;
};

std::vector<double> scaled(std::span<const double> values) {
  const auto [lower, upper] = std::minmax_element(values.begin(), values.end());
  std::vector<double> result;
  for (const double value : values) result.push_back((value - *lower) / (*upper - *lower));
  return result;
}

std::vector<std::vector<Meeting>> meetings(const std::vector<double>& x, const std::vector<double>& y) {
  std::vector<std::vector<Meeting>> lines(rows);
  for (std::size_t i = 0; i < x.size(); ++i) {
    const std::size_t next = (i + 1) % x.size();
    const bool down = y[next] < y[i];
    const auto [lower, upper] = std::minmax(y[i], y[next]);
    const int first = std::max(0, static_cast<int>(std::ceil(lower * rows - 0.5)));
    for (int r = first; r < rows && (r + 0.5) / rows < upper; ++r) {
      const double share = ((r + 0.5) / rows - y[i]) / (y[next] - y[i]);
      lines[static_cast<std::size_t>(r)].push_back({x[i] + share * (x[next] - x[i]), down ? 1 : -1});
    }
  }
  return lines;
}

std::vector<Stretch> stretches(std::vector<Meeting> line) {
  std::sort(line.begin(), line.end(), [](Meeting a, Meeting b) { return a.x < b.x; });
  std::vector<Stretch> result;
  int winding = 0;
  for (std::size_t k = 0; k + 1 < line.size(); ++k) {
    winding += line[k].step;
    const double left = line[k].x, right = line[k + 1].x;
    if (winding == 0 || right == left) continue;
    const bool counterclockwise = winding > 0;
    if (!result.empty() && result.back().right == left && result.back().counterclockwise == counterclockwise)
      result.back().right = right;
    else
      result.push_back({left, right, counterclockwise, 0});
  }
  std::erase_if(result, [](const Stretch& s) { return s.right - s.left < least_width; });
  return result;
}

}  // namespace

LoopLobes loop_lobes(std::span<const double> x, std::span<const double> y) {
  const auto flat = [](std::span<const double> values) {
    const auto [lower, upper] = std::minmax_element(values.begin(), values.end());
    return !(*upper > *lower);
  };
  if (x.size() < 3 || flat(x) || flat(y)) return {};

  // Lobes grow from line to line; `joined` leads from one to another that turned out to be the same.
  std::vector<int> joined;
  std::vector<double> area;
  std::vector<bool> counterclockwise;
  const auto root = [&](int lobe) {
    while (joined[static_cast<std::size_t>(lobe)] != lobe) lobe = joined[static_cast<std::size_t>(lobe)];
    return lobe;
  };
  std::vector<Stretch> below;
  for (const std::vector<Meeting>& line : meetings(scaled(x), scaled(y))) {
    std::vector<Stretch> here = stretches(line);
    for (Stretch& stretch : here) {
      stretch.lobe = static_cast<int>(joined.size());
      joined.push_back(stretch.lobe);
      area.push_back((stretch.right - stretch.left) / rows);
      counterclockwise.push_back(stretch.counterclockwise);
      for (const Stretch& other : below)
        if (other.counterclockwise == stretch.counterclockwise && other.left < stretch.right &&
            stretch.left < other.right)
          joined[static_cast<std::size_t>(root(other.lobe))] = root(stretch.lobe);
    }
    below = std::move(here);
  }
  std::vector<double> of_lobe(joined.size(), 0);
  for (std::size_t i = 0; i < joined.size(); ++i)
    of_lobe[static_cast<std::size_t>(root(static_cast<int>(i)))] += area[i];
  const double all = std::accumulate(area.begin(), area.end(), 0.0);
  LoopLobes lobes;
  if (all < least_area) return lobes;
  for (std::size_t i = 0; i < of_lobe.size(); ++i)
    if (of_lobe[i] >= significant * all) ++(counterclockwise[i] ? lobes.counterclockwise : lobes.clockwise);
  return lobes;
}

}  // namespace cohort
