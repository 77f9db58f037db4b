// Distances to the surfaces of labels.
#include "solver/label_distance.hpp"

#include <algorithm>
#include <cmath>

namespace cohort {

namespace {

using Vector = std::array<double, 3>;

/// Smooths a field by a binomial of variance `times`/2 cells along each axis, the values beyond its ends as
/// those at its ends.
void smooth(std::vector<float>& values, const std::array<int, 3>& n, int times) {
  std::vector<float> old(values.size());
  std::size_t stride = 1;
  for (size_t axis = 0; axis < 3; ++axis) {
    const auto length = size_t(n[axis]);
    for (int turn = 0; turn < times; ++turn) {
      old.swap(values);
      for (std::size_t first = 0; first < old.size(); first += stride * length)
        for (std::size_t k = 0; k < length; ++k) {
          const float *here = &old[first + k * stride], *below = k > 0 ? here - stride : here,
                      *above = k + 1 < length ? here + stride : here;
          float* out = &values[first + k * stride];
          for (std::size_t i = 0; i < stride; ++i) out[i] = 0.5f * here[i] + 0.25f * (below[i] + above[i]);
        }
    }
    stride *= length;
  }
}

/// The quantile z of the normal distribution, Phi(z) = p, for p in (0, 1): M. Abramowitz and I. Stegun,
/// Handbook of Mathematical Functions (1964), 26.2.23, |error| < 4.5e-4.
float normal_quantile(float p) {
  const float tail = std::min(p, 1 - p), t = std::sqrt(-2 * std::log(tail));
  const float z = t - (2.515517f + t * (0.802853f + t * 0.010328f)) /
                          (1 + t * (1.432788f + t * (0.189269f + t * 0.001308f)));
  return p < 0.5f ? -z : z;
}

}  // namespace

DistanceField::DistanceField(const FineLabels& fine, const CellBox& box, std::vector<float> values)
    : spacing_(fine.spacing_mm), n_(box.cells()), values_(std::move(values)) {
  for (size_t a = 0; a < 3; ++a) first_[a] = fine.origin_mm[a] + fine.spacing_mm * (box.lower[a] + 0.5);
}

double DistanceField::operator()(const Vector& p) const {
  std::array<int, 3> cell;
  Vector t;
  for (size_t a = 0; a < 3; ++a) {
    const double place = std::clamp((p[a] - first_[a]) / spacing_, 0.0, double(n_[a] - 1));
    cell[a] = std::min(int(place), std::max(0, n_[a] - 2));
    t[a] = place - cell[a];
  }
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1;
    std::array<int, 3> c;
    for (size_t a = 0; a < 3; ++a) {
      const int up = corner >> a & 1;
      weight *= up ? t[a] : 1 - t[a];
      c[a] = std::min(cell[a] + up, n_[a] - 1);
    }
    if (weight > 0)
      sum += weight *
             double(values_[size_t(c[0]) + size_t(n_[0]) * (size_t(c[1]) + size_t(n_[1]) * size_t(c[2]))]);
  }
  return sum;
}

CellBox box_of(const FineLabels& fine, const std::array<bool, 256>& chosen, double margin_mm) {
  CellBox box;
  box.lower = fine.cells;
  box.upper = {0, 0, 0};
  std::size_t i = 0;
  for (int z = 0; z < fine.cells[2]; ++z)
    for (int y = 0; y < fine.cells[1]; ++y)
      for (int x = 0; x < fine.cells[0]; ++x, ++i) {
        if (!chosen[fine.parts[i]]) continue;
        const std::array<int, 3> c = {x, y, z};
        for (size_t a = 0; a < 3; ++a) {
          box.lower[a] = std::min(box.lower[a], c[a]);
          box.upper[a] = std::max(box.upper[a], c[a] + 1);
        }
      }
  if (box.empty()) return box;
  const int margin = 2 * fine.per_cell + int(std::ceil(margin_mm / fine.spacing_mm));
  for (size_t a = 0; a < 3; ++a) {
    box.lower[a] = std::max(0, box.lower[a] - margin);
    box.upper[a] = std::min(fine.cells[a], box.upper[a] + margin);
  }
  return box;
}

