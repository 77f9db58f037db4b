#include "solver/loop_crossings.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

namespace cohort {

namespace {

constexpr double significant = 0.01;       // of the convex hull's area
constexpr std::size_t most_points = 1000;  // every pair of segments is looked at
constexpr double coincident = 1e-7;        // points nearer than this are one; the curve is of size 1
constexpr double perturbation = 1e-9;      // puts points into general position

struct Point {
  double x, y;
};

double cross(Point a, Point b) {
  return a.x * b.y - a.y * b.x;
}

/// Twice the area of the triangle, positive where it runs counterclockwise.
double turn(Point a, Point b, Point c) {
  return cross({b.x - a.x, b.y - a.y}, {c.x - a.x, c.y - a.y});
}

/// In [-1, 1], a function of `index` alone (the finaliser of splitmix64).
double scatter(std::uint64_t index) {
  std::uint64_t bits = (index + 1) * 0x9E3779B97F4A7C15u;
  bits = (bits ^ (bits >> 30)) * 0xBF58476D1CE4E5B9u;
  bits = (bits ^ (bits >> 27)) * 0x94D049BB133111EBu;
  bits ^= bits >> 31;
  return static_cast<double>(bits >> 11) / static_cast<double>(std::uint64_t{1} << 52) - 1;
}

/// The curve scaled to a box of size 1, without coincident points, in general position.
std::vector<Point> scaled(std::span<const double> x, std::span<const double> y) {
  const auto [left, right] = std::minmax_element(x.begin(), x.end());
  const auto [lower, upper] = std::minmax_element(y.begin(), y.end());
  const double width = *right - *left, height = *upper - *lower;
  if (!(width > 0) || !(height > 0)) return {};
  const std::size_t stride = (x.size() + most_points - 1) / most_points;
  std::vector<Point> points;
  const auto near = [](Point a, Point b) { return std::hypot(a.x - b.x, a.y - b.y) < coincident; };
  for (std::size_t i = 0; i < x.size(); i += stride) {
    const Point point{(x[i] - *left) / width, (y[i] - *lower) / height};
    if (points.empty() || !near(points.back(), point)) points.push_back(point);
  }
  while (points.size() > 1 && near(points.front(), points.back())) points.pop_back();
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].x += perturbation * scatter(2 * i);
    points[i].y += perturbation * scatter(2 * i + 1);
  }
  return points;
}

/// Area of the convex hull, by Andrew's monotone chain.
double hull_area(std::vector<Point> points) {
  std::sort(points.begin(), points.end(),
            [](Point a, Point b) { return std::pair(a.x, a.y) < std::pair(b.x, b.y); });
  std::vector<Point> hull;
  for (const bool lower : {true, false}) {
    const std::size_t base = hull.size();
    for (const Point point : points) {
      while (hull.size() >= base + 2 && turn(hull[hull.size() - 2], hull.back(), point) <= 0) hull.pop_back();
      hull.push_back(point);
    }
    hull.pop_back();
    if (lower) std::reverse(points.begin(), points.end());
  }
  double area = 0;
  for (std::size_t i = 0; i < hull.size(); ++i) area += cross(hull[i], hull[(i + 1) % hull.size()]) / 2;
  return area;
}

/// A passage of the curve through a crossing: where along the curve, and the area swept about the origin from
/// the curve's start up to there.
struct Passage {
  double at, swept;
  int crossing;
};

/// The two passages of each crossing, in the order of the curve.
std::vector<Passage> passages_of(const std::vector<Point>& points, std::span<const double> swept) {
  std::vector<Passage> passages;
  int crossings = 0;
  const std::size_t n = points.size();
  const auto add = [&](std::size_t i, double share, Point begin, Point end) {
    const Point place{begin.x + share * (end.x - begin.x), begin.y + share * (end.y - begin.y)};
    passages.push_back({static_cast<double>(i) + share, swept[i] + cross(begin, place) / 2, crossings});
  };
  for (std::size_t i = 0; i + 2 < n; ++i) {
    const Point a = points[i], b = points[i + 1];
    const auto [left, right] = std::minmax(a.x, b.x);
    const auto [lower, upper] = std::minmax(a.y, b.y);
    for (std::size_t j = i + 2; j < n - (i == 0); ++j) {
      const Point c = points[j], d = points[(j + 1) % n];
      if (std::max(c.x, d.x) < left || std::min(c.x, d.x) > right || std::max(c.y, d.y) < lower ||
          std::min(c.y, d.y) > upper)
        continue;
      const double of_c = turn(a, b, c), of_d = turn(a, b, d), of_a = turn(c, d, a), of_b = turn(c, d, b);
      if ((of_c > 0) == (of_d > 0) || (of_a > 0) == (of_b > 0)) continue;
      add(i, of_a / (of_a - of_b), a, b);
      add(j, of_c / (of_c - of_d), c, d);
      ++crossings;
    }
  }
  std::sort(passages.begin(), passages.end(), [](Passage a, Passage b) { return a.at < b.at; });
  return passages;
}

/// Passages of a crossing that cuts off a lobe of no significance, or of two crossings between which two
/// strands of the curve enclose such a one; nothing where there are none. total: area of the whole curve.
std::optional<std::pair<int, int>> insignificant(const std::vector<Passage>& passages, double total,
                                                 double least) {
  const std::size_t n = passages.size();
  // Area swept from passage i to the one after it.
  const auto from = [&](std::size_t i) {
    const std::size_t next = (i + 1) % n;
    return passages[next].swept - passages[i].swept + (next == 0 ? total : 0);
  };
  for (std::size_t i = 0; i < n; ++i)
    if (passages[i].crossing == passages[(i + 1) % n].crossing && std::abs(from(i)) < least)
      return std::pair(passages[i].crossing, passages[i].crossing);
  for (std::size_t i = 0; i < n; ++i) {
    const int first = passages[i].crossing, second = passages[(i + 1) % n].crossing;
    if (first == second) continue;
    for (std::size_t j = i + 1; j < n; ++j) {
      const int third = passages[j].crossing, fourth = passages[(j + 1) % n].crossing;
      const bool along = third == first && fourth == second, against = third == second && fourth == first;
      if (!along && !against) continue;
      if (std::abs(along ? from(i) - from(j) : from(i) + from(j)) < least) return std::pair(first, second);
    }
  }
  return {};
}

}  // namespace

LoopCrossings loop_crossings(std::span<const double> x, std::span<const double> y) {
  const std::vector<Point> points = scaled(x, y);
  if (points.size() < 4) return {};
  std::vector<double> swept(points.size() + 1, 0);
  for (std::size_t i = 0; i < points.size(); ++i)
    swept[i + 1] = swept[i] + cross(points[i], points[(i + 1) % points.size()]) / 2;
  const double least = significant * hull_area(points), total = swept.back();
  if (!(least > perturbation)) return {};  // a line
  std::vector<Passage> passages = passages_of(points, swept);
  while (const auto pair = insignificant(passages, total, least))
    std::erase_if(passages,
                  [&](Passage p) { return p.crossing == pair->first || p.crossing == pair->second; });
  LoopCrossings result;
  result.count = static_cast<int>(passages.size() / 2);
  if (result.count != 1) return result;
  const double lobe = passages[1].swept - passages[0].swept;
  result.figure_of_eight = lobe * (total - lobe) < 0;
  return result;
}

}  // namespace cohort
