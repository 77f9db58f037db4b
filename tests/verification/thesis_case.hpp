#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <memory>
#include <numbers>

#include "solver/operators.hpp"
#include "tests/verification/lead_samples.hpp"

namespace cohort::test {

using Vector = std::array<double, 3>;

inline Device& device() {
  static std::unique_ptr<Device> first = [] {
    const std::vector<DeviceInfo> all = devices();
    if (all.empty()) throw std::runtime_error("no OpenCL device");
    return std::make_unique<Device>(all.front());
  }();
  return *first;
}

/// The function of the thesis's chapter 6 and its exact derivatives, at x.
struct Exact {
  static Vector u(const Vector& p) {
    return {std::sin(p[0]) * std::cos(p[1]), std::cos(p[1]) * std::exp(p[2]), std::atan(p[2])};
  }
  static std::array<double, 9> gradient(const Vector& p) {
    const double sx = std::sin(p[0]), cx = std::cos(p[0]), sy = std::sin(p[1]), cy = std::cos(p[1]),
                 e = std::exp(p[2]);
    return {cx * cy, -sx * sy, 0, 0, -sy * e, cy * e, 0, 0, 1 / (1 + p[2] * p[2])};
  }
  static std::array<double, 1> divergence(const Vector& p) {
    return {std::cos(p[0]) * std::cos(p[1]) - std::sin(p[1]) * std::exp(p[2]) + 1 / (1 + p[2] * p[2])};
  }
  static Vector laplacian(const Vector& p) {
    const double q = 1 / (1 + p[2] * p[2]);
    return {-2 * std::sin(p[0]) * std::cos(p[1]), 0, -2 * p[2] * q * q};
  }
};

/// The domain [-1, 1]^3 of the thesis in n cells an edge, in its reference or its deformed configuration, and
/// so many layers of points around it: without them the Laplacian would leave out the domain's rim, a part of
/// it that goes with dx, and the norm with it.
struct ThesisGrid {
  int n;
  bool deformed;
  int layers = 0;
  double dx = 2.0 / n;
  Lattice lattice = {{n + 1 + 2 * layers, n + 1 + 2 * layers, n + 1 + 2 * layers}, dx};

  static Vector phi(const Vector& X) {
    using std::numbers::pi;
    return {X[0] + std::cos(pi * X[2]), X[1] + std::sin(pi * X[2]), X[2] + std::sin(X[2])};
  }
  Vector moved(const Vector& X) const { return deformed ? phi(X) : X; }
  /// det F; positive, and z + sin z is monotone: phi is injective.
  double J(const Vector& X) const { return deformed ? 1 + std::cos(X[2]) : 1; }
  static Vector place(const Lattice& points, double dx, std::size_t i) {
    const auto nx = static_cast<std::size_t>(points.points[0]),
               ny = static_cast<std::size_t>(points.points[1]);
    const double first = -0.5 * dx * (points.points[0] - 1);
    return {first + dx * static_cast<double>(i % nx), first + dx * static_cast<double>(i / nx % ny),
            first + dx * static_cast<double>(i / nx / ny)};
  }
  /// value(x)[c] for all points of a lattice centred at the origin: (components, points).
  template <typename F>
  std::vector<double> sample(const Lattice& points, std::size_t components, const F& value) const {
    std::vector<double> result(components * points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto numbers = value(moved(place(points, dx, i)));
      for (std::size_t c = 0; c < components; ++c) result[c * points.size() + i] = numbers[c];
    }
    return result;
  }
  std::vector<double> u() const { return sample(lattice, 3, Exact::u); }
  std::vector<double> positions() const {
    return sample(lattice, 3, [](const Vector& x) { return x; });
  }
  std::vector<double> coordinates(Coordinates kind) const {
    std::vector<double> result = positions();
    if (kind == Coordinates::displacement)
      for (std::size_t i = 0; i < lattice.size(); ++i) {
        const Vector X = place(lattice, dx, i);
        for (std::size_t c = 0; c < 3; ++c) result[c * lattice.size() + i] -= X[c];
      }
    return result;
  }
  /// L2 norm of the error over the domain, sqrt(sum J dx^3 |e|^2); points on its surface count half.
  template <typename F>
  double error(const Lattice& points, const std::vector<double>& numbers, std::size_t components,
               const F& exact) const {
    double sum = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vector X = place(points, dx, i);
      double weight = J(X);
      for (const double c : X) weight *= std::clamp((1 - std::abs(c)) / dx + 0.5, 0.0, 1.0);
      if (weight < 1e-6) continue;
      const auto expected = exact(moved(X));
      for (std::size_t c = 0; c < components; ++c)
        sum += weight * std::pow(numbers[c * points.size() + i] - expected[c], 2);
    }
    return std::sqrt(sum * dx * dx * dx);
  }
};

