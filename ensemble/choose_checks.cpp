#include "ensemble/choose_checks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace cohort {
namespace {

constexpr double middle = 0.5;

double squared_distance(std::span<const double> a, std::span<const double> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

/// Appends `count` of the members `first` to `end` - 1.
void choose_among(const std::vector<double>& points, std::size_t width, std::int64_t first, std::int64_t end,
                  std::int64_t count, std::vector<std::int64_t>& chosen) {
  const auto place = [&](std::int64_t member) {
    return std::span(points).subspan(static_cast<std::size_t>(member) * width, width);
  };
  const std::vector<double> centre(width, middle);
  std::int64_t next = first;
  for (std::int64_t member = first; member < end; ++member)
    if (squared_distance(place(member), centre) < squared_distance(place(next), centre)) next = member;

  constexpr double taken = -1;
  std::vector<double> nearest(static_cast<std::size_t>(end - first), std::numeric_limits<double>::infinity());
  for (std::int64_t i = 0; i < count; ++i) {
    chosen.push_back(next);
    nearest[static_cast<std::size_t>(next - first)] = taken;
    const auto here = place(next);
    for (std::int64_t member = first; member < end; ++member) {
      double& distance = nearest[static_cast<std::size_t>(member - first)];
      if (distance != taken) distance = std::min(distance, squared_distance(place(member), here));
    }
    next = first + (std::max_element(nearest.begin(), nearest.end()) - nearest.begin());
  }
}

}  // namespace

std::int64_t check_count(const Campaign& campaign) {
  // A product like 0.07 * 50 is a half but for its rounding.
  constexpr double rounding = 1e-9;
  // Two have no spread, and one tells nothing of the others.
  constexpr std::int64_t least = 3;
  const double share = campaign.check_fraction * static_cast<double>(campaign.members);
  const auto count =
      std::min(campaign.members, static_cast<std::int64_t>(std::floor(share + 0.5 + rounding)));
  return count > 0 ? std::min(campaign.members, std::max(count, least)) : 0;
}

std::vector<double> unit_points(const Samples& samples, std::int64_t members) {
  const std::size_t width = samples.paths.size(), rows = static_cast<std::size_t>(members);
  std::vector<double> points(samples.unit);
  for (std::size_t i = 0; i < width; ++i) {
    if (rows == 0 || !std::isnan(samples.unit[i])) continue;
    double low = samples.physical[i], high = low;
    for (std::size_t row = 0; row < rows; ++row) {
      low = std::min(low, samples.physical[row * width + i]);
      high = std::max(high, samples.physical[row * width + i]);
    }
    for (std::size_t row = 0; row < rows; ++row)
      points[row * width + i] = high > low ? (samples.physical[row * width + i] - low) / (high - low) : 0;
  }
  return points;
}

std::vector<std::int64_t> choose_checks(const Samples& samples, std::int64_t members, std::int64_t count) {
  if (count <= 0) return {};
  const std::vector<double> points = unit_points(samples, members);
  constexpr std::int64_t most_of_a_run = 256;
  const std::int64_t runs = (count + most_of_a_run - 1) / most_of_a_run;
  std::vector<std::int64_t> chosen;
  // Rounded apart, so that no run has fewer members than checks.
  const auto checks_before = [&](std::int64_t run) { return count * run / runs; };
  const auto members_before = [&](std::int64_t run) {
    return checks_before(run) + (members - count) * run / runs;
  };
  for (std::int64_t run = 0; run < runs; ++run)
    choose_among(points, samples.paths.size(), members_before(run), members_before(run + 1),
                 checks_before(run + 1) - checks_before(run), chosen);
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

}  // namespace cohort
