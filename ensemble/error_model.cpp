#include "ensemble/error_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace cohort {
namespace {

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

double mean_of(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double rms_of(std::span<const double> values) {
  return std::sqrt(std::inner_product(values.begin(), values.end(), values.begin(), 0.0) /
                   static_cast<double>(values.size()));
}

/// A symmetric positive definite matrix as L L^T, row-major.
class Cholesky {
 public:
  Cholesky(std::vector<double> matrix, std::size_t size) : l_(std::move(matrix)), size_(size) {
    for (std::size_t i = 0; i < size_; ++i)
      for (std::size_t j = 0; j <= i; ++j) {
        double sum = l_[i * size_ + j];
        for (std::size_t k = 0; k < j; ++k) sum -= l_[i * size_ + k] * l_[j * size_ + k];
        l_[i * size_ + j] = i == j ? std::sqrt(sum) : sum / l_[j * size_ + j];
      }
  }

  /// L^-1 x
  std::vector<double> forward(std::span<const double> x) const {
    std::vector<double> y(x.begin(), x.end());
    for (std::size_t i = 0; i < size_; ++i) {
      for (std::size_t k = 0; k < i; ++k) y[i] -= l_[i * size_ + k] * y[k];
      y[i] /= l_[i * size_ + i];
    }
    return y;
  }

  /// (L L^T)^-1 x
  std::vector<double> solve(std::span<const double> x) const {
    auto y = forward(x);
    for (std::size_t i = size_; i-- > 0;) {
      for (std::size_t k = i + 1; k < size_; ++k) y[i] -= l_[k * size_ + i] * y[k];
      y[i] /= l_[i * size_ + i];
    }
    return y;
  }

 private:
  std::vector<double> l_;
  std::size_t size_;
};

struct Plane {
  std::vector<double> slopes, left_out;
};

/// Ridge regression of `errors` on `points`, both less their means, which no ridge holds back. What each
/// point is missed by where the others tell it is its residual over 1 - its leverage, exactly.
Plane fit(std::span<const double> points, std::size_t width, std::span<const double> errors, double ridge) {
  const std::size_t count = errors.size();
  std::vector<double> gram(width * width, 0), moments(width, 0);
  const auto point = [&](std::size_t i) { return points.subspan(i * width, width); };
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < width; ++j) {
      moments[j] += point(i)[j] * errors[i];
      for (std::size_t k = 0; k <= j; ++k) gram[j * width + k] += point(i)[j] * point(i)[k];
    }
  for (std::size_t j = 0; j < width; ++j) gram[j * width + j] += ridge * static_cast<double>(count);
  const Cholesky factors(std::move(gram), width);
  Plane plane{factors.solve(moments), {}};
  for (std::size_t i = 0; i < count; ++i) {
    const auto scaled = factors.forward(point(i));
    const double leverage = 1 / static_cast<double>(count) +
                            std::inner_product(scaled.begin(), scaled.end(), scaled.begin(), 0.0);
    const double residual =
        errors[i] - std::inner_product(plane.slopes.begin(), plane.slopes.end(), point(i).begin(), 0.0);
    plane.left_out.push_back(residual / (1 - leverage));
  }
  return plane;
}

/// Whether the squares of `better` are below those of `plain` by more than chance.
bool is_gain(std::span<const double> better, std::span<const double> plain) {
  constexpr double least_share = 0.2, least_standard_errors = 1.5;
  const auto count = static_cast<double>(plain.size());
  std::vector<double> gain;
  for (std::size_t i = 0; i < plain.size(); ++i) gain.push_back(plain[i] * plain[i] - better[i] * better[i]);
  const double mean = mean_of(gain), plain_rms = rms_of(plain);
  double spread = 0;
  for (const double value : gain) spread += (value - mean) * (value - mean);
  return mean > least_share * plain_rms * plain_rms &&
         mean > least_standard_errors * std::sqrt(spread / (count - 1) / count);
}

}  // namespace

double error_of(double coarse, double fine, double order) {
  const double ratio = std::exp2(order);
  return (coarse - fine) * ratio / (ratio - 1);
}

ErrorModel::ErrorModel(std::span<const double> points, std::size_t parameters, std::span<const double> errors)
    : mean_(NaN), lowest_(NaN), highest_(NaN), left_out_rms_(NaN), left_out_rms_constant_(NaN) {
  const std::size_t count = errors.size();
  if (count < 2) return;
  kind_ = ErrorModelKind::constant;
  mean_ = mean_of(errors);
  const auto [low, high] = std::minmax_element(errors.begin(), errors.end());
  constexpr double margin = 0.25;
  lowest_ = *low - margin * (*high - *low);
  highest_ = *high + margin * (*high - *low);
  std::vector<double> centred, left_out;
  for (const double error : errors) {
    centred.push_back(error - mean_);
    left_out.push_back(centred.back() * static_cast<double>(count) / static_cast<double>(count - 1));
  }
  left_out_rms_ = left_out_rms_constant_ = rms_of(left_out);
  if (parameters == 0 || count < std::max<std::size_t>(10, 2 * parameters + 2)) return;

  centre_.assign(parameters, 0);
  for (std::size_t i = 0; i < points.size(); ++i)
    centre_[i % parameters] += points[i] / static_cast<double>(count);
  std::vector<double> places(points.begin(), points.end());
  for (std::size_t i = 0; i < places.size(); ++i) places[i] -= centre_[i % parameters];
  // In units of a coordinate's variance, which is 1/12 for points all over the cube and 1/4 at its corners.
  constexpr std::array ridges{0.0005, 0.01, 0.2};
  for (const double ridge : ridges) {
    Plane plane = fit(places, parameters, centred, ridge);
    const double rms = rms_of(plane.left_out);
    if (!(rms < left_out_rms_) || !is_gain(plane.left_out, left_out)) continue;
    kind_ = ErrorModelKind::linear;
    left_out_rms_ = rms;
    slopes_ = std::move(plane.slopes);
  }
}

double ErrorModel::at(std::span<const double> point) const {
  double error = mean_;
  for (std::size_t i = 0; i < slopes_.size(); ++i) error += slopes_[i] * (point[i] - centre_[i]);
  return kind_ == ErrorModelKind::none ? NaN : std::clamp(error, lowest_, highest_);
}

}  // namespace cohort
