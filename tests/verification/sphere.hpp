#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include "solver/torso.hpp"

/// Exact lead fields of an insulated homogeneous sphere, and the scene that has it as its torso.
namespace cohort::sphere {

inline constexpr double radius_mm = 100;

inline double dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Neumann function of the sphere for a unit current at e on its surface, sigma = 1, up to a function of x
/// that is the same for every e: (2/d + ln(2 R^2 / (R^2 - x.e + R d)) / R) / (4 pi), d = |x - e|. Its
/// gradient along a dipole gives the surface potential of Wilson & Bayley, Circulation 1, 84 (1950), and
/// Frank, J. Appl. Phys. 23, 1225 (1952).
inline double neumann(const Point& x, const Point& e) {
  const double R = radius_mm;
  const double d = std::sqrt(dot(x, x) - 2 * dot(x, e) + R * R);
  return (2 / d + std::log(2 * R * R / (R * R - dot(x, e) + R * d)) / R) / (4 * std::numbers::pi);
}

/// The same by its Legendre series, sum_{n>=1} (2n+1)/n r^n/R^(n+1) P_n(cos gamma) / (4 pi): no constant.
inline double neumann_series(const Point& x, const Point& e) {
  const double R = radius_mm, r = std::sqrt(dot(x, x)), cosine = dot(x, e) / (r * R);
  double sum = 0, power = 1 / R, before = 1, legendre = cosine;
  for (int n = 1; n < 400; ++n) {
    power *= r / R;
    sum += (2.0 * n + 1) / n * power * legendre;
    const double next = ((2.0 * n + 1) * cosine * legendre - n * before) / (n + 1);
    before = legendre;
    legendre = next;
  }
  return sum / (4 * std::numbers::pi);
}

/// p . grad f at x, by fourth-order differences.
template <typename Function>
double along(const Function& f, const Point& x, const Point& p) {
  const auto at = [&](double s) { return f(Point{x[0] + s * p[0], x[1] + s * p[1], x[2] + s * p[2]}); };
  const double h = 0.05;
  return (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
}

/// A scene whose torso is the sphere, with nine electrodes spread over its surface.
inline Scene scene(double dx_mm, Precision precision = Precision::single_) {
  Scene result;
  result.torso = TorsoKind::ellipsoid;
  result.precision = precision;
  declare_torso(result.parameters, result.torso);
  const auto set = [&](const std::string& path, double value) {
    result.parameters[result.parameters.index("torso." + path)].value = value;
  };
  set("dx_mm", dx_mm);
  set("half_width_mm", radius_mm);
  set("half_depth_mm", radius_mm);
  set("lower_mm", -radius_mm);
  set("upper_mm", radius_mm);
  set("conductivity_mS_per_mm", 0.25);
  for (std::size_t e = 0; e < electrode_names.size(); ++e) {  // a spiral: no two share a coordinate
    const double z = 1 - (2 * static_cast<double>(e) + 1) / 9.0, angle = 2.4 * static_cast<double>(e) + 0.3;
    const std::string path = "electrodes." + std::string(electrode_names[e]) + "_mm.";
    set(path + "x", radius_mm * std::sqrt(1 - z * z) * std::cos(angle));
    set(path + "y", radius_mm * std::sqrt(1 - z * z) * std::sin(angle));
    set(path + "z", radius_mm * z);
  }
  return result;
}

}  // namespace cohort::sphere
