#include "solver/features.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace cohort {

namespace {

constexpr float undefined = std::numeric_limits<float>::quiet_NaN();

// Solves the 4 x 4 normal equations of a linear fit by Gaussian elimination with pivots; false when singular.
bool solve(std::array<std::array<double, 5>, 4>& a) {
  for (size_t column = 0; column < 4; ++column) {
    size_t pivot = column;
    for (size_t row = column + 1; row < 4; ++row)
      if (std::abs(a[row][column]) > std::abs(a[pivot][column])) pivot = row;
    if (std::abs(a[pivot][column]) < 1e-9) return false;
    std::swap(a[pivot], a[column]);
    for (size_t row = 0; row < 4; ++row) {
      if (row == column) continue;
      const double factor = a[row][column] / a[column][column];
      for (size_t k = column; k < 5; ++k) a[row][k] -= factor * a[column][k];
    }
  }
  return true;
}

// Activation at a point: a linear least squares fit to the activated cells of the 3 x 3 x 3 block nearest to
// it, so that a point on the surface, half a cell beyond the last centres, is extrapolated to and not rounded
// to its cell.
float probe_activation(const Tissue& tissue, std::span<const float> activation, std::size_t m,
                       const std::array<double, 3>& point) {
  const Grid& grid = tissue.grid();
  std::array<std::int64_t, 3> nearest{};
  std::array<double, 3> place{};
  for (size_t axis = 0; axis < 3; ++axis) {
    place[axis] = (point[axis] - grid.origin_mm[axis]) / grid.dx_mm - 0.5;  // in cells, from the first centre
    nearest[axis] = std::lround(place[axis]);
  }
  constexpr std::int64_t reach = 2;
  struct Sample {
    double distance2;
    std::array<double, 3> offset;
    double time;
  };
  std::vector<Sample> samples;
  for (std::int64_t dz = -reach; dz <= reach; ++dz)
    for (std::int64_t dy = -reach; dy <= reach; ++dy)
      for (std::int64_t dx = -reach; dx <= reach; ++dx) {
        const std::int64_t x = nearest[0] + dx, y = nearest[1] + dy, z = nearest[2] + dz;
        if (x < 0 || y < 0 || z < 0 || x >= grid.cells[0] || y >= grid.cells[1] || z >= grid.cells[2])
          continue;
        const std::int64_t cell =
            x + grid.cells[0] * (y + grid.cells[1] * (z + grid.cells[2] * static_cast<std::int64_t>(m)));
        const auto i = static_cast<std::size_t>(tissue.places[static_cast<size_t>(cell / Tissue::lanes)]) *
                           Tissue::lanes +
                       static_cast<std::size_t>(cell % Tissue::lanes);
        if (tissue.regions[i] == 255 || activation[i] < 0) continue;
        const std::array<double, 3> offset = {static_cast<double>(x) - place[0],
                                              static_cast<double>(y) - place[1],
                                              static_cast<double>(z) - place[2]};
        samples.push_back({offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2], offset,
                           static_cast<double>(activation[i])});
      }
  if (samples.empty()) return undefined;
  std::stable_sort(samples.begin(), samples.end(),
                   [](const Sample& a, const Sample& b) { return a.distance2 < b.distance2; });
  samples.resize(std::min<std::size_t>(samples.size(), 8));
  std::array<std::array<double, 5>, 4> normal{};
  for (const Sample& sample : samples) {
    const std::array<double, 4> basis = {1, sample.offset[0], sample.offset[1], sample.offset[2]};
    for (size_t row = 0; row < 4; ++row) {
      for (size_t column = 0; column < 4; ++column) normal[row][column] += basis[row] * basis[column];
      normal[row][4] += basis[row] * sample.time;
    }
  }
  if (!solve(normal)) return static_cast<float>(samples.front().time);
  return static_cast<float>(normal[0][4] / normal[0][0]);
}

}  // namespace

std::vector<std::pair<std::string, std::string>> activation_feature_names(const Scene& scene) {
  std::vector<std::pair<std::string, std::string>> names;
  if (!scene.activation) return names;
  for (const Region& region : scene.regions) {
    if (!region.excitable) continue;
    names.emplace_back("activation_first_" + region.name + "_ms", "ms");
    names.emplace_back("activation_last_" + region.name + "_ms", "ms");
    names.emplace_back("activated_share_" + region.name, "1");
  }
  for (const std::string& probe : scene.activation->probes)
    names.emplace_back("activation_" + probe + "_ms", "ms");
  return names;
}

std::vector<float> activation_features(const Scene& scene, const Tissue& tissue,
                                       std::span<const float> activation, std::size_t m,
                                       std::span<const double> values) {
  struct Summary {
    float first = std::numeric_limits<float>::infinity(), last = -1;
    std::int64_t cells = 0, activated = 0;
  };
  std::vector<Summary> summaries(scene.regions.size());
  const auto begin =
      static_cast<std::size_t>(Tissue::first_cell_place + tissue.first_block[m] * Tissue::block_cells);
  const auto end =
      static_cast<std::size_t>(Tissue::first_cell_place + tissue.first_block[m + 1] * Tissue::block_cells);
  for (std::size_t i = begin; i < end; ++i) {
    if (tissue.regions[i] == 255) continue;
    Summary& summary = summaries[tissue.regions[i]];
    ++summary.cells;
    if (activation[i] < 0) continue;
    ++summary.activated;
    summary.first = std::min(summary.first, activation[i]);
    summary.last = std::max(summary.last, activation[i]);
  }
  std::vector<float> features;
  for (size_t r = 0; r < scene.regions.size(); ++r) {
    if (!scene.regions[r].excitable) continue;
    const Summary& summary = summaries[r];
    features.push_back(summary.activated > 0 ? summary.first : undefined);
    features.push_back(summary.activated > 0 ? summary.last : undefined);
    features.push_back(summary.cells > 0
                           ? static_cast<float>(summary.activated) / static_cast<float>(summary.cells)
                           : undefined);
  }
  for (const std::string& probe : scene.activation->probes) {
    const auto coordinate = [&](const char* axis) {
      return values[static_cast<size_t>(
          scene.parameters.index("outputs.activation.probes." + probe + "_mm" + axis))];
    };
    features.push_back(
        probe_activation(tissue, activation, m, {coordinate(".x"), coordinate(".y"), coordinate(".z")}));
  }
  return features;
}

}  // namespace cohort
