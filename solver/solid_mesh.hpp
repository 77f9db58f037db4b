#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "solver/tissue.hpp"

namespace cohort {

/// Cells, nodes, cavities' faces and supports of the deforming tissue of a batch, in the order of
/// kernels/solid.clh: member after member, each padded to whole blocks, block 0 void. A block of cells is a
/// tile: cells near each other, which add their forces up at the nodes they share before they are stored, one
/// slot a node. Nodes follow their first tile, those of cavities before the others.
struct SolidMesh {
  static constexpr int block = 128;
  static constexpr double mass_floor =
      0.25;  ///< least share of a cell that counts as mass and passive stress

  /// Place of component k of `count` of a cell in a field by tiles, (cells / block, count, block); in_tile of
  /// kernels/solid_tile.clh.
  static constexpr std::size_t in_tile(std::size_t cell, std::size_t k, std::size_t count) {
    return (cell / block * count + k) * block + cell % block;
  }

  // Cells. cells: their number with padding, the stride of fields.
  int cells = 0;
  std::vector<int> cell_blocks;           ///< (members + 1) first block of each member
  std::vector<int> grid_cell;             ///< (cells) in the grid, counted over members; -1 in padding
  std::vector<std::uint8_t> region;       ///< (cells)
  std::vector<double> share;              ///< by tiles (4): of each point's quarter in tissue
  std::vector<int> cell_nodes;            ///< (8, cells)
  std::vector<std::uint16_t> cell_slots;  ///< by tiles (8): place of a corner among its tile's slots
  std::vector<int> tile_slots;            ///< (tiles + 1) first slot of each
  std::vector<int> slot_node;
  int most_slots = 0;  ///< of a tile, or of a block of items
  // Nodes.
  int nodes = 0;
  std::vector<int> node_blocks;      ///< (members + 1)
  std::vector<int> vertex;           ///< (nodes) in the grid of vertices, counted over members; -1 in padding
  std::vector<double> position;      ///< (3, nodes) mm
  std::vector<double> inverse_mass;  ///< (nodes) 1/mg per unit of density; 0 in padding
  std::vector<int> corners;          ///< (8, nodes) cell of which the node is corner c; a void one where none
  std::vector<int> first_slot;       ///< (nodes + 1) of the node, among node_slots
  std::vector<int> node_slots;       ///< the slots of each node
  std::vector<std::uint8_t> cavity_block;  ///< (blocks of nodes) 1 where a node is a cavity's
  // Cavities' items: a cell and a cavity it touches.
  int items = 0;
  std::vector<int> item_blocks;  ///< (members * cavities + 1)
  std::vector<int> item_cell;    ///< (items) -1 in padding
  std::vector<std::uint8_t> item_cavity;
  std::vector<double> item_share;         ///< by tiles (4)
  std::vector<double> item_faces;         ///< by tiles (6)
  std::vector<std::uint16_t> item_slots;  ///< by tiles (8): as cell_slots
  std::vector<int> item_tile_slots;       ///< (blocks + 1)
  std::vector<int> item_slot_node;
  std::vector<double> lid;     ///< (members, cavities, 6) a point of its plane, mm; kernels/solid_forces.cl
  std::vector<int> cavity_of;  ///< (nodes) place among cavities' nodes, -1 for others
  int cavity_nodes = 0;
  std::vector<int> cavity_first;  ///< (cavities * cavity_nodes + 1) of the node, among cavity_slots
  std::vector<int> cavity_slots;  ///< the items' slots of each cavity and node
  // Surfaces: of each boundary condition, the area vector of its nodes, away from the tissue.
  struct Patch {
    int node;
    std::array<double, 3> area;  ///< mm2
  };
  std::vector<std::vector<Patch>> surfaces;  ///< by boundary condition, over all members
  std::vector<std::vector<int>> held;        ///< by boundary condition: nodes that a clamp holds
  std::vector<std::string> defects;          ///< by member; empty when sound
  std::vector<int> tissue_cells;             ///< by member
};

/// What kernels/solid_setup.cl found in the cells of the grid, host copies.
struct SolidParts {
  std::vector<std::uint16_t> counts;  ///< (1 + voids, 4, members, nz, ny, nx) of samples
  std::vector<std::uint8_t> region;   ///< (members, nz, ny, nx)
  int samples;                        ///< of a quarter of a cell
};

SolidMesh build_solid_mesh(const Scene& scene, const Grid& grid, const SolidParts& parts, int members);

}  // namespace cohort
