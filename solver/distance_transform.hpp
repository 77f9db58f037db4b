#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace cohort {

/// Part [lower, upper) of a grid.
struct CellBox {
  std::array<int, 3> lower{}, upper{};
  std::array<int, 3> cells() const { return {upper[0] - lower[0], upper[1] - lower[1], upper[2] - lower[2]}; }
  std::size_t size() const {
    const auto n = cells();
    return std::size_t(n[0]) * std::size_t(n[1]) * std::size_t(n[2]);
  }
  bool empty() const { return upper[0] <= lower[0] || upper[1] <= lower[1] || upper[2] <= lower[2]; }
};

/// Euclidean distance, in cells, from each cell's centre to the nearest centre of a cell with seed != 0,
/// exact; `far` where there is none. x runs fastest; cells: extents of `seed`. P. Felzenszwalb and D.
/// Huttenlocher, "Distance transforms of sampled functions", Theory of Computing 8, 415-428 (2012),
/// section 2.1.
/// `nearest`, where given: the place of that nearest cell, -1 where there is none.
std::vector<float> distance_transform(const std::vector<std::uint8_t>& seed, const std::array<int, 3>& cells,
                                      std::vector<std::int32_t>* nearest = nullptr);

/// What distance_transform gives where nothing is a seed.
inline constexpr float no_seed = 1e9f;

}  // namespace cohort
