#include "solver/ecg_features.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace cohort {

namespace {

constexpr size_t leads = 12, first_chest = 6;
constexpr std::array<size_t, 8> independent = {0, 1, 6, 7, 8, 9, 10, 11};
constexpr std::array<const char*, leads> lead_names = {"I",  "II", "III", "aVR", "aVL", "aVF",
                                                       "V1", "V2", "V3",  "V4",  "V5",  "V6"};
constexpr double qrs_threshold = 0.005, p_threshold = 0.001;  // mV/ms
constexpr double smallest_noise_mV = 0.001;                   // below it nothing is smoothed
constexpr double smoothing_ms = 2.5;
constexpr double noisy_slope_ms = 10;  // reach of the fit of the slope of T, with noise
constexpr double quiet_ms = 8;         // a wave has ended where nothing exceeds the threshold for so long
constexpr double between_ms = 10;      // from the end of P to QRS, and from QRS to the search for T, at least
constexpr double smallest_T_mV = 0.05;
constexpr double nothing = std::numeric_limits<double>::quiet_NaN();
constexpr double later = std::numeric_limits<double>::infinity();  // than the series ends

using Series = std::vector<double>;

double median(Series values) {
  if (values.empty()) return nothing;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Standard deviation of white noise, from the median of |second differences|, which waves hardly touch.
double noise_of(const Series& x) {
  Series differences;
  for (size_t k = 1; k + 1 < x.size(); ++k) differences.push_back(std::abs(x[k - 1] - 2 * x[k] + x[k + 1]));
  constexpr double median_of_normal = 0.6745;
  return median(differences) / (median_of_normal * std::sqrt(6.0));
}

Series smooth(const Series& x, double deviation) {
  const auto reach = static_cast<std::ptrdiff_t>(std::ceil(4 * deviation));
  const auto n = static_cast<std::ptrdiff_t>(x.size());
  Series result(x.size());
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    double sum = 0, weights = 0;
    for (std::ptrdiff_t j = std::max<std::ptrdiff_t>(k - reach, 0); j <= std::min(k + reach, n - 1); ++j) {
      const double weight = std::exp(-0.5 * std::pow(static_cast<double>(j - k) / deviation, 2));
      sum += weight * x[static_cast<size_t>(j)];
      weights += weight;
    }
    result[static_cast<size_t>(k)] = sum / weights;
  }
  return result;
}

/// A stretch of samples, with the fractions where the velocity crosses the threshold.
struct Wave {
  double onset = nothing, offset = nothing;  // samples
  bool found() const { return !std::isnan(onset) && !std::isnan(offset); }
};

/// From `peak` outwards to where `velocity` stays below the threshold for `quiet` samples; no end where the
/// series ends before that, while tissue has been at rest before the series begins. Nothing outside [first,
/// last) is looked at; a wave goes no further.
Wave about_peak(const Series& velocity, size_t peak, size_t first, size_t last, double threshold,
                size_t quiet) {
  Wave wave;
  const auto crossing = [&](size_t above, size_t below) {
    const double from = velocity[above], to = velocity[below];
    return static_cast<double>(above) +
           (from - threshold) / (from - to) * (static_cast<double>(below) - static_cast<double>(above));
  };
  size_t edge = peak, below = 0;
  for (size_t k = peak; k-- > first && below < quiet;) {
    if (velocity[k] >= threshold) {
      edge = k;
      below = 0;
    } else {
      ++below;
    }
  }
  if (below > 0) wave.onset = crossing(edge, edge - 1);
  edge = peak;
  below = 0;
  for (size_t k = peak + 1; k < last && below < quiet; ++k) {
    if (velocity[k] >= threshold) {
      edge = k;
      below = 0;
    } else {
      ++below;
    }
  }
  const bool to_the_end = last == velocity.size();
  if (below >= (to_the_end ? quiet : 1)) wave.offset = crossing(edge, edge + 1);
  return wave;
}

/// Direction in the frontal plane of (I, aVF), of which aVF is shorter by sqrt(3)/2.
double axis_deg(double I, double aVF) {
  if (std::hypot(I, aVF) < 1e-12) return nothing;
  return std::atan2(2 / std::numbers::sqrt3 * aVF, I) * 180 / std::numbers::pi;
}

/// One beat under measurement.
struct Measured {
  std::array<Series, leads> lead;
  Series velocity;  // mV/ms
  double interval;
  size_t samples;
  double noise_velocity = 0;
  size_t slope_reach = 1;  ///< samples to each side from which the slope of T is fitted
  std::array<double, leads> baseline{};

