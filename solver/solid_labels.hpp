#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "solver/solid_mesh.hpp"

namespace cohort {

/// What the mechanics' cells of a label map hold, as kernels/solid_setup.cl finds it for other geometries:
/// one member's, since labels are the same for all.
struct SolidLabels {
  SolidParts parts;
  /// Vertices (nz + 1, ny + 1, nx + 1): bit k where void k + 1 lies within a quarter of a cell.
  std::vector<std::uint16_t> near;
  std::vector<int> place;  ///< (nz, ny, nx): of a cell with tissue in `direction`, -1 of others
  /// (tissue, 4 points, 4): normal of the wall, or axis, and the transmural coordinate.
  std::vector<float> direction;
};

/// The same parts for each of some members.
SolidParts for_members(const SolidParts& one, int members);

/// Computed once for a scene and grid and kept with its label map.
std::shared_ptr<const SolidLabels> solid_labels(const Scene& scene, const Grid& grid);

}  // namespace cohort
