#include "solver/solid_member_mesh.hpp"

#include <algorithm>

#include "solver/solid_voids.hpp"

namespace cohort {

namespace {

// Cells with less tissue than this hold none, as in kernels/signed_distance.clh.
constexpr double minimal_fraction = 0.05;
// Pieces of tissue smaller than this share of the largest one are crumbs that nothing holds.
constexpr double smallest_piece = 0.01;

}  // namespace

MemberMesh::MemberMesh(const Scene& scene, const Grid& grid, const SolidParts& parts, int members, int member)
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

void MemberMesh::prepare() {
  find_tissue();
  find_items();
  for (const int k : surface_void_) surface_list_.push_back(find_surface(k));
  for (std::size_t q = 0; q < cavity_void_.size(); ++q) lid_list_.push_back(find_lid(q));
  order();
}

void MemberMesh::append(SolidMesh& mesh) {
  number(mesh);
  for (std::size_t q = 0; q < cavity_void_.size(); ++q) append_cavity(mesh, q);
  for (std::size_t b = 0; b < surface_void_.size(); ++b)
    for (const Corner& corner : surface_list_[b])
      mesh.surfaces[b].push_back({node_[corner.vertex], corner.area});
  mesh.defects.push_back(defect_);
}

std::size_t MemberMesh::place(const Index3& c) const {
  return static_cast<std::size_t>(c[0]) +
         static_cast<std::size_t>(n_[0]) * (static_cast<std::size_t>(c[1]) +
                                            static_cast<std::size_t>(n_[1]) * static_cast<std::size_t>(c[2]));
}

MemberMesh::Index3 MemberMesh::index(std::size_t cell) const {
  const auto nx = static_cast<std::size_t>(n_[0]), ny = static_cast<std::size_t>(n_[1]);
  return {static_cast<int>(cell % nx), static_cast<int>(cell / nx % ny), static_cast<int>(cell / (nx * ny))};
}

double MemberMesh::quarter(std::size_t cell, int k, int g) const {
  return parts_.counts[static_cast<std::size_t>(4 * (k + 1) + g) * all_ + first_ + cell] /
         double(parts_.samples);
}

double MemberMesh::part_share(std::size_t cell, int k) const {
  return 0.25 * (quarter(cell, k, 0) + quarter(cell, k, 1) + quarter(cell, k, 2) + quarter(cell, k, 3));
}

double MemberMesh::void_weight(std::size_t cell, int k) const {
  const double rest = 1 - share(cell);
  return rest > 0 ? std::min(1.0, void_share(cell, k) / rest) : 0;
}

void MemberMesh::find_tissue() {
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

void MemberMesh::find_items() {
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

std::vector<MemberMesh::Corner> MemberMesh::find_surface(int k) const {
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
  std::sort(found.begin(), found.end(), [](const Corner& a, const Corner& b) { return a.vertex < b.vertex; });
  return found;
}

std::size_t MemberMesh::vertices() const {
  return static_cast<std::size_t>(n_[0] + 1) * static_cast<std::size_t>(n_[1] + 1) *
         static_cast<std::size_t>(n_[2] + 1);
}

std::size_t MemberMesh::vertex_of(std::size_t cell, int corner) const {
  const Index3 c = index(cell);
  const auto vx = static_cast<std::size_t>(n_[0] + 1), vy = static_cast<std::size_t>(n_[1] + 1);
  return static_cast<std::size_t>(c[0] + (corner & 1)) +
         vx * (static_cast<std::size_t>(c[1] + (corner >> 1 & 1)) +
               vy * static_cast<std::size_t>(c[2] + (corner >> 2)));
}

void MemberMesh::sort_to_tiles(std::vector<std::size_t>::iterator first,
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

void MemberMesh::order() {
  for (std::size_t cell = 0; cell < cells_; ++cell)
    if (local_[cell] >= 0) cell_order_.push_back(cell);
  sort_to_tiles(cell_order_.begin(), cell_order_.end());
  for (std::vector<Item>& items : item_list_) {
    std::vector<std::size_t> of_items;
    std::vector<std::size_t> place(cells_, 0);
    for (std::size_t k = 0; k < items.size(); ++k) {
      of_items.push_back(items[k].cell);
      place[items[k].cell] = k;
    }
    if (of_items.empty()) continue;
    sort_to_tiles(of_items.begin(), of_items.end());
    std::vector<Item> sorted;
    for (const std::size_t cell : of_items) sorted.push_back(items[place[cell]]);
    items = std::move(sorted);
  }
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

void MemberMesh::number(SolidMesh& mesh) {
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

void MemberMesh::append_cavity(SolidMesh& mesh, std::size_t q) {
  const int k = cavity_void_[q];
  const Lid& lid = lid_list_[q];
  mesh.lid.insert(mesh.lid.end(), lid.point.begin(), lid.point.end());
  for (int axis = 0; axis < 3; ++axis)
    mesh.lid.push_back(lid.axis < 0 ? 1.0 / 3 : axis == lid.axis ? 0.0 : 1.0 / 2);
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

std::string MemberMesh::cavity_path(std::size_t q) const {
  return "mechanics.cavities." + scene_.mechanics->cavities[q].name + ": the cavity";
}

MemberMesh::Lid MemberMesh::find_lid(std::size_t q) {
  const int k = cavity_void_[q];
  Lid lid{-1, {}};
  int& axis = lid.axis;
  int coordinate = 0;
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
    lid.point[a] = origin_[a] + h_ * static_cast<double>(static_cast<int>(a) == axis ? coordinate
                                                         : blood > 0                 ? sum[a] / blood
                                                                                     : 0);
  if (blood == 0 && defect_.empty())
    defect_ = cavity_path(q) + " holds no cell: no cell of the grid is mostly its blood";
  return lid;
}

}  // namespace cohort
