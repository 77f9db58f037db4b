#include "solver/solid_mesh.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <future>
#include <numeric>
#include <thread>

#include "solver/solid_member_mesh.hpp"

namespace cohort {

namespace {

using Index3 = std::array<int, 3>;

template <typename T>
T& at(std::vector<T>& field, int component, int stride, int i) {
  return field[static_cast<std::size_t>(component) * static_cast<std::size_t>(stride) +
               static_cast<std::size_t>(i)];
}

/// Members one by one on the cores that there are.
void prepare(std::vector<MemberMesh>& members) {
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t m = next++; m < members.size(); m = next++) members[m].prepare();
  };
  const std::size_t workers =
      std::min<std::size_t>(members.size(), std::max(1u, std::thread::hardware_concurrency()));
  std::vector<std::future<void>> others;
  for (std::size_t k = 1; k < workers; ++k) others.push_back(std::async(std::launch::async, work));
  work();
  for (std::future<void>& other : others) other.get();
}

/// Slots of the tiles, from the nodes of cells.
void number_slots(SolidMesh& mesh) {
  const int tiles = mesh.cells / SolidMesh::block;
  mesh.cell_slots.assign(8 * static_cast<std::size_t>(mesh.cells), 0);
  mesh.tile_slots.assign(1, 0);
  std::vector<int> place(static_cast<std::size_t>(mesh.nodes), 0), tile_of(place.size(), -1);
  std::vector<int> count(place.size() + 1, 0);
  for (int tile = 0; tile < tiles; ++tile) {
    const int first = mesh.tile_slots.back();
    std::vector<int> own;
    for (int i = tile * SolidMesh::block; i < (tile + 1) * SolidMesh::block; ++i) {
      if (mesh.grid_cell[static_cast<std::size_t>(i)] < 0) continue;
      for (int corner = 0; corner < 8; ++corner) {
        const int node = at(mesh.cell_nodes, corner, mesh.cells, i);
        const auto a = static_cast<std::size_t>(node);
        if (tile_of[a] != tile) {
          tile_of[a] = tile;
          own.push_back(node);
        }
      }
    }
    std::sort(own.begin(), own.end());
    for (std::size_t k = 0; k < own.size(); ++k) {
      place[static_cast<std::size_t>(own[k])] = static_cast<int>(k);
      ++count[static_cast<std::size_t>(own[k]) + 1];
    }
    for (int i = tile * SolidMesh::block; i < (tile + 1) * SolidMesh::block; ++i)
      for (int corner = 0; mesh.grid_cell[static_cast<std::size_t>(i)] >= 0 && corner < 8; ++corner)
        at(mesh.cell_slots, corner, mesh.cells, i) = static_cast<std::uint16_t>(
            place[static_cast<std::size_t>(at(mesh.cell_nodes, corner, mesh.cells, i))]);
    mesh.slot_node.insert(mesh.slot_node.end(), own.begin(), own.end());
    mesh.tile_slots.push_back(first + static_cast<int>(own.size()));
    mesh.most_slots = std::max(mesh.most_slots, static_cast<int>(own.size()));
  }
  std::partial_sum(count.begin(), count.end(), count.begin());
  mesh.first_slot = count;
  mesh.node_slots.resize(mesh.slot_node.size());
  for (std::size_t slot = 0; slot < mesh.slot_node.size(); ++slot)
    mesh.node_slots[static_cast<std::size_t>(count[static_cast<std::size_t>(mesh.slot_node[slot])]++)] =
        static_cast<int>(slot);
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
  prepare(prepared);
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
  const auto transposed = [](const std::vector<double>& rows, std::size_t columns) {
    std::vector<double> result(rows.size());
    const std::size_t n = rows.size() / columns;
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < columns; ++k) result[k * n + i] = rows[i * columns + k];
    return result;
  };
  mesh.share = transposed(shares, 4);
  mesh.item_share = transposed(item_shares, 4);
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
      mass[static_cast<std::size_t>(node)] += 0.03125 * volume *
                                              (std::max(at(mesh.share, 0, mesh.cells, cell), floor) +
                                               std::max(at(mesh.share, 1, mesh.cells, cell), floor) +
                                               std::max(at(mesh.share, 2, mesh.cells, cell), floor) +
                                               std::max(at(mesh.share, 3, mesh.cells, cell), floor));
    }
  number_slots(mesh);
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

  mesh.item_faces.assign(6 * items, 0);
  for (std::size_t j = 0; j < items; ++j)
    for (std::size_t face = 0; face < 6; ++face) mesh.item_faces[face * items + j] = faces[6 * j + face];
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
  mesh.cavity_corners.assign(cavities * 8 * static_cast<std::size_t>(mesh.cavity_nodes), -1);
  for (std::size_t j = 0; j < items; ++j) {
    if (mesh.item_cell[j] < 0) continue;
    for (int corner = 0; corner < 8; ++corner) {
      const int node = at(mesh.cell_nodes, corner, mesh.cells, mesh.item_cell[j]);
      at(mesh.cavity_corners, 8 * mesh.item_cavity[j] + corner, mesh.cavity_nodes,
         mesh.cavity_of[static_cast<std::size_t>(node)]) = static_cast<int>(j);
    }
  }
  return mesh;
}

}  // namespace cohort
