#pragma once

#include <span>
#include <vector>

#include "solver/solid.hpp"
#include "solver/tissue.hpp"

// Where cells of the mechanics' grid find the excited tissue, member for member; the grids may differ.
namespace cohort {

/// By cell of the mesh the place in the tissue's fields of the nearest cell within two cells, the one at the
/// same place first; -1 where there is none. times (stride): cells whose time is negative do not count;
/// empty: all do. members: of the tissue, by member of the solid.
std::vector<int> nearest_places(const Solid& solid, const Tissue& tissue, std::span<const float> times,
                                std::span<const std::size_t> members);

}  // namespace cohort
