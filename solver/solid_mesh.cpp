#include "solver/solid_mesh.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <future>
#include <numeric>
#include <thread>

#include "solver/solid_voids.hpp"

namespace cohort {

namespace {

// Cells with less tissue than this hold none, as in kernels/signed_distance.clh.
constexpr double minimal_fraction = 0.05;
// Pieces of tissue smaller than this share of the largest one are crumbs that nothing holds.
constexpr double smallest_piece = 0.01;

using Index3 = std::array<int, 3>;

/// One member's cells on the way to the mesh.
class MemberMesh {
 public:
  MemberMesh(const Scene& scene, const Grid& grid, const SolidParts& parts, int members, int member)
      : scene_(scene),
        n_(grid.cells),
        h_(grid.dx_mm),
        origin_(grid.origin_mm),
        cells_(static_cast<std::size_t>(grid.size())),
        first_(static_cast<std::size_t>(member) * cells_),
        all_(cells_ * static_cast<std::size_t>(members)),
        member_(member),
        parts_(parts) {
    for (const Mechanics::Cavity& cavity : scene.mechanics->cavities)
      cavity_void_.push_back(void_of_cavity(scene, cavity));
    for (const Mechanics::Boundary& boundary : scene.mechanics->boundary)
      surface_void_.push_back(void_of_surface(scene, boundary.surface));
  }

  /// All that does not depend on other members.
  void prepare() {
    find_tissue();
    find_items();
    for (const int k : surface_void_) surface_list_.push_back(find_surface(k));
    order();
  }
  void append(SolidMesh& mesh) {
    number(mesh);
    for (std::size_t q = 0; q < cavity_void_.size(); ++q) append_cavity(mesh, q);
    for (std::size_t b = 0; b < surface_void_.size(); ++b)
      for (const Corner& corner : surface_list_[b])
        mesh.surfaces[b].push_back({node_[corner.vertex], corner.area});
    mesh.defects.push_back(defect_);
  }

 private:
  std::size_t place(const Index3& c) const {
    return static_cast<std::size_t>(c[0]) +
           static_cast<std::size_t>(n_[0]) *
               (static_cast<std::size_t>(c[1]) +
                static_cast<std::size_t>(n_[1]) * static_cast<std::size_t>(c[2]));
  }
  Index3 index(std::size_t cell) const {
    const auto nx = static_cast<std::size_t>(n_[0]), ny = static_cast<std::size_t>(n_[1]);
    return {static_cast<int>(cell % nx), static_cast<int>(cell / nx % ny),
            static_cast<int>(cell / (nx * ny))};
  }
  /// Share of quarter g of a cell in part k + 1 (tissue: k = -1).
  double quarter(std::size_t cell, int k, int g) const {
    return parts_.counts[static_cast<std::size_t>(4 * (k + 1) + g) * all_ + first_ + cell] /
           double(parts_.samples);
  }
  double part_share(std::size_t cell, int k) const {
    return 0.25 * (quarter(cell, k, 0) + quarter(cell, k, 1) + quarter(cell, k, 2) + quarter(cell, k, 3));
  }
  double share(std::size_t cell) const { return part_share(cell, -1); }
  /// Share of a cell in void k (-1: none).
  double void_share(std::size_t cell, int k) const { return k < 0 ? 0 : part_share(cell, k); }
  /// Share of what is no tissue in a cell outside the mesh.
  double void_weight(std::size_t cell, int k) const {
    const double rest = 1 - share(cell);
    return rest > 0 ? std::min(1.0, void_share(cell, k) / rest) : 0;
  }
  template <typename Visit>
  void neighbours(std::size_t cell, const Visit& visit) const {
    const Index3 c = index(cell);
    for (int face = 0; face < 6; ++face) {
      Index3 next = c;
      const auto axis = static_cast<std::size_t>(face / 2);
      next[axis] += face % 2 ? 1 : -1;
      if (next[axis] >= 0 && next[axis] < n_[axis]) visit(face, place(next));
    }
  }