  size_t count(double ms) const {
    return std::max<size_t>(1, static_cast<size_t>(std::lround(ms / interval)));
  }
  double area(size_t l, double from, double to) const {
    double sum = 0;
    for (auto k = static_cast<size_t>(std::ceil(from)); k <= static_cast<size_t>(to); ++k)
      sum += lead[l][k] - baseline[l];
    return sum;
  }
  double axis(const Wave& wave) const {
    if (!wave.found()) return nothing;
    return axis_deg(area(0, wave.onset, wave.offset), area(5, wave.onset, wave.offset));
  }
};

Measured prepare(std::span<const float> ecg, double interval_ms) {
  Measured beat;
  beat.interval = interval_ms;
  beat.samples = ecg.size() / leads;
  for (size_t l = 0; l < leads; ++l) {
    const auto row = ecg.subspan(l * beat.samples, beat.samples);
    beat.lead[l].assign(row.begin(), row.end());
  }
  double noise = 0;
  for (const size_t l : independent) noise = std::max(noise, noise_of(beat.lead[l]));
  if (noise > smallest_noise_mV)
    for (Series& series : beat.lead) series = smooth(series, smoothing_ms / interval_ms);

  beat.velocity.assign(beat.samples, 0);
  for (size_t k = 1; k + 1 < beat.samples; ++k) {
    double sum = 0;
    for (const size_t l : independent)
      sum += std::pow((beat.lead[l][k + 1] - beat.lead[l][k - 1]) / (2 * interval_ms), 2);
    beat.velocity[k] = std::sqrt(sum);
  }
  if (noise > smallest_noise_mV) {
    // The norm of eight equal noises has a mean of about sqrt(8) and a deviation of about 1/sqrt(2) of each;
    // a third of the beat is quiet, so its median lies at the sixth part of the velocities.
    Series sorted = beat.velocity;
    const auto sixth = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 6);
    std::nth_element(sorted.begin(), sixth, sorted.end());
    beat.slope_reach = beat.count(noisy_slope_ms);
    beat.noise_velocity = *sixth * (1 + 4 / (std::sqrt(2.0) * std::sqrt(8.0)));
  }
  return beat;
}

/// Slope at sample k by a linear fit over the samples within `reach`, per sample.
double slope_at(const Series& x, size_t k, size_t reach) {
  double sum = 0, squares = 0;
  for (size_t j = 1; j <= reach; ++j) {
    const auto offset = static_cast<double>(j);
    sum += offset * (x[k + j] - x[k - j]);
    squares += 2 * offset * offset;
  }
  return sum / squares;
}