std::vector<float> signed_distance(const FineLabels& fine, const CellBox& box,
                                   std::vector<std::uint8_t> seed) {
  if (box.empty()) return {};
  const std::size_t size = seed.size();
  const auto width = float(fine.per_voxel);  // standard deviation of the smoothing, in cells
  std::vector<float> near(size);
  for (std::size_t i = 0; i < size; ++i) near[i] = seed[i] ? 1.0f : 0.0f;
  smooth(near, box.cells(), 2 * fine.per_voxel * fine.per_voxel);
  constexpr float least_share = 1e-3f;
  for (float& x : near) x = -width * normal_quantile(std::clamp(x, least_share, 1 - least_share));

  const auto n = box.cells();
  const std::size_t strides[] = {1, size_t(n[0]), size_t(n[0]) * size_t(n[1])};
  const auto place_of = [&](std::size_t cell, size_t axis) {
    return int(cell / strides[axis] % size_t(n[axis]));
  };
  // Distance of a cell from the surface as the patch of a plane that it is next to cell `foot`.
  const auto from_patch = [&](std::size_t cell, std::size_t foot, double& along, double& beside) {
    Vector normal{}, way{};
    for (size_t a = 0; a < 3; ++a) {
      const int there = place_of(foot, a);
      way[a] = place_of(cell, a) - there;
      normal[a] = double(near[there + 1 < n[a] ? foot + strides[a] : foot] -
                         near[there > 0 ? foot - strides[a] : foot]);
    }
    const double length = std::hypot(normal[0], normal[1], normal[2]);
    along = beside = 0;
    if (!(length > 0)) return false;
    for (size_t a = 0; a < 3; ++a) along += way[a] * normal[a] / length;
    beside = std::sqrt(std::max(0.0, way[0] * way[0] + way[1] * way[1] + way[2] * way[2] - along * along));
    along += double(near[foot]);
    return true;
  };
  const double patch = 0.75 * double(width);  // half its edge
  const auto beyond = [&](std::size_t cell, std::size_t foot) {
    double along, beside;
    if (!from_patch(cell, foot, along, beside)) return near[cell];
    // Of a smooth surface the foot of the grid lies near the true one; elsewhere an edge is nearest.
    if (beside <= double(width) + 0.3 * std::abs(along)) return float(along);
    double best = std::hypot(along, std::max(0.0, beside - patch)), sign = along;
    for (int k = 0; k < 27; ++k) {
      const int step[] = {k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
      bool inside = true;
      for (size_t a = 0; a < 3; ++a) {
        const int there = place_of(foot, a) + step[a];
        inside = inside && there >= 0 && there < n[a];
      }
      const std::size_t other =
          foot + size_t(step[0]) * strides[0] + size_t(step[1]) * strides[1] + size_t(step[2]) * strides[2];
      if (!inside || !(std::abs(near[other]) <= width) || !from_patch(cell, other, along, beside)) continue;
      best = std::min(best, std::hypot(along, std::max(0.0, beside - patch)));
    }
    return float(std::copysign(best, sign));
  };
  std::vector<std::int32_t> nearest;
  std::vector<float> result(size);
  const auto h = static_cast<float>(fine.spacing_mm);
  for (const bool inside : {false, true}) {
    // From the plane that the surface is at the nearest cell on the other side.
    distance_transform(seed, box.cells(), &nearest);
    for (std::size_t i = 0; i < size; ++i) {
      if (seed[i]) continue;
      float d = near[i];
      if (nearest[i] < 0)
        d = inside ? -no_seed : no_seed;
      else if (std::abs(d) > width)
        d = beyond(i, size_t(nearest[i]));
      result[i] = h * d;
    }
    for (std::uint8_t& s : seed) s = !s;
  }
  return result;
}

}  // namespace cohort
