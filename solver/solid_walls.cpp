#include "solver/solid_walls.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <vector>

namespace cohort {

namespace {

using Point = std::array<double, 3>;

/// Shares of a member's cells by place.
class Shares {
 public:
  Shares(const SolidMesh& mesh, const Grid& grid, std::size_t m)
      : mesh_(mesh), grid_(grid), cell_(static_cast<std::size_t>(grid.size()), -1) {
    for (int i = mesh.cell_blocks[m] * SolidMesh::block; i < mesh.cell_blocks[m + 1] * SolidMesh::block;
         ++i) {
      const std::int64_t at = mesh.grid_cell[static_cast<std::size_t>(i)];
      if (at >= 0) cell_[static_cast<std::size_t>(at % grid.size())] = i;
    }
  }
  /// Of the cell at p, mm.
  double at(const Point& p) const {
    std::int64_t place = 0;
    for (std::size_t axis = 3; axis-- > 0;) {
      const auto k = static_cast<std::int64_t>(std::floor((p[axis] - grid_.origin_mm[axis]) / grid_.dx_mm));
      if (k < 0 || k >= grid_.cells[axis]) return 0;
      place = place * grid_.cells[axis] + k;
    }
    const int i = cell_[static_cast<std::size_t>(place)];
    double sum = 0;
    for (std::size_t g = 0; i >= 0 && g < 4; ++g)
      sum += 0.25 * mesh_.share[SolidMesh::in_tile(static_cast<std::size_t>(i), g, 4)];
    return sum;
  }

 private:
  const SolidMesh& mesh_;
  const Grid& grid_;
  std::vector<int> cell_;
};

/// By node of the wall, the area vector of the cavity's surface, into the blood.
std::map<int, Point> surface(const SolidMesh& mesh, std::size_t first_block, std::size_t last_block,
                             double h) {
  std::map<int, Point> area;
  const auto cells = static_cast<std::size_t>(mesh.cells);
  const double quarter = 0.25 * h * h;
  for (std::size_t j = first_block * SolidMesh::block; j < last_block * SolidMesh::block; ++j) {
    if (mesh.item_cell[j] < 0) continue;
    const auto node = [&](std::size_t corner) {
      return mesh.cell_nodes[corner * cells + static_cast<std::size_t>(mesh.item_cell[j])];
    };
    double chi = 0;
    for (std::size_t g = 0; g < 4; ++g) chi += 0.25 * mesh.item_share[SolidMesh::in_tile(j, g, 4)];
    for (std::size_t corner = 0; corner < 8; ++corner)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        Point& sum = area[node(corner)];
        const bool upper = corner >> axis & 1;
        sum[axis] += (upper ? -chi : chi) * quarter;
        const double face = mesh.item_faces[SolidMesh::in_tile(j, 2 * axis + (upper ? 1 : 0), 6)];
        sum[axis] += (upper ? face : -face) * quarter;
      }
  }
  return area;
}

}  // namespace

double thin_wall_cells(const SolidMesh& mesh, const Grid& grid, std::size_t cavities, std::size_t m,
                       std::size_t q) {
  const Shares shares(mesh, grid, m);
  const double h = grid.dx_mm;
  const auto nodes = static_cast<std::size_t>(mesh.nodes), cells = static_cast<std::size_t>(mesh.cells);
  const std::size_t place = m * cavities + q;
  const auto first = static_cast<std::size_t>(mesh.item_blocks[place]),
             last = static_cast<std::size_t>(mesh.item_blocks[place + 1]);
  const auto position = [&](int node, std::size_t axis) {
    return mesh.position[axis * nodes + static_cast<std::size_t>(node)];
  };
  std::map<int, Point> surfaces = surface(mesh, first, last, h);
  // Of nodes in the lid's plane the other half of the surface is missing.
  for (auto& [node, area] : surfaces)
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (mesh.lid[6 * place + 3 + axis] == 0 &&
          std::abs(position(node, axis) - mesh.lid[6 * place + axis]) < 0.5 * h)
        area[axis] = 0;
  std::vector<std::pair<double, double>> found;  // cells, area
  double all = 0;
  for (std::size_t j = first * SolidMesh::block; j < last * SolidMesh::block; ++j) {
    if (mesh.item_cell[j] < 0) continue;
    Point normal{}, centre{};
    for (std::size_t corner = 0; corner < 8; ++corner) {
      const int node = mesh.cell_nodes[corner * cells + static_cast<std::size_t>(mesh.item_cell[j])];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        normal[axis] += surfaces[node][axis];
        centre[axis] += 0.125 * position(node, axis);
      }
    }
    const double size = std::hypot(normal[0], normal[1], normal[2]);
    if (!(size > 0)) continue;
    // From the blood through the wall.
    constexpr double start = 2, farthest = 40, stride = 0.125, least = 0.05;  // cells
    double thick = 0;
    for (double along = start; along > -farthest; along -= stride) {
      Point p = centre;
      for (std::size_t axis = 0; axis < 3; ++axis) p[axis] += along * h * normal[axis] / size;
      const double share = shares.at(p);
      if (share < least && thick > stride) break;
      thick += stride * share;
    }
    found.emplace_back(thick, size);
    all += size;
  }
  std::sort(found.begin(), found.end());
  double sum = 0;
  for (const auto& [thick, size] : found)
    if ((sum += size) >= 0.25 * all) return thick;
  return 0;
}

// Cyclic Jacobi.
std::array<double, 6> eigenvalues(std::array<std::array<double, 6>, 6> A) {
  for (int sweep = 0; sweep < 30; ++sweep)
    for (std::size_t p = 0; p < 6; ++p)
      for (std::size_t q = p + 1; q < 6; ++q) {
        const double angle = 0.5 * std::atan2(2 * A[p][q], A[p][p] - A[q][q]);
        const double c = std::cos(angle), s = std::sin(angle);
        for (auto& row : A) {
          const double a = row[p], b = row[q];
          row[p] = c * a + s * b;
          row[q] = c * b - s * a;
        }
        for (std::size_t k = 0; k < 6; ++k) {
          const double a = A[p][k], b = A[q][k];
          A[p][k] = c * a + s * b;
          A[q][k] = c * b - s * a;
        }
      }
  std::array<double, 6> result{};
  for (std::size_t k = 0; k < 6; ++k) result[k] = A[k][k];
  std::sort(result.begin(), result.end());
  return result;
}

}  // namespace cohort
