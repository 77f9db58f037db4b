#include "solver/beats.hpp"

#include <algorithm>

namespace cohort {

std::vector<Beat> beats(std::span<const float> potential, double interval_ms, double threshold_mV) {
  constexpr double share_left = 0.1;  // of the amplitude, at 90 % repolarisation
  std::vector<Beat> result;
  if (potential.empty()) return result;
  double foot = potential[0], peak = 0;
  bool repolarising = false;
  for (std::size_t k = 1; k < potential.size(); ++k) {
    const double before = potential[k - 1], now = potential[k];
    const auto crossing = [&](double level) {
      return interval_ms * (static_cast<double>(k) - 1 + (level - before) / (now - before));
    };
    if (before < threshold_mV && now >= threshold_mV) {
      result.push_back({crossing(threshold_mV)});
      peak = now;
      repolarising = true;
    } else if (!repolarising) {
      foot = std::min(foot, now);
    } else {
      peak = std::max(peak, now);
      const double level = foot + share_left * (peak - foot);
      if (before > level && now <= level) {
        result.back().repolarisation_ms = crossing(level);
        repolarising = false;
        foot = now;
      }
    }
  }
  return result;
}

}  // namespace cohort
