#include "solver/tissue_places.hpp"

#include <cmath>

namespace cohort {

std::vector<int> nearest_places(const Solid& solid, const Tissue& tissue, std::span<const float> times,
                                std::span<const std::size_t> members) {
  const SolidMesh& mesh = solid.mesh();
  const Grid& coarse = solid.grid();
  const Grid& fine = tissue.grid();
  const int reach = 1 + static_cast<int>(std::ceil(coarse.dx_mm / fine.dx_mm));
  std::vector<int> result(static_cast<std::size_t>(mesh.cells), -1);
  for (std::size_t m = 0; m < members.size(); ++m)
    for (int i = mesh.cell_blocks[m] * SolidMesh::block; i < mesh.cell_blocks[m + 1] * SolidMesh::block;
         ++i) {
      if (mesh.grid_cell[static_cast<std::size_t>(i)] < 0) continue;
      const std::array<double, 3> centre = solid.centre(static_cast<std::size_t>(i));
      std::array<std::int64_t, 3> at{};
      std::array<double, 3> offset{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double place = (centre[axis] - fine.origin_mm[axis]) / fine.dx_mm;
        at[axis] = static_cast<std::int64_t>(std::floor(place));
        offset[axis] = place - 0.5;
      }
      double nearest = 1e30;
      for (int dz = -reach; dz <= reach; ++dz)
        for (int dy = -reach; dy <= reach; ++dy)
          for (int dx = -reach; dx <= reach; ++dx) {
            const std::array<std::int64_t, 3> cell = {at[0] + dx, at[1] + dy, at[2] + dz};
            double distance = 0;
            for (std::size_t axis = 0; axis < 3; ++axis)
              distance += (static_cast<double>(cell[axis]) - offset[axis]) *
                          (static_cast<double>(cell[axis]) - offset[axis]);
            if (distance >= nearest) continue;
            const auto place = tissue.cell_at(cell, members[m]);
            if (!place || (!times.empty() && times[*place] < 0)) continue;
            nearest = distance;
            result[static_cast<std::size_t>(i)] = static_cast<int>(*place);
          }
    }
  return result;
}

}  // namespace cohort