/// The operators with uploads and downloads around them.
struct Runner {
  Precision precision;
  Launcher launcher;
  Operators operators;

  Runner(Precision p, Coordinates coordinates, int members = 1)
      : precision(p), launcher(device(), p), operators(launcher, p, coordinates, members) {}
  bool is_double() const { return precision == Precision::double_; }
  cl::Buffer up(const std::vector<double>& numbers) const { return upload(device(), numbers, is_double()); }
  cl::Buffer room(std::size_t count) const { return up(std::vector<double>(count, 0.0)); }
  std::vector<double> down(const cl::Buffer& buffer, std::size_t count) const {
    return download(device(), buffer, count, is_double());
  }

  std::vector<double> interpolate(const Lattice& l, const std::vector<double>& u, int components) {
    const std::size_t count = l.centres().size() * static_cast<std::size_t>(components);
    const cl::Buffer result = room(count);
    operators.interpolate(l, up(u), components, result);
    return down(result, count);
  }
  std::vector<double> gradient(const Lattice& l, const std::vector<double>& x, const std::vector<double>& u,
                               int components) {
    const std::size_t count = l.centres().size() * 3 * static_cast<std::size_t>(components);
    const cl::Buffer result = room(count);
    operators.gradient(l, up(x), up(u), components, result);
    return down(result, count);
  }
  std::vector<double> divergence(const Lattice& l, const std::vector<double>& x, const std::vector<double>& u,
                                 int rows) {
    const std::size_t count = l.centres().size() * static_cast<std::size_t>(rows);
    const cl::Buffer result = room(count);
    operators.divergence(l, up(x), up(u), rows, result);
    return down(result, count);
  }
  std::vector<double> laplacian(const Lattice& l, const std::vector<double>& x, const std::vector<double>& u,
                                int components, bool at_vertex = false) {
    const std::size_t count = l.size() * static_cast<std::size_t>(components);
    const cl::Buffer result = room(count);
    if (at_vertex)
      operators.laplacian_at_vertex(l, up(x), up(u), components, result);
    else
      operators.laplacian(l, up(x), up(u), components, result);
    return down(result, count);
  }
  /// The steps of the thesis one after another: gradient to the centres, divergence back. On the inner
  /// points.
  std::vector<double> laplacian_in_steps(const Lattice& l, const std::vector<double>& x,
                                         const std::vector<double>& u, int components) {
    return divergence(l.centres(), interpolate(l, x, 3), gradient(l, x, u, components), components);
  }
};

inline const char* name(Precision precision) {
  return precision == Precision::double_ ? "double" : "single";
}
inline const char* name(Coordinates kind) {
  return kind == Coordinates::reference  ? "none"
         : kind == Coordinates::position ? "position"
                                         : "displacement";
}

inline double order(double coarse, double fine) {
  return std::log2(coarse / fine);
}

/// Largest n of the studies: more than `usual` where the environment variable COHORT_STUDY_FINEST asks for
/// it.
inline int finest(int usual) {
  const char* asked = std::getenv("COHORT_STUDY_FINEST");
  return asked ? std::max(usual, std::atoi(asked)) : usual;
}

/// Adds a row to the file that the environment variable COHORT_STUDY names, for analysis/convergence.py.
inline void note(const std::string& row) {
  if (const char* path = std::getenv("COHORT_STUDY")) std::ofstream(path, std::ios::app) << row << '\n';
}

}  // namespace cohort::test
