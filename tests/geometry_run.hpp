#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <numeric>
#include <queue>

#include "solver/device.hpp"
#include "solver/geometry.hpp"
#include "solver/parameter_block.hpp"

// Runs the geometry's device functions for tests.
namespace cohort::test {

using Point = std::array<double, 3>;

inline Device& device() {
  static Device instance(devices().at(0));
  return instance;
}

template <class T>
cl::Buffer upload(std::vector<T> data) {
  return {device().context(), CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, data.size() * sizeof(T), data.data()};
}

template <class T>
std::vector<T> download(const cl::Buffer& buffer, size_t count) {
  std::vector<T> data(count);
  device().queue().enqueueReadBuffer(buffer, CL_TRUE, 0, count * sizeof(T), data.data());
  return data;
}

/// Values of the signed distance `expression` of a real3 p at `points`, single precision.
inline std::vector<float> distances(const std::string& expression, const std::vector<Point>& points) {
  std::vector<cl_float4> at;
  for (const Point& p : points) at.push_back({{float(p[0]), float(p[1]), float(p[2]), 0}});
  const cl::Program program = device().build({"signed_distance.clh", "sample_geometry.cl"}, {},
                                             "#define DISTANCE(p) (" + expression + ")\n");
  cl::Kernel kernel(program, "sample_distance");
  const cl::Buffer in = upload(at), out = upload(std::vector<float>(at.size()));
  kernel.setArg(0, in);
  kernel.setArg(1, out);
  device().queue().enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(at.size()));
  return download<float>(out, at.size());
}

/// A geometry on a grid whose faces lie on multiples of dx, one cell wider than its extent on every side. x
/// runs fastest.
struct Cells {
  double dx;
  std::array<int, 3> n;
  Point origin;
  std::vector<int> region, cavity;
  std::vector<float> fraction, cavity_fraction;
  std::vector<cl_float4> fibre, coordinates;

  size_t size() const { return region.size(); }
  size_t at(int x, int y, int z) const {
    return size_t(x) + size_t(n[0]) * (size_t(y) + size_t(n[1]) * size_t(z));
  }
  Point centre(size_t i) const {
    const size_t nx = size_t(n[0]), ny = size_t(n[1]);
    return {origin[0] + dx * (double(i % nx) + 0.5), origin[1] + dx * (double(i / nx % ny) + 0.5),
            origin[2] + dx * (double(i / (nx * ny)) + 0.5)};
  }
  /// mL of tissue in region `r`.
  double volume_mL(int r) const { return sum(region, fraction, r); }
  /// mL of blood in cavity `c`.
  double cavity_mL(int c) const { return sum(cavity, cavity_fraction, c); }

 private:
  double sum(const std::vector<int>& label, const std::vector<float>& share, int wanted) const {
    double cells = 0;
    for (size_t i = 0; i < label.size(); ++i)
      if (label[i] == wanted) cells += double(share[i]);
    return cells * dx * dx * dx / 1000;
  }
};

inline Cells sample(const Scene& scene, const std::vector<double>& values, double dx) {
  Cells cells;
  cells.dx = dx;
  const Extent extent = geometry_extent(scene, values);
  size_t count = 1;
  for (size_t axis = 0; axis < 3; ++axis) {
    const double first = std::floor(extent.lower[axis] / dx + 1e-9) - 1,
                 last = std::ceil(extent.upper[axis] / dx - 1e-9) + 1;
    cells.origin[axis] = first * dx;
    cells.n[axis] = int(last - first);
    count *= size_t(cells.n[axis]);
  }
  std::vector<std::string> files = geometry_files(scene);
  files.push_back("sample_geometry.cl");
  const cl::Program program =
      device().build(files, {"CELLS"}, parameter_macros(scene.parameters) + geometry_source(scene));
  cl::Kernel kernel(program, "sample_cells");
  const cl_float4 place = {
      {float(cells.origin[0]), float(cells.origin[1]), float(cells.origin[2]), float(dx)}};
  const cl::Buffer buffers[] = {upload(std::vector<int>(count)),       upload(std::vector<float>(count)),
                                upload(std::vector<cl_float4>(count)), upload(std::vector<cl_float4>(count)),
                                upload(std::vector<int>(count)),       upload(std::vector<float>(count))};
  const cl::Buffer block = upload(std::vector<float>(values.begin(), values.end()));
  kernel.setArg(0, block);
  kernel.setArg(1, place);
  kernel.setArg(2, cl_int2{{cells.n[0], cells.n[1]}});
  for (cl_uint i = 0; i < 6; ++i) kernel.setArg(3 + i, buffers[i]);
  device().queue().enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(count));
  cells.region = download<int>(buffers[0], count);
  cells.fraction = download<float>(buffers[1], count);
  cells.fibre = download<cl_float4>(buffers[2], count);
  cells.coordinates = download<cl_float4>(buffers[3], count);
  cells.cavity = download<int>(buffers[4], count);
  cells.cavity_fraction = download<float>(buffers[5], count);
  return cells;
}

/// Numbers the face-connected parts of the cells that `take(region)` holds, from 0; -1 elsewhere.
template <class Take>
std::vector<int> components(const Cells& cells, Take take, int& count) {
  std::vector<int> component(cells.size(), -1);
  const long nx = cells.n[0], nxy = nx * cells.n[1];
  const long steps[] = {1,   -1,  nx, -nx,
                        nxy, -nxy};  // the outermost cells hold no tissue, so that no step leaves the grid
  count = 0;
  for (size_t seed = 0; seed < cells.size(); ++seed) {
    if (component[seed] >= 0 || !take(cells.region[seed])) continue;
    std::queue<size_t> front({seed});
    component[seed] = count;
    for (; !front.empty(); front.pop())
      for (const long step : steps) {
        const size_t next = front.front() + size_t(step);
        if (next >= cells.size() || component[next] >= 0 || !take(cells.region[next])) continue;
        component[next] = count;
        front.push(next);
      }
    ++count;
  }
  return component;
}

}  // namespace cohort::test