/// Sample where T ends in one lead, searched for in [first, last); NaN where there is none, infinite where it
/// ends later.
double T_end(const Measured& beat, size_t l, size_t first, size_t last) {
  const Series& x = beat.lead[l];
  size_t peak = first;
  for (size_t k = first; k < last; ++k)
    if (std::abs(x[k] - beat.baseline[l]) > std::abs(x[peak] - beat.baseline[l])) peak = k;
  const double amplitude = x[peak] - beat.baseline[l];
  if (std::abs(amplitude) < smallest_T_mV) return nothing;
  if (peak + 2 >= last) return later;
  size_t steepest = peak;
  double slope = 0;  // towards the baseline, per sample
  const size_t reach = beat.slope_reach;
  for (size_t k = std::max(peak + 1, reach); k + reach < last; ++k) {
    if ((x[k] - beat.baseline[l]) * amplitude <= 0) break;  // past the baseline it is another wave
    const double fall = -slope_at(x, k, reach) * (amplitude > 0 ? 1 : -1);
    if (fall > slope) {
      slope = fall;
      steepest = k;
    }
  }
  if (slope <= 0) return nothing;
  const double end = static_cast<double>(steepest) + std::abs(x[steepest] - beat.baseline[l]) / slope;
  return end < static_cast<double>(last) ? end : later;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> ecg_feature_names() {
  std::vector<std::pair<std::string, std::string>> names;
  for (const char* name : {"P", "PR", "QRS", "QT", "P_onset", "P_offset", "QRS_onset", "QRS_offset", "T_end"})
    names.emplace_back("ecg_" + std::string(name) + "_ms", "ms");
  for (const char* name : {"P", "QRS", "T"})
    names.emplace_back("ecg_" + std::string(name) + "_axis_deg", "deg");
  for (const char* name : {"R", "S"})
    for (size_t l = first_chest; l < leads; ++l)
      names.emplace_back("ecg_" + std::string(name) + "_" + lead_names[l] + "_mV", "mV");
  for (size_t l = first_chest; l < leads; ++l)
    names.emplace_back("ecg_R_peak_" + std::string(lead_names[l]) + "_ms", "ms");
  for (const char* lead : lead_names) names.emplace_back("ecg_T_" + std::string(lead) + "_mV", "mV");
  return names;
}

std::vector<float> ecg_features(std::span<const float> ecg, double interval_ms) {
  std::vector<float> features(ecg_feature_names().size(), std::numeric_limits<float>::quiet_NaN());
  if (ecg.size() < 16 * leads ||
      !std::all_of(ecg.begin(), ecg.end(), [](float x) { return std::isfinite(x); }))
    return features;
  Measured beat = prepare(ecg, interval_ms);
  const size_t quiet = beat.count(quiet_ms), between = beat.count(between_ms);

  const auto peak = static_cast<size_t>(std::max_element(beat.velocity.begin(), beat.velocity.end()) -
                                        beat.velocity.begin());
  const double threshold = std::max(qrs_threshold, beat.noise_velocity);
  if (beat.velocity[peak] < 2 * threshold) return features;
  const Wave qrs = about_peak(beat.velocity, peak, 0, beat.samples, threshold, quiet);
  if (std::isnan(qrs.onset)) return features;
  const auto begin = static_cast<size_t>(qrs.onset);
  const size_t end = qrs.found() ? static_cast<size_t>(std::ceil(qrs.offset)) : beat.samples;
  for (size_t l = 0; l < leads; ++l) beat.baseline[l] = beat.lead[l][begin];

  Wave p;
  if (begin > between + 2) {
    const double least = std::max(p_threshold, beat.noise_velocity);
    const auto before = beat.velocity.begin() + static_cast<std::ptrdiff_t>(begin - between);
    const auto p_peak =
        static_cast<size_t>(std::max_element(beat.velocity.begin(), before) - beat.velocity.begin());
    if (beat.velocity[p_peak] > 2 * least) p = about_peak(beat.velocity, p_peak, 0, begin, least, quiet);
  }

  Wave t;
  Series ends;
  const size_t from = end + between;
  if (from + 2 < beat.samples) {
    for (const size_t l : independent) {
      const double end_here = T_end(beat, l, from, beat.samples);
      if (!std::isnan(end_here)) ends.push_back(end_here);
    }
    // An end later than the series counts as such: a median over the others would come too early.
    if (const double last = median(ends); std::isfinite(last)) t = {static_cast<double>(from), last};
  }

  std::vector<double> values = {p.offset - p.onset,
                                qrs.onset - p.onset,
                                qrs.offset - qrs.onset,
                                t.offset - qrs.onset,
                                p.onset,
                                p.offset,
                                qrs.onset,
                                qrs.offset,
                                t.offset};
  for (double& value : values) value *= interval_ms;
  for (const Wave& wave : {p, qrs, t}) values.push_back(beat.axis(wave));
  Series R, S, R_peak, T;
  for (size_t l = first_chest; l < leads; ++l) {
    if (!qrs.found()) {
      for (Series* part : {&R, &S, &R_peak}) part->push_back(nothing);
      continue;
    }
    const auto first = beat.lead[l].begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last = beat.lead[l].begin() + static_cast<std::ptrdiff_t>(std::min(end + 1, beat.samples));
    const auto [least, most] = std::minmax_element(first, last);
    R.push_back(std::max(*most - beat.baseline[l], 0.0));
    S.push_back(std::min(*least - beat.baseline[l], 0.0));
    R_peak.push_back(R.back() > 0
                         ? (static_cast<double>(most - first) + static_cast<double>(begin) - qrs.onset) *
                               interval_ms
                         : nothing);
  }
  for (size_t l = 0; l < leads; ++l) {
    double largest = t.found() ? 0 : nothing;
    for (size_t k = from; t.found() && k < std::min(static_cast<size_t>(t.offset), beat.samples); ++k)
      if (const double x = beat.lead[l][k] - beat.baseline[l]; std::abs(x) > std::abs(largest)) largest = x;
    T.push_back(largest);
  }
  for (const Series* part : {&R, &S, &R_peak, &T}) values.insert(values.end(), part->begin(), part->end());
  std::transform(values.begin(), values.end(), features.begin(),
                 [](double value) { return static_cast<float>(value); });
  return features;
}

}  // namespace cohort