  /// Cells of the mesh: enough tissue, in a piece of some size.
  void find_tissue() {
    local_.assign(cells_, -1);
    std::vector<int> piece(cells_, -1);
    std::vector<std::size_t> sizes, stack;
    for (std::size_t start = 0; start < cells_; ++start) {
      if (piece[start] >= 0 || share(start) < minimal_fraction) continue;
      const int name = static_cast<int>(sizes.size());
      sizes.push_back(0);
      stack.assign(1, start);
      piece[start] = name;
      while (!stack.empty()) {
        const std::size_t cell = stack.back();
        stack.pop_back();
        ++sizes.back();
        neighbours(cell, [&](int, std::size_t next) {
          if (piece[next] >= 0 || share(next) < minimal_fraction) return;
          piece[next] = name;
          stack.push_back(next);
        });
      }
    }
    const double largest =
        sizes.empty() ? 0 : static_cast<double>(*std::max_element(sizes.begin(), sizes.end()));
    for (std::size_t cell = 0; cell < cells_; ++cell)
      if (piece[cell] >= 0 &&
          static_cast<double>(sizes[static_cast<std::size_t>(piece[cell])]) >= smallest_piece * largest)
        local_[cell] = 0;
    if (sizes.empty()) defect_ = "mechanics: there is no tissue to deform";
  }

  /// Cells that touch a cavity, by their own blood or by a face behind which blood lies.
  void find_items() {
    for (const int k : cavity_void_) {
      item_list_.emplace_back();
      for (std::size_t cell = 0; cell < cells_; ++cell) {
        if (local_[cell] < 0) continue;
        Item item{cell, {}};
        bool any = void_share(cell, k) > 0;
        neighbours(cell, [&](int face, std::size_t next) {
          if (local_[next] >= 0) return;
          const double weight = void_weight(next, k);
          item.faces[static_cast<std::size_t>(face)] = weight;
          any = any || weight > 0;
        });
        if (any) item_list_.back().push_back(item);
      }
    }
  }

  /// A vertex of a surface and its area vector.
  struct Corner {
    std::size_t vertex;
    std::array<double, 3> area;
  };
  /// The surface of void k, by vertices along the grid.
  std::vector<Corner> find_surface(int k) const {
    std::vector<Corner> found;
    std::vector<int> place(vertices(), -1);
    const double quarter = 0.25 * h_ * h_;
    for (std::size_t cell = 0; cell < cells_; ++cell) {
      if (local_[cell] < 0) continue;
      const auto add = [&](int corner, std::size_t axis, double value) {
        const std::size_t vertex = vertex_of(cell, corner);
        if (place[vertex] < 0) {
          place[vertex] = static_cast<int>(found.size());
          found.push_back({vertex, {0, 0, 0}});
        }
        found[static_cast<std::size_t>(place[vertex])].area[axis] += value;
      };
      if (const double chi = void_share(cell, k); chi > 0)
        for (int corner = 0; corner < 8; ++corner)
          for (std::size_t axis = 0; axis < 3; ++axis)
            add(corner, axis, (corner >> axis & 1 ? -chi : chi) * quarter);
      neighbours(cell, [&](int face, std::size_t next) {
        const double weight = local_[next] >= 0 ? 0 : void_weight(next, k);
        if (!(weight > 0)) return;
        const int axis = face / 2;
        for (int corner = 0; corner < 8; ++corner)
          if ((corner >> axis & 1) == face % 2)
            add(corner, static_cast<std::size_t>(axis), (face % 2 ? weight : -weight) * quarter);
      });
    }
    std::sort(found.begin(), found.end(),
              [](const Corner& a, const Corner& b) { return a.vertex < b.vertex; });
    return found;
  }

  std::size_t vertices() const {
    return static_cast<std::size_t>(n_[0] + 1) * static_cast<std::size_t>(n_[1] + 1) *
           static_cast<std::size_t>(n_[2] + 1);
  }
  std::size_t vertex_of(std::size_t cell, int corner) const {
    const Index3 c = index(cell);
    const auto vx = static_cast<std::size_t>(n_[0] + 1), vy = static_cast<std::size_t>(n_[1] + 1);
    return static_cast<std::size_t>(c[0] + (corner & 1)) +
           vx * (static_cast<std::size_t>(c[1] + (corner >> 1 & 1)) +
                 vy * static_cast<std::size_t>(c[2] + (corner >> 2)));
  }

