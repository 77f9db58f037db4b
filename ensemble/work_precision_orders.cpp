#include "ensemble/work_precision_orders.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace cohort {

namespace {

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();
constexpr double same_factor = 1e-9;  ///< decimal steps have no exact ratios

bool same(double a, double b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

/// The reference's step as a share of the fine one's; nothing where it is not below 1, not known, or another
/// in each of the steps.
std::optional<double> reference_share(const std::vector<std::string>& paths, const ResolvedSetting& fine,
                                      const SettingRun* reference) {
  if (!reference) return 0;
  std::optional<double> share;
  for (const std::string& path : paths) {
    const auto there = reference->resolved.values.find(path);
    if (there == reference->resolved.values.end()) return {};
    const double own = there->second / fine.values.at(path);
    if (!(own > 0 && own < 1)) return {};
    if (share && std::abs(own / *share - 1) > same_factor) return {};
    share = own;
  }
  return share;
}

}  // namespace

std::optional<Coarsening> coarsening(const ResolvedSetting& coarse, const ResolvedSetting& fine) {
  if (coarse.rest != fine.rest || coarse.precision != fine.precision) return {};
  Coarsening result;
  for (const auto& [path, h] : coarse.values) {
    const auto there = fine.values.find(path);
    if (there == fine.values.end()) return {};
    if (same(h, there->second)) continue;
    if (!is_step(path) || !(h > there->second) || !(there->second > 0)) return {};
    const double factor = h / there->second;
    if (!result.paths.empty() && std::abs(factor / result.factor - 1) > same_factor) return {};
    result.factor = factor;
    result.paths.push_back(path);
  }
  return result.paths.empty() ? std::nullopt : std::optional(result);
}

double observed_order(double coarse_error, double fine_error, double coarse_h, double fine_h,
                      double reference_h) {
  const double ratio = coarse_error / fine_error;
  const auto excess = [&](double p) {
    const double own = reference_h > 0 ? std::pow(reference_h, p) : 0;
    return (std::pow(coarse_h, p) - own) / (std::pow(fine_h, p) - own) - ratio;
  };
  double low = 1e-3, high = 8;
  if (!(excess(low) < 0) || !(excess(high) > 0)) return NaN;
  constexpr int bisections = 60;
  for (int k = 0; k < bisections; ++k) (excess((low + high) / 2) < 0 ? low : high) = (low + high) / 2;
  return (low + high) / 2;
}

std::vector<ObservedOrder> observed_orders(const std::vector<SettingRun>& runs, const SettingRun* reference,
                                           const std::vector<MeasureErrors>& errors) {
  std::vector<ObservedOrder> result;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    std::map<std::vector<std::string>, std::pair<double, std::size_t>> next;  // factor and setting, by paths
    for (std::size_t j = 0; j < runs.size(); ++j) {
      const auto apart = coarsening(runs[i].resolved, runs[j].resolved);
      if (!apart) continue;
      const auto [it, is_new] = next.try_emplace(apart->paths, apart->factor, j);
      if (!is_new && apart->factor < it->second.first) it->second = {apart->factor, j};
    }
    for (const auto& [paths, finer] : next) {
      const std::size_t j = finer.second;
      const auto share = reference_share(paths, runs[j].resolved, reference);
      if (!share) continue;
      const double coarse = runs[i].resolved.values.at(paths.front());
      const double fine = runs[j].resolved.values.at(paths.front());
      for (std::size_t m = 0; m < errors.size(); ++m)
        result.push_back({fmt::format("{}", fmt::join(paths, ", ")), i, j, coarse, fine, m,
                          observed_order(errors[m].rms(i), errors[m].rms(j), coarse, fine, *share * fine)});
    }
  }
  return result;
}

std::vector<RoundingShare> rounding_shares(const std::vector<SettingRun>& runs,
                                           const std::vector<MeasureErrors>& errors) {
  std::vector<std::string> names;
  for (const MeasureErrors& error : errors) names.push_back(error.name);
  const auto twins = [](const ResolvedSetting& single, const ResolvedSetting& twin) {
    if (single.precision != Precision::single_ || twin.precision != Precision::double_) return false;
    return single.rest == twin.rest &&
           std::equal(
               single.values.begin(), single.values.end(), twin.values.begin(), twin.values.end(),
               [](const auto& a, const auto& b) { return a.first == b.first && same(a.second, b.second); });
  };
  std::vector<RoundingShare> result;
  for (std::size_t i = 0; i < runs.size(); ++i)
    for (std::size_t j = 0; j < runs.size(); ++j) {
      if (!twins(runs[i].resolved, runs[j].resolved)) continue;
      if (!runs[i].outcome.empty() || !runs[j].outcome.empty()) continue;
      const std::vector<MeasureErrors> apart = measure_errors(names, {runs[i]}, &runs[j], {});
      for (std::size_t m = 0; m < errors.size(); ++m)
        result.push_back({i, j, m, apart[m].rms(0), apart[m].rms(0) / errors[m].rms(i)});
    }
  return result;
}

}  // namespace cohort
