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

/// Values of the tissue's fields at places; -1 where the place is.
std::vector<float> values_at(std::span<const int> places, std::span<const float> field);

/// By cell of the mesh, from first[i] to first[i + 1], the places of the excited cells whose centres lie in
/// it, else of the nearest as above; that nearest to its centre first.
struct CellPlaces {
  std::vector<int> first, places;
};
CellPlaces places_within(const Solid& solid, const Tissue& tissue, std::span<const std::size_t> members);

/// By place of the tissue's fields the cell of the mesh that holds its centre, else the nearest neighbour of
/// that; -1 without, and for members that are not of the solid.
std::vector<int> cells_around(const Solid& solid, const Tissue& tissue, std::span<const std::size_t> members);

}  // namespace cohort