  /// Orders cells so that each block of them is compact: halves of whole blocks across the longest side,
  /// again and again; within a block along the grid.
  void sort_to_tiles(std::vector<std::size_t>::iterator first,
                     std::vector<std::size_t>::iterator last) const {
    const auto blocks = (last - first + SolidMesh::block - 1) / SolidMesh::block;
    if (blocks <= 1) {
      std::sort(first, last);
      return;
    }
    Index3 low = index(*first), high = low;
    for (auto it = first; it != last; ++it) {
      const Index3 c = index(*it);
      for (std::size_t a = 0; a < 3; ++a) {
        low[a] = std::min(low[a], c[a]);
        high[a] = std::max(high[a], c[a]);
      }
    }
    std::size_t axis = 0;
    for (std::size_t a = 1; a < 3; ++a)
      if (high[a] - low[a] > high[axis] - low[axis]) axis = a;
    const auto middle = first + blocks / 2 * SolidMesh::block;
    std::nth_element(first, middle, last, [&](std::size_t a, std::size_t b) {
      const int x = index(a)[axis], y = index(b)[axis];
      return x != y ? x < y : a < b;
    });
    sort_to_tiles(first, middle);
    sort_to_tiles(middle, last);
  }

  /// Cells by tiles; vertices by kind, those of one kind by tiles: those of cavities first, of each the ones
  /// on a surface.
  void order() {
    for (std::size_t cell = 0; cell < cells_; ++cell)
      if (local_[cell] >= 0) cell_order_.push_back(cell);
    sort_to_tiles(cell_order_.begin(), cell_order_.end());
    constexpr int none = -1, inside = -2, on_surface = -3, of_cavity = -4, of_both = -5;
    node_.assign(vertices(), none);
    for (const std::size_t cell : cell_order_)
      for (int corner = 0; corner < 8; ++corner) node_[vertex_of(cell, corner)] = inside;
    for (const std::vector<Corner>& surface : surface_list_)
      for (const Corner& corner : surface) node_[corner.vertex] = on_surface;
    for (const std::vector<Item>& items : item_list_)
      for (const Item& item : items)
        for (int corner = 0; corner < 8; ++corner) {
          int& kind = node_[vertex_of(item.cell, corner)];
          kind = kind == on_surface || kind == of_both ? of_both : of_cavity;
        }
    for (const int kind : {of_both, of_cavity, on_surface, inside})
      for (const std::size_t cell : cell_order_)
        for (int corner = 0; corner < 8; ++corner) {
          const std::size_t v = vertex_of(cell, corner);
          if (node_[v] != kind) continue;
          node_[v] = static_cast<int>(vertex_order_.size());
          vertex_order_.push_back(v);
        }
  }

  void number(SolidMesh& mesh) {
    first_cell_ = mesh.cells;
    count_ = static_cast<int>(cell_order_.size());
    for (std::size_t k = 0; k < cell_order_.size(); ++k) {
      const std::size_t cell = cell_order_[k];
      local_[cell] = first_cell_ + static_cast<int>(k);
      mesh.grid_cell.push_back(static_cast<int>(first_ + cell));
      mesh.region.push_back(parts_.region[first_ + cell]);
      for (int g = 0; g < 4; ++g) shares_.push_back(quarter(cell, -1, g));
    }
    mesh.tissue_cells.push_back(count_);
    while (mesh.grid_cell.size() % SolidMesh::block != 0) {
      mesh.grid_cell.push_back(-1);
      mesh.region.push_back(255);
      shares_.insert(shares_.end(), 4, 0.0);
    }
    mesh.cells = static_cast<int>(mesh.grid_cell.size());
    mesh.cell_blocks.push_back(mesh.cells / SolidMesh::block);

    const std::size_t first_vertex = static_cast<std::size_t>(member_) * vertices();
    const int first_node = static_cast<int>(mesh.vertex.size());
    for (const std::size_t v : vertex_order_) {
      node_[v] += first_node;
      mesh.vertex.push_back(static_cast<int>(first_vertex + v));
    }
    while (mesh.vertex.size() % SolidMesh::block != 0) mesh.vertex.push_back(-1);
    mesh.nodes = static_cast<int>(mesh.vertex.size());
    mesh.node_blocks.push_back(mesh.nodes / SolidMesh::block);
    for (const std::size_t cell : cell_order_)
      for (int corner = 0; corner < 8; ++corner) nodes_.push_back(node_[vertex_of(cell, corner)]);
    mesh_nodes_ = nodes_;
  }

  int node(int cell, int corner) const {
    return nodes_[static_cast<std::size_t>(8 * (cell - first_cell_) + corner)];
  }

