#include "solver/probes.hpp"

#include <cmath>

namespace cohort {

std::array<double, 3> probe_point(const Scene& scene, const std::string& probe,
                                  std::span<const double> values) {
  const int first = scene.parameters.index("outputs.activation.probes." + probe + "_mm.x");
  const auto at = values.subspan(static_cast<std::size_t>(first), 3);
  return {at[0], at[1], at[2]};
}

std::optional<std::size_t> nearest_cell(const Tissue& tissue, std::size_t m,
                                        const std::array<double, 3>& point) {
  const Grid& grid = tissue.grid();
  std::array<double, 3> place{};  // in cells, from the first centre
  std::array<std::int64_t, 3> nearest{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    place[axis] = (point[axis] - grid.origin_mm[axis]) / grid.dx_mm - 0.5;
    if (!(std::abs(place[axis]) < 1e7)) return {};
    nearest[axis] = std::llround(place[axis]);
  }
  constexpr std::int64_t reach = 2;
  std::optional<std::size_t> result;
  double least = 0;
  for (std::int64_t z = nearest[2] - reach; z <= nearest[2] + reach; ++z)
    for (std::int64_t y = nearest[1] - reach; y <= nearest[1] + reach; ++y)
      for (std::int64_t x = nearest[0] - reach; x <= nearest[0] + reach; ++x) {
        const auto i = tissue.cell_at({x, y, z}, m);
        if (!i) continue;
        const double dx = static_cast<double>(x) - place[0], dy = static_cast<double>(y) - place[1],
                     dz = static_cast<double>(z) - place[2];
        const double distance2 = dx * dx + dy * dy + dz * dz;
        if (result && distance2 >= least) continue;
        result = i;
        least = distance2;
      }
  return result;
}

std::vector<std::string> probes_outside(const Scene& scene, const Tissue& tissue, std::size_t m,
                                        std::span<const double> values) {
  std::vector<std::string> outside;
  if (!scene.activation) return outside;
  for (const std::string& probe : scene.activation->probes)
    if (!nearest_cell(tissue, m, probe_point(scene, probe, values))) outside.push_back(probe);
  return outside;
}

Probes::Probes(Launcher& launcher, const Scene& scene, const Definitions& definitions, int members_per_batch,
               int samples)
    : launcher_(launcher), scene_(scene), samples_(samples) {
  Device& device = launcher.device();
  record_ = launcher.handle(definitions.build(device, {"probes.cl"}), "record_probes");
  const std::size_t rows = static_cast<std::size_t>(members_per_batch) * scene.activation->probes.size();
  cells_ = device.allocate(rows * sizeof(int), "cells");
  series_ = device.allocate(rows * static_cast<std::size_t>(samples) * sizeof(float), "series");
}

std::size_t Probes::bytes(const Scene& scene, int members_per_batch, int samples) {
  return static_cast<std::size_t>(members_per_batch) * scene.activation->probes.size() *
         (sizeof(int) + static_cast<std::size_t>(samples) * sizeof(float));
}

void Probes::prepare(const Tissue& tissue, std::span<const Member> members) {
  std::vector<int> cells;
  for (std::size_t m = 0; m < members.size(); ++m)
    for (const std::string& probe : scene_.activation->probes)
      cells.push_back(static_cast<int>(
          nearest_cell(tissue, m, probe_point(scene_, probe, members[m].values)).value_or(0)));
  rows_ = static_cast<int>(cells.size());
  if (rows_ > 0)
    launcher_.queue().enqueueWriteBuffer(cells_, CL_TRUE, 0, cells.size() * sizeof(int), cells.data());
}

void Probes::sample(const cl::Buffer& potential, int sample) {
  if (rows_ == 0) return;
  launcher_.counted(record_, static_cast<std::size_t>(rows_), 12.0 * rows_, potential, cells_, series_,
                    sample, samples_);
}

std::vector<float> Probes::series() {
  std::vector<float> result(static_cast<std::size_t>(rows_) * static_cast<std::size_t>(samples_));
  if (rows_ > 0)
    launcher_.queue().enqueueReadBuffer(series_, CL_TRUE, 0, result.size() * sizeof(float), result.data());
  return result;
}

}  // namespace cohort
