// Arrival times of the eikonal equation against exact solutions.
#include "solver/eikonal.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>

#include "tests/slab.hpp"

namespace cohort::test {
namespace {

using Vector = std::array<double, 3>;
constexpr double along = 0.6, across = 0.25;  // mm/ms

double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Vector unit(const Vector& a) {
  const double length = std::sqrt(dot(a, a));
  return {a[0] / length, a[1] / length, a[2] / length};
}

// A slab with an eikonal solver, uniform speeds.
struct Wave {
  Wave(Vector size, double dx, const Vector& fibre, Precision precision = Precision::single_)
      : slab(size, dx, precision, "mitchell_schaeffer",
             {{"geometry.fibres.direction.x", fibre[0]},
              {"geometry.fibres.direction.y", fibre[1]},
              {"geometry.fibres.direction.z", fibre[2]}}),
        eikonal(*slab.launcher, slab.scene, slab.definitions) {
    std::vector<double> both(static_cast<size_t>(slab.tissue->stride), along);
    both.resize(2 * both.size(), across);
    speed = upload(both);
  }
  cl::Buffer upload(const std::vector<double>& field) {
    const cl::Buffer buffer = device().allocate(field.size() * real_bytes(slab.scene.precision));
    slab.write(buffer, field);
    return buffer;
  }
  std::vector<double> arrival() {
    return slab.read(eikonal.arrival(), static_cast<size_t>(slab.tissue->stride));
  }
  int cell_at(const Vector& p) const {
    int result = -1;
    double nearest = 1e9;
    slab.each_cell([&](std::size_t i, const Vector& c) {
      const Vector d = {c[0] - p[0], c[1] - p[1], c[2] - p[2]};
      if (dot(d, d) < nearest) nearest = dot(d, d), result = static_cast<int>(i);
    });
    return result;
  }

  Slab slab;
  Eikonal eikonal;
  cl::Buffer speed;
};

// Time that a straight path d takes.
double flight(const Vector& d, const Vector& f) {
  const double l = dot(d, f);
  return std::sqrt(l * l / (along * along) + std::max(0.0, dot(d, d) - l * l) / (across * across));
}

struct Errors {
  double mean = 0, largest = 0, last = 0;
};

Errors point_source(double dx, const Vector& fibre) {
  Wave wave({60, 40, 20}, dx, fibre);
  const int source = wave.cell_at({20, 20, 10});
  const Vector origin = wave.slab.tissue->centre(static_cast<size_t>(source));
  const Eikonal::Source sources[] = {{source, 0}};
  wave.eikonal.solve(*wave.slab.tissue, wave.speed, nullptr, nullptr, sources);
  const auto start = std::chrono::steady_clock::now();
  wave.eikonal.solve(*wave.slab.tissue, wave.speed, nullptr, nullptr, sources);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::vector<double> T = wave.arrival();
  Errors errors;
  int cells = 0;
  wave.slab.each_cell([&](std::size_t i, const Vector& c) {
    const double exact = flight({c[0] - origin[0], c[1] - origin[1], c[2] - origin[2]}, fibre);
    errors.mean += std::abs(T[i] - exact);
    errors.largest = std::max(errors.largest, std::abs(T[i] - exact));
    errors.last = std::max(errors.last, exact);
    ++cells;
  });
  errors.mean /= cells;
  std::printf(
      "point source, dx %.1f: mean error %.3f ms, largest %.3f of %.1f ms; %d sweeps, %d cells, %.4f s\n", dx,
      errors.mean, errors.largest, errors.last, wave.eikonal.sweeps(), cells, seconds);
  return errors;
}

TEST(Eikonal, PointSourceInUniformTissue) {
  for (const Vector& f : {Vector{1, 0, 0}, unit({1, 0.7, 0.4})})
    for (const double dx : {4.0, 2.0, 1.0}) point_source(dx, f);
}

}  // namespace
}  // namespace cohort::test
