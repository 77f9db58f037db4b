#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "solver/labels.hpp"

namespace cohort {

/// A field on a box of the fine grid, in mm, read between the cells' centres by trilinear interpolation.
class DistanceField {
 public:
  DistanceField() = default;
  /// values (box cells), x fastest.
  DistanceField(const FineLabels& fine, const CellBox& box, std::vector<float> values);
  bool empty() const { return values_.empty(); }
  /// At a place in mm; beyond the box as at its faces.
  double operator()(const std::array<double, 3>& p) const;

 private:
  double spacing_ = 1;
  std::array<int, 3> n_{};
  std::array<double, 3> first_{};
  std::vector<float> values_;
};

/// The box of the chosen parts and a margin of two cells of the scene and `margin_mm` more; empty where there
/// are none.
CellBox box_of(const FineLabels& fine, const std::array<bool, 256>& chosen, double margin_mm = 0);

/// Seeds in a box: choose(part, z of the centre).
template <class Choose>
std::vector<std::uint8_t> seeds_in(const FineLabels& fine, const CellBox& box, Choose choose) {
  std::vector<std::uint8_t> result;
  result.reserve(box.size());
  for (int z = box.lower[2]; z < box.upper[2]; ++z)
    for (int y = box.lower[1]; y < box.upper[1]; ++y)
      for (int x = box.lower[0]; x < box.upper[0]; ++x)
        result.push_back(choose(fine.parts[fine.at(x, y, z)], fine.centre(x, y, z)[2]) ? 1 : 0);
  return result;
}

/// Signed distance in mm to the surface of the seeds (box cells), negative inside. The surface is that of the
/// shape that voxels sampled, not their faces: next to it the distance follows from the share of seeds about
/// a cell, which goes through a plane of any direction as a normal distribution; farther away from that of
/// the nearest cell on the other side. Without a seed `no_seed` cells everywhere.
std::vector<float> signed_distance(const FineLabels& fine, const CellBox& box,
                                   std::vector<std::uint8_t> seed);

}  // namespace cohort
