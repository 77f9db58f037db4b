#include "solver/solid_mesh.hpp"

#include <algorithm>
#include <cmath>

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

  void append(SolidMesh& mesh) {
    find_tissue();
    number(mesh);
    for (std::size_t q = 0; q < cavity_void_.size(); ++q) append_cavity(mesh, q);
    for (std::size_t b = 0; b < surface_void_.size(); ++b) append_surface(mesh, b);
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
    if (sizes.empty()) defect_ = "there is no tissue to deform";
  }

  void number(SolidMesh& mesh) {
    const int first_cell = mesh.cells;
    const auto vx = static_cast<std::size_t>(n_[0] + 1), vy = static_cast<std::size_t>(n_[1] + 1),
               vz = static_cast<std::size_t>(n_[2] + 1);
    node_.assign(vx * vy * vz, -1);
    const auto vertex_of = [&](const Index3& c, int corner) {
      return static_cast<std::size_t>(c[0] + (corner & 1)) +
             vx * (static_cast<std::size_t>(c[1] + (corner >> 1 & 1)) +
                   vy * static_cast<std::size_t>(c[2] + (corner >> 2)));
    };
    int count = 0;
    for (std::size_t cell = 0; cell < cells_; ++cell) {
      if (local_[cell] < 0) continue;
      local_[cell] = first_cell + count++;
      mesh.grid_cell.push_back(static_cast<int>(first_ + cell));
      mesh.region.push_back(parts_.region[first_ + cell]);
      for (int g = 0; g < 4; ++g) shares_.push_back(quarter(cell, -1, g));
      const Index3 c = index(cell);
      for (int corner = 0; corner < 8; ++corner) node_[vertex_of(c, corner)] = 0;
    }
    mesh.tissue_cells.push_back(count);
    while (mesh.grid_cell.size() % SolidMesh::block != 0) {
      mesh.grid_cell.push_back(-1);
      mesh.region.push_back(255);
      shares_.insert(shares_.end(), 4, 0.0);
    }
    mesh.cells = static_cast<int>(mesh.grid_cell.size());
    mesh.cell_blocks.push_back(mesh.cells / SolidMesh::block);

    const std::size_t first_vertex = static_cast<std::size_t>(member_) * node_.size();
    for (std::size_t v = 0; v < node_.size(); ++v) {
      if (node_[v] < 0) continue;
      node_[v] = static_cast<int>(mesh.vertex.size());
      mesh.vertex.push_back(static_cast<int>(first_vertex + v));
    }
    while (mesh.vertex.size() % SolidMesh::block != 0) mesh.vertex.push_back(-1);
    mesh.nodes = static_cast<int>(mesh.vertex.size());
    mesh.node_blocks.push_back(mesh.nodes / SolidMesh::block);
    for (int i = first_cell; i < first_cell + count; ++i) {
      const Index3 c = index(static_cast<std::size_t>(mesh.grid_cell[static_cast<std::size_t>(i)]) - first_);
      for (int corner = 0; corner < 8; ++corner) nodes_.push_back(node_[vertex_of(c, corner)]);
    }
    first_cell_ = first_cell;
    count_ = count;
    mesh_nodes_.insert(mesh_nodes_.end(), nodes_.begin(), nodes_.end());
  }

  int node(int cell, int corner) const {
    return nodes_[static_cast<std::size_t>(8 * (cell - first_cell_) + corner)];
  }

  void append_cavity(SolidMesh& mesh, std::size_t q) {
    const int k = cavity_void_[q];
    std::array<double, 3> lid{};
    for (std::size_t axis = 0; axis < 3; ++axis) lid[axis] = origin_[axis] + 0.5 * h_ * n_[axis];
    const int across = find_lid(q, lid);
    mesh.lid.insert(mesh.lid.end(), lid.begin(), lid.end());
    for (int axis = 0; axis < 3; ++axis)
      mesh.lid.push_back(across < 0 ? 1.0 / 3 : axis == across ? 0.0 : 1.0 / 2);
    for (std::size_t cell = 0; cell < cells_; ++cell) {
      if (local_[cell] < 0) continue;
      std::array<double, 6> faces{};
      const double chi = void_share(cell, k);
      bool any = chi > 0;
      neighbours(cell, [&](int face, std::size_t next) {
        if (local_[next] >= 0) return;
        faces[static_cast<std::size_t>(face)] = void_weight(next, k);
        any = any || faces[static_cast<std::size_t>(face)] > 0;
      });
      if (!any) continue;
      mesh.item_cell.push_back(local_[cell]);
      mesh.item_cavity.push_back(static_cast<std::uint8_t>(q));
      for (int g = 0; g < 4; ++g) item_shares_.push_back(quarter(cell, k, g));
      item_faces_.insert(item_faces_.end(), faces.begin(), faces.end());
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

  /// The plane in which a cavity's blood meets what is neither tissue nor its own: the axis across it, -1 where
  /// there is none.
  int find_lid(std::size_t q, std::array<double, 3>& lid) {
    const int k = cavity_void_[q];
    int axis = -1, coordinate = 0;
    bool blood = false;
    for (std::size_t cell = 0; cell < cells_ && defect_.empty(); ++cell) {
      if (local_[cell] >= 0 || void_weight(cell, k) < 0.5) continue;
      blood = true;
      const Index3 c = index(cell);
      neighbours(cell, [&](int face, std::size_t next) {
        if (local_[next] >= 0 || void_weight(next, k) >= 0.5) return;
        const int a = face / 2, at = c[static_cast<std::size_t>(a)] + face % 2;
        if (axis < 0) {
          axis = a;
          coordinate = at;
        }
        if (a == axis && at == coordinate) return;
        defect_ = "the cavity \"" + scene_.mechanics->cavities[q].name +
                  "\" is not closed: tissue and one plane along the grid do not enclose it";
      });
    }
    if (axis >= 0) {
      const auto a = static_cast<std::size_t>(axis);
      lid[a] = origin_[a] + h_ * coordinate;
    }
    if (!blood && defect_.empty())
      defect_ = "the cavity \"" + scene_.mechanics->cavities[q].name + "\" holds no cell";
    return axis;
  }

  void append_surface(SolidMesh& mesh, std::size_t b) {
    const int k = surface_void_[b];
    const int first_node = mesh.node_blocks[static_cast<std::size_t>(member_)] * SolidMesh::block;
    const auto own_nodes = static_cast<std::size_t>(mesh.nodes - first_node);
    std::vector<std::array<double, 3>> area(own_nodes, {0, 0, 0});
    std::vector<bool> touched(own_nodes, false);
    const double quarter = 0.25 * h_ * h_;
    for (std::size_t cell = 0; cell < cells_; ++cell) {
      if (local_[cell] < 0) continue;
      const auto add = [&](int corner, std::size_t axis, double value) {
        const auto a = static_cast<std::size_t>(node(local_[cell], corner) - first_node);
        area[a][axis] += value;
        touched[a] = true;
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
    for (std::size_t a = 0; a < area.size(); ++a)
      if (touched[a]) mesh.surfaces[b].push_back({first_node + static_cast<int>(a), area[a]});
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
  std::string defect_;
};

template <typename T>
T& at(std::vector<T>& field, int component, int stride, int i) {
  return field[static_cast<std::size_t>(component) * static_cast<std::size_t>(stride) +
               static_cast<std::size_t>(i)];
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
  for (int m = 0; m < members; ++m) {
    MemberMesh member(scene, grid, parts, members, m);
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
      mass[static_cast<std::size_t>(node)] +=
0.03125 * volume *
          (std::max(at(mesh.share, 0, mesh.cells, cell), floor) + std::max(at(mesh.share, 1, mesh.cells, cell), floor) +
           std::max(at(mesh.share, 2, mesh.cells, cell), floor) + std::max(at(mesh.share, 3, mesh.cells, cell), floor));
    }
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
    for (int corner = 0; corner < 8; ++corner) {
      int& place = mesh.cavity_of[static_cast<std::size_t>(
          at(mesh.cell_nodes, corner, mesh.cells, mesh.item_cell[j]))];
      if (place < 0) place = mesh.cavity_nodes++;
    }
  }
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
