#include "solver/features.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "solver/beats.hpp"
#include "solver/probes.hpp"
#include "solver/time_steps.hpp"

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

// Time at a point: a linear least squares fit to the eight nearest cells of the block of 5 x 5 x 5 around it
// that have one, so that a point on the surface, half a cell beyond the last centres, is extrapolated to and
// not rounded to its cell. times(i): of a compact cell, negative where it has none.
template <typename Times>
float time_at(const Tissue& tissue, std::size_t m, const std::array<double, 3>& point, const Times& times) {
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
        const std::array<std::int64_t, 3> cell = {nearest[0] + dx, nearest[1] + dy, nearest[2] + dz};
        const auto i = tissue.cell_at(cell, m);
        if (!i || times(*i) < 0) continue;
        const std::array<double, 3> offset = {static_cast<double>(cell[0]) - place[0],
                                              static_cast<double>(cell[1]) - place[1],
                                              static_cast<double>(cell[2]) - place[2]};
        samples.push_back({offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2], offset,
                           static_cast<double>(times(*i))});
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
    if (!scene.activation->beats) continue;
    names.emplace_back("activation_latest_" + region.name + "_ms", "ms");
    names.emplace_back("activations_most_" + region.name, "1");
  }
  for (const std::string& probe : scene.activation->probes) {
    names.emplace_back("activation_" + probe + "_ms", "ms");
    if (!scene.activation->beats) continue;
    names.emplace_back("activations_" + probe, "1");
    names.emplace_back("activation_latest_" + probe + "_ms", "ms");
    names.emplace_back("apd90_" + probe + "_ms", "ms");
    names.emplace_back("di_" + probe + "_ms", "ms");
  }
  return names;
}

namespace {

// Number and latest time of activations at a probe, APD90 of the latest action potential and the diastolic
// interval before it. potential (samples): at the probe's cell. The latest time is read as the first one is,
// from the cells that the same beat has reached.
std::array<float, 4> beat_features(const Tissue& tissue, std::span<const float> activation, std::size_t m,
                                   const std::array<double, 3>& point, std::span<const float> potential,
                                   double interval_ms, double threshold_mV) {
  const auto cell = nearest_cell(tissue, m, point);
  if (!cell) return {undefined, undefined, undefined, undefined};
  const auto stride = static_cast<std::size_t>(tissue.stride);
  const float count = activation[*cell + 2 * stride], latest = activation[*cell + stride];
  if (count == 0) return {0, undefined, undefined, undefined};
  const float time = time_at(tissue, m, point, [&](std::size_t i) {
    return activation[i + 2 * stride] == count ? activation[i + stride] : -1;
  });
  const std::vector<Beat> all = beats(potential, interval_ms, threshold_mV);
  // Samples a millisecond apart place an upstroke less well than the step does.
  if (all.empty() || std::abs(all.back().activation_ms - static_cast<double>(latest)) > interval_ms)
    return {count, time, undefined, undefined};
  const double before = all.size() > 1 ? all[all.size() - 2].repolarisation_ms : std::nan("");
  return {count, time, static_cast<float>(all.back().repolarisation_ms - static_cast<double>(latest)),
          static_cast<float>(static_cast<double>(latest) - before)};
}

}  // namespace

std::vector<float> activation_features(const Scene& scene, const Tissue& tissue,
                                       std::span<const float> activation, std::size_t m,
                                       std::span<const double> values,
                                       std::span<const float> probe_potential) {
  struct Summary {
    float first = std::numeric_limits<float>::infinity(), last = -1, latest = -1, most = 0;
    std::int64_t cells = 0, activated = 0;
  };
  const bool with_beats = scene.activation->beats;
  const auto stride = static_cast<std::size_t>(tissue.stride);
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
    if (!with_beats) continue;
    summary.latest = std::max(summary.latest, activation[i + stride]);
    summary.most = std::max(summary.most, activation[i + 2 * stride]);
  }
  std::vector<float> features;
  for (size_t r = 0; r < scene.regions.size(); ++r) {
    if (!scene.regions[r].excitable) continue;
    const Summary& summary = summaries[r];
    const bool any = summary.activated > 0;
    features.push_back(any ? summary.first : undefined);
    features.push_back(any ? summary.last : undefined);
    features.push_back(summary.cells > 0
                           ? static_cast<float>(summary.activated) / static_cast<float>(summary.cells)
                           : undefined);
    if (!with_beats) continue;
    features.push_back(any ? summary.latest : undefined);
    features.push_back(summary.most);
  }
  const std::size_t probes = scene.activation->probes.size();
  for (std::size_t k = 0; k < probes; ++k) {
    const std::array<double, 3> point = probe_point(scene, scene.activation->probes[k], values);
    features.push_back(time_at(tissue, m, point, [&](std::size_t i) { return activation[i]; }));
    if (!with_beats) continue;
    const std::size_t samples = probe_potential.size() / probes;
    const auto threshold =
        static_cast<std::size_t>(scene.parameters.index("electrophysiology.activation_threshold_mV"));
    const auto more =
        beat_features(tissue, activation, m, point, probe_potential.subspan(k * samples, samples),
                      sampling_interval_ms(scene), values[threshold]);
    features.insert(features.end(), more.begin(), more.end());
  }
  return features;
}

}  // namespace cohort