  void append_cavity(SolidMesh& mesh, std::size_t q) {
    const int k = cavity_void_[q];
    std::array<double, 3> lid{};
    const int across = find_lid(q, lid);
    mesh.lid.insert(mesh.lid.end(), lid.begin(), lid.end());
    for (int axis = 0; axis < 3; ++axis)
      mesh.lid.push_back(across < 0 ? 1.0 / 3 : axis == across ? 0.0 : 1.0 / 2);
    for (const Item& item : item_list_[q]) {
      mesh.item_cell.push_back(local_[item.cell]);
      mesh.item_cavity.push_back(static_cast<std::uint8_t>(q));
      for (int g = 0; g < 4; ++g) item_shares_.push_back(quarter(item.cell, k, g));
      item_faces_.insert(item_faces_.end(), item.faces.begin(), item.faces.end());
    }
    while (mesh.item_cell.size() % SolidMesh::block != 0) {
      mesh.item_cell.push_back(-1);
      mesh.item_cavity.push_back(static_cast<std::uint8_t>(q));
      item_shares_.insert(item_shares_.end(), 4, 0.0);
      item_faces_.insert(item_faces_.end(), 6, 0.0);
    }
    mesh.items = static_cast<int>(mesh.item_cell.size());
    mesh.item_blocks.push_back(mesh.items / SolidMesh::block);
  }

  std::string cavity_path(std::size_t q) const {
    return "mechanics.cavities." + scene_.mechanics->cavities[q].name + ": the cavity";
  }
  /// The plane in which a cavity's blood meets what is neither tissue nor its own: the axis across it, -1
  /// where there is none.
  int find_lid(std::size_t q, std::array<double, 3>& lid) {
    const int k = cavity_void_[q];
    int axis = -1, coordinate = 0;
    std::int64_t blood = 0;
    std::array<std::int64_t, 3> sum{};
    for (std::size_t cell = 0; cell < cells_ && defect_.empty(); ++cell) {
      if (local_[cell] >= 0 || void_weight(cell, k) < 0.5) continue;
      ++blood;
      const Index3 c = index(cell);
      for (std::size_t a = 0; a < 3; ++a) sum[a] += c[a];
      neighbours(cell, [&](int face, std::size_t next) {
        if (local_[next] >= 0 || void_weight(next, k) >= 0.5) return;
        const int a = face / 2, at = c[static_cast<std::size_t>(a)] + face % 2;
        if (axis < 0) {
          axis = a;
          coordinate = at;
        }
        if (a == axis && at == coordinate) return;
        defect_ =
            cavity_path(q) + " is not closed: tissue and one plane along the grid do not enclose its blood";
      });
      for (std::size_t a = 0; a < 3 && defect_.empty(); ++a)
        if (c[a] == 0 || c[a] == n_[a] - 1)
          defect_ = cavity_path(q) + " is not closed: its blood reaches the border of the grid";
    }
    // Along the plane the vertex at the blood's middle: a place of the cavity, wherever the grid begins.
    for (std::size_t a = 0; a < 3; ++a)
      lid[a] = origin_[a] + h_ * static_cast<double>(static_cast<int>(a) == axis ? coordinate
                                                     : blood > 0                 ? sum[a] / blood
                                                                                 : 0);
    if (blood == 0 && defect_.empty())
      defect_ = cavity_path(q) + " holds no cell: no cell of the grid is mostly its blood";
    return axis;
  }

 public:
  std::vector<int> mesh_nodes_;               // (count, 8) of this member's cells
  std::vector<double> item_faces_;            // (items of this member, 6)
  std::vector<double> shares_, item_shares_;  // (cells, 4), (items, 4)

 private:
  const Scene& scene_;
  Index3 n_;
  double h_;
  std::array<double, 3> origin_;
  std::size_t cells_, first_, all_;
  int member_, first_cell_ = 0, count_ = 0;
  const SolidParts& parts_;
  std::vector<int> cavity_void_, surface_void_;
  std::vector<int> local_;  // mesh cell of a grid cell, or -1
  std::vector<int> node_;   // mesh node of a vertex, or -1
  std::vector<int> nodes_;
  std::vector<std::size_t> cell_order_, vertex_order_;
  struct Item {
    std::size_t cell;
    std::array<double, 6> faces;
  };
  std::vector<std::vector<Item>> item_list_;       // by cavity
  std::vector<std::vector<Corner>> surface_list_;  // by boundary condition
  std::string defect_;
};

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
