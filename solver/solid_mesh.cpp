#include "solver/solid_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "solver/on_all_cores.hpp"
#include "solver/solid_member_mesh.hpp"

namespace cohort {

namespace {

using Index3 = std::array<int, 3>;

template <typename T>
T& at(std::vector<T>& field, int component, int stride, int i) {
  return field[static_cast<std::size_t>(component) * static_cast<std::size_t>(stride) +
               static_cast<std::size_t>(i)];
}

/// Nodes that each tile touches, once each.
struct TileSlots {
  std::vector<std::uint16_t> of_corner;  ///< by tiles (8)
  std::vector<int> first = {0};          ///< (tiles + 1)
  std::vector<int> node;                 ///< (slots)
  int most = 0;
};

/// Tiles from `begin` up to `end`, which touch nodes from first_node up to end_node; of_corner belongs to all
/// tiles.
template <typename CornerNode>
TileSlots find_slots(int begin, int end, int first_node, int end_node, const CornerNode& corner_node,
                     std::vector<std::uint16_t>& of_corner) {
  TileSlots slots;
  const auto nodes = static_cast<std::size_t>(end_node - first_node);
  std::vector<int> place(nodes, 0), tile_of(nodes, -1);
  const auto local = [&](int node) { return static_cast<std::size_t>(node - first_node); };
  for (int tile = begin; tile < end; ++tile) {
    const std::size_t first = static_cast<std::size_t>(tile) * SolidMesh::block;
    std::vector<int> own;
    for (std::size_t i = first; i < first + SolidMesh::block; ++i)
      for (std::size_t corner = 0; corner < 8; ++corner) {
        const int node = corner_node(i, corner);
        if (node < 0 || tile_of[local(node)] == tile) continue;
        tile_of[local(node)] = tile;
        own.push_back(node);
      }
    std::sort(own.begin(), own.end());
    for (std::size_t k = 0; k < own.size(); ++k) place[local(own[k])] = static_cast<int>(k);
    for (std::size_t i = first; i < first + SolidMesh::block; ++i)
      for (std::size_t corner = 0; corner < 8; ++corner)
        if (const int node = corner_node(i, corner); node >= 0)
          of_corner[SolidMesh::in_tile(i, corner, 8)] = static_cast<std::uint16_t>(place[local(node)]);
    slots.node.insert(slots.node.end(), own.begin(), own.end());
    slots.first.push_back(static_cast<int>(slots.node.size()));
    slots.most = std::max(slots.most, static_cast<int>(own.size()));
  }
  return slots;
}

/// corner_node(i, c): node of corner c of entry i, negative where there is no entry. blocks: of entries,
/// first of each group, `groups` of them a member.
template <typename CornerNode>
TileSlots find_slots(const std::vector<int>& blocks, std::size_t groups, const std::vector<int>& node_blocks,
                     const CornerNode& corner_node) {
  TileSlots all;
  all.of_corner.assign(8 * static_cast<std::size_t>(blocks.back()) * SolidMesh::block, 0);
  all.first.assign(static_cast<std::size_t>(blocks.front()) + 1, 0);  // the void block has none
  std::vector<TileSlots> parts(blocks.size() - 1);
  on_all_cores(parts.size(), [&](std::size_t k) {
    parts[k] = find_slots(blocks[k], blocks[k + 1], node_blocks[k / groups] * SolidMesh::block,
                          node_blocks[k / groups + 1] * SolidMesh::block, corner_node, all.of_corner);
  });
  for (const TileSlots& part : parts) {
    const int before = all.first.back();
    for (std::size_t t = 1; t < part.first.size(); ++t) all.first.push_back(before + part.first[t]);
    all.node.insert(all.node.end(), part.node.begin(), part.node.end());
    all.most = std::max(all.most, part.most);
  }
  return all;
}

/// The slots of each row, key(slot) its number: first of each (rows + 1), then the slots.
template <typename Key>
std::pair<std::vector<int>, std::vector<int>> slots_by(std::size_t rows, std::size_t slots, const Key& key) {
  std::vector<int> first(rows + 1, 0), sorted(slots);
  for (std::size_t slot = 0; slot < slots; ++slot) ++first[key(slot) + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<int> next(first.begin(), first.end() - 1);
  for (std::size_t slot = 0; slot < slots; ++slot)
    sorted[static_cast<std::size_t>(next[key(slot)]++)] = static_cast<int>(slot);
  return {std::move(first), std::move(sorted)};
}

}  // namespace

SolidMesh build_solid_mesh(const Scene& scene, const Grid& grid, const SolidParts& parts, int members) {
  SolidMesh mesh;
  const std::size_t cavities = scene.mechanics->cavities.size();
  mesh.surfaces.resize(scene.mechanics->boundary.size());
  mesh.held.resize(scene.mechanics->boundary.size());
  // Block 0 is void in every field.
  mesh.grid_cell.assign(SolidMesh::block, -1);
  mesh.region.assign(SolidMesh::block, 255);
  mesh.vertex.assign(SolidMesh::block, -1);
  mesh.item_cell.assign(SolidMesh::block, -1);
  mesh.item_cavity.assign(SolidMesh::block, 0);
  mesh.cells = mesh.nodes = mesh.items = SolidMesh::block;
  mesh.cell_blocks = mesh.node_blocks = mesh.item_blocks = {1};
  std::vector<double> faces(6 * SolidMesh::block, 0), shares(4 * SolidMesh::block, 0),
      item_shares(4 * SolidMesh::block, 0);
  std::vector<std::pair<int, std::vector<int>>> cell_nodes;  // first cell, (count, 8)
  std::vector<MemberMesh> prepared;
  for (int m = 0; m < members; ++m) prepared.emplace_back(scene, grid, parts, members, m);
  on_all_cores(prepared.size(), [&](std::size_t m) { prepared[m].prepare(); });
  for (MemberMesh& member : prepared) {
    const int first = mesh.cells;
    member.append(mesh);
    cell_nodes.emplace_back(first, std::move(member.mesh_nodes_));
    shares.insert(shares.end(), member.shares_.begin(), member.shares_.end());
    item_shares.insert(item_shares.end(), member.item_shares_.begin(), member.item_shares_.end());
    faces.insert(faces.end(), member.item_faces_.begin(), member.item_faces_.end());
  }

  const auto cells = static_cast<std::size_t>(mesh.cells), nodes = static_cast<std::size_t>(mesh.nodes),
             items = static_cast<std::size_t>(mesh.items);
  const auto by_tiles = [](const std::vector<double>& rows, std::size_t columns) {
    std::vector<double> result(rows.size());
    for (std::size_t i = 0; i < rows.size() / columns; ++i)
      for (std::size_t k = 0; k < columns; ++k)
        result[SolidMesh::in_tile(i, k, columns)] = rows[i * columns + k];
    return result;
  };
  mesh.share = by_tiles(shares, 4);
  mesh.item_share = by_tiles(item_shares, 4);
  mesh.cell_nodes.assign(8 * cells, 0);
  mesh.corners.assign(8 * nodes, 0);
  std::vector<double> mass(nodes, 0);
  const double h = grid.dx_mm, volume = h * h * h;
  constexpr double floor = SolidMesh::mass_floor;
  for (const auto& [first, list] : cell_nodes)
    for (std::size_t k = 0; k < list.size(); ++k) {
      const int cell = first + static_cast<int>(k / 8), corner = static_cast<int>(k % 8), node = list[k];
      at(mesh.cell_nodes, corner, mesh.cells, cell) = node;
      at(mesh.corners, corner, mesh.nodes, node) = cell;
      const auto quarter = [&](std::size_t g) {
        return std::max(shares[4 * static_cast<std::size_t>(cell) + g], floor);
      };
      mass[static_cast<std::size_t>(node)] +=
          0.03125 * volume * (quarter(0) + quarter(1) + quarter(2) + quarter(3));
    }
  TileSlots slots = find_slots(mesh.cell_blocks, 1, mesh.node_blocks, [&](std::size_t i, std::size_t corner) {
    return mesh.grid_cell[i] < 0 ? -1 : mesh.cell_nodes[corner * cells + i];
  });
  std::tie(mesh.first_slot, mesh.node_slots) = slots_by(
      nodes, slots.node.size(), [&](std::size_t slot) { return static_cast<std::size_t>(slots.node[slot]); });
  mesh.inverse_mass.resize(nodes);
  mesh.position.assign(3 * nodes, 0);
  for (std::size_t a = 0; a < nodes; ++a) {
    mesh.inverse_mass[a] = mass[a] > 0 ? 1 / mass[a] : 0;
    if (mesh.vertex[a] < 0) continue;
    const int v = mesh.vertex[a], vx = grid.cells[0] + 1, vy = grid.cells[1] + 1, vz = grid.cells[2] + 1;
    const Index3 index = {v % vx, v / vx % vy, v / (vx * vy) % vz};
    for (std::size_t axis = 0; axis < 3; ++axis)
      mesh.position[axis * nodes + a] = grid.origin_mm[axis] + h * index[axis];
  }

  mesh.item_faces = by_tiles(faces, 6);
  mesh.cavity_of.assign(nodes, -1);
  for (std::size_t j = 0; j < items; ++j) {
    if (mesh.item_cell[j] < 0) continue;
    for (int corner = 0; corner < 8; ++corner)
      mesh.cavity_of[static_cast<std::size_t>(at(mesh.cell_nodes, corner, mesh.cells, mesh.item_cell[j]))] =
          0;
  }
  for (int& place : mesh.cavity_of)
    if (place == 0) place = mesh.cavity_nodes++;
  mesh.cavity_block.assign(nodes / SolidMesh::block, 0);
  for (std::size_t a = 0; a < nodes; ++a)
    if (mesh.cavity_of[a] >= 0) mesh.cavity_block[a / SolidMesh::block] = 1;
  TileSlots of_items =
      find_slots(mesh.item_blocks, std::max<std::size_t>(1, cavities), mesh.node_blocks,
                 [&](std::size_t j, std::size_t corner) {
                   return mesh.item_cell[j] < 0
                              ? -1
                              : mesh.cell_nodes[corner * cells + static_cast<std::size_t>(mesh.item_cell[j])];
                 });
  std::vector<int> block_of(of_items.node.size());
  for (std::size_t b = 0; b + 1 < of_items.first.size(); ++b)
    std::fill(block_of.begin() + of_items.first[b], block_of.begin() + of_items.first[b + 1],
              static_cast<int>(b));
  std::tie(mesh.cavity_first, mesh.cavity_slots) = slots_by(
      cavities * static_cast<std::size_t>(mesh.cavity_nodes), of_items.node.size(), [&](std::size_t slot) {
        const std::size_t block = static_cast<std::size_t>(block_of[slot]) * SolidMesh::block;
        return static_cast<std::size_t>(mesh.item_cavity[block] * mesh.cavity_nodes +
                                        mesh.cavity_of[static_cast<std::size_t>(of_items.node[slot])]);
      });
  mesh.most_slots = std::max(slots.most, of_items.most);
  mesh.cell_slots = std::move(slots.of_corner);
  mesh.tile_slots = std::move(slots.first);
  mesh.slot_node = std::move(slots.node);
  mesh.item_slots = std::move(of_items.of_corner);
  mesh.item_tile_slots = std::move(of_items.first);
  mesh.item_slot_node = std::move(of_items.node);
  return mesh;
}

}  // namespace cohort
