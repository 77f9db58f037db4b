#pragma once

#include <array>

#include "solver/solid_mesh.hpp"

namespace cohort {

/// Thickness of the wall around cavity q of member m, in cells of the grid: what a twentieth of its surface
/// falls short of. Along normals, by what the cells hold.
double thin_wall_cells(const SolidMesh& mesh, const Grid& grid, std::size_t cavities, std::size_t m,
                       std::size_t q);

/// Eigenvalues of a symmetric matrix of six rows, ascending.
std::array<double, 6> eigenvalues(std::array<std::array<double, 6>, 6> A);

}  // namespace cohort
