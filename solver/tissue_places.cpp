#include "solver/tissue_places.hpp"

#include <algorithm>
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
      const auto look = [&](int dx, int dy, int dz) {
        const std::array<std::int64_t, 3> cell = {at[0] + dx, at[1] + dy, at[2] + dz};
        double distance = 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
          distance += (static_cast<double>(cell[axis]) - offset[axis]) *
                      (static_cast<double>(cell[axis]) - offset[axis]);
        if (distance >= nearest) return;
        const auto place = tissue.cell_at(cell, members[m]);
        if (!place || (!times.empty() && times[*place] < 0)) return;
        nearest = distance;
        result[static_cast<std::size_t>(i)] = static_cast<int>(*place);
      };
      look(0, 0, 0);
      constexpr double nearer_than_any = 0.25;  // the next cell's middle is half a cell away at least
      if (nearest < nearer_than_any) continue;
      for (int dz = -reach; dz <= reach; ++dz)
        for (int dy = -reach; dy <= reach; ++dy)
          for (int dx = -reach; dx <= reach; ++dx) look(dx, dy, dz);
    }
  return result;
}

std::vector<float> values_at(std::span<const int> places, std::span<const float> field) {
  std::vector<float> result(places.size(), -1.0f);
  for (std::size_t i = 0; i < places.size(); ++i)
    if (places[i] >= 0) result[i] = field[static_cast<std::size_t>(places[i])];
  return result;
}

CellPlaces places_within(const Solid& solid, const Tissue& tissue, std::span<const std::size_t> members) {
  const SolidMesh& mesh = solid.mesh();
  const Grid& coarse = solid.grid();
  const Grid& fine = tissue.grid();
  const std::vector<int> nearest = nearest_places(solid, tissue, {}, members);
  CellPlaces result;
  for (std::size_t m = 0, i = 0; i < nearest.size(); ++i) {
    while (m + 1 < members.size() &&
           i >= static_cast<std::size_t>(mesh.cell_blocks[m + 1] * SolidMesh::block))
      ++m;
    result.first.push_back(static_cast<int>(result.places.size()));
    if (nearest[i] < 0) continue;
    const std::array<double, 3> centre = solid.centre(i);
    std::array<std::int64_t, 3> from{}, to{};  // fine cells whose centres lie inside
    for (std::size_t axis = 0; axis < 3; ++axis) {
      constexpr double rounding = 1e-6;
      const double low = (centre[axis] - 0.5 * coarse.dx_mm - fine.origin_mm[axis]) / fine.dx_mm - 0.5;
      from[axis] = static_cast<std::int64_t>(std::ceil(low + rounding));
      to[axis] = static_cast<std::int64_t>(std::ceil(low + coarse.dx_mm / fine.dx_mm + rounding));
    }
    std::vector<int> inside;
    for (std::int64_t z = from[2]; z < to[2]; ++z)
      for (std::int64_t y = from[1]; y < to[1]; ++y)
        for (std::int64_t x = from[0]; x < to[0]; ++x)
          if (const auto place = tissue.cell_at({x, y, z}, members[m]))
            inside.push_back(static_cast<int>(*place));
    // A nearest cell that lies outside stands for none inside.
    const auto own = std::find(inside.begin(), inside.end(), nearest[i]);
    if (own != inside.end()) std::iter_swap(inside.begin(), own);
    if (inside.empty()) inside.push_back(nearest[i]);
    result.places.insert(result.places.end(), inside.begin(), inside.end());
  }
  result.first.push_back(static_cast<int>(result.places.size()));
  return result;
}

std::vector<int> cells_around(const Solid& solid, const Tissue& tissue,
                              std::span<const std::size_t> members) {
  const SolidMesh& mesh = solid.mesh();
  const Grid& coarse = solid.grid();
  const auto [nx, ny, nz] = coarse.cells;
  std::vector<int> result(static_cast<std::size_t>(tissue.stride), -1);
  std::vector<int> at(static_cast<std::size_t>(coarse.size()));
  for (std::size_t m = 0; m < members.size(); ++m) {
    std::fill(at.begin(), at.end(), -1);
    const std::int64_t begin = static_cast<std::int64_t>(m) * coarse.size();
    for (int i = mesh.cell_blocks[m] * SolidMesh::block; i < mesh.cell_blocks[m + 1] * SolidMesh::block; ++i)
      if (mesh.grid_cell[static_cast<std::size_t>(i)] >= 0)
        at[static_cast<std::size_t>(mesh.grid_cell[static_cast<std::size_t>(i)] - begin)] = i;
    const auto block = [&](std::size_t k) {
      return static_cast<std::size_t>(Tissue::first_cell_place + tissue.first_block[k] * Tissue::block_cells);
    };
    for (std::size_t place = block(members[m]); place < block(members[m] + 1); ++place) {
      if (tissue.regions[place] == 255) continue;
      const std::array<double, 3> centre = tissue.centre(place);
      std::array<int, 3> cell{};
      std::array<double, 3> offset{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double x = (centre[axis] - coarse.origin_mm[axis]) / coarse.dx_mm;
        cell[axis] = static_cast<int>(std::floor(x));
        offset[axis] = x - 0.5 - cell[axis];
      }
      double nearest = 1e30;
      for (int dz = -1; dz <= 1; ++dz)
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx) {
            const int x = cell[0] + dx, y = cell[1] + dy, z = cell[2] + dz;
            if (x < 0 || y < 0 || z < 0 || x >= nx || y >= ny || z >= nz) continue;
            const int found = at[static_cast<std::size_t>((std::int64_t{z} * ny + y) * nx + x)];
            const double distance = (dx - offset[0]) * (dx - offset[0]) +
                                    (dy - offset[1]) * (dy - offset[1]) + (dz - offset[2]) * (dz - offset[2]);
            if (found < 0 || distance >= nearest) continue;
            nearest = distance;
            result[place] = found;
          }
    }
  }
  return result;
}

}  // namespace cohort
