#include "ensemble/tolerance.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace cohort {

namespace {

/// P(chi^2 > x). M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions (1964), 26.4.4 and 26.4.5.
double chi_square_above(int freedom, double x) {
  const bool odd = freedom % 2 == 1;
  const double h = x / 2;
  double sum = odd ? std::erfc(std::sqrt(h)) : 0;
  for (double a = odd ? 0.5 : 0; a < freedom / 2.0 - 0.5; ++a)
    sum += std::exp(a * std::log(h) - h - std::lgamma(a + 1));
  return sum;
}

/// Root of a function that rises through 0 between two places.
template <typename Function>
double root(double low, double high, const Function& function) {
  constexpr int halvings = 50;
  for (int i = 0; i < halvings; ++i) (function((low + high) / 2) < 0 ? low : high) = (low + high) / 2;
  return (low + high) / 2;
}

double normal_between(double a, double b) {
  return 0.5 * (std::erfc(a / std::numbers::sqrt2) - std::erfc(b / std::numbers::sqrt2));
}

}  // namespace

double tolerance_factor(int n, double content, double confidence) {
  // By the trapezoidal rule in t = x sqrt(n): for a smooth even function that decays like exp(-t^2 / 2) it is
  // as good as exact.
  constexpr int intervals = 64;
  constexpr double end = 8;
  std::array<double, intervals> r{};
  for (int i = 0; i < intervals; ++i) {
    const double x = end * i / intervals / std::sqrt(n);
    r[static_cast<std::size_t>(i)] =
        root(0, x + end, [&](double half) { return normal_between(x - half, x + half) - content; });
  }
  const auto reached = [&](double k) {
    double sum = 0;
    for (int i = 0; i < intervals; ++i) {
      const double t = end * i / intervals, ratio = r[static_cast<std::size_t>(i)] / k;
      sum += (i == 0 ? 0.5 : 1) * chi_square_above(n - 1, (n - 1) * ratio * ratio) * std::exp(-t * t / 2);
    }
    return sum * end / intervals * std::sqrt(2 / std::numbers::pi);
  };
  double high = 2;
  while (reached(high) < confidence) high *= 2;
  return root(0, high, [&](double k) { return reached(k) - confidence; });
}

}  // namespace cohort
