#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "solver/solid_mesh.hpp"

namespace cohort {

/// One member's cells on the way to the mesh.
class MemberMesh {
  using Index3 = std::array<int, 3>;

 public:
  MemberMesh(const Scene& scene, const Grid& grid, const SolidParts& parts, int members, int member);

  /// All that does not depend on other members.
  void prepare();
  void append(SolidMesh& mesh);

 private:
  std::size_t place(const Index3& c) const;
  Index3 index(std::size_t cell) const;
  /// Share of quarter g of a cell in part k + 1 (tissue: k = -1).
  double quarter(std::size_t cell, int k, int g) const;
  double part_share(std::size_t cell, int k) const;
  double share(std::size_t cell) const { return part_share(cell, -1); }
  /// Share of a cell in void k (-1: none).
  double void_share(std::size_t cell, int k) const { return k < 0 ? 0 : part_share(cell, k); }
  /// Share of what is no tissue in a cell outside the mesh.
  double void_weight(std::size_t cell, int k) const;
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
  void find_tissue();

  /// Cells that touch a cavity, by their own blood or by a face behind which blood lies.
  void find_items();

  /// A vertex of a surface and its area vector.
  struct Corner {
    std::size_t vertex;
    std::array<double, 3> area;
  };
  /// The surface of void k, by vertices along the grid.
  std::vector<Corner> find_surface(int k) const;

  std::size_t vertices() const;
  std::size_t vertex_of(std::size_t cell, int corner) const;

  /// Orders cells so that each block of them is compact: halves of whole blocks across the longest side,
  /// again and again; within a block along the grid.
  void sort_to_tiles(std::vector<std::size_t>::iterator first, std::vector<std::size_t>::iterator last) const;

  /// Cells by tiles, each cavity's items likewise; vertices by kind, those of one kind by tiles: those of
  /// cavities first, of each the ones on a surface.
  void order();

  void number(SolidMesh& mesh);

  void append_cavity(SolidMesh& mesh, std::size_t q);

  std::string cavity_path(std::size_t q) const;
  /// The plane in which a cavity's blood meets what is neither tissue nor its own.
  struct Lid {
    int axis;  ///< across it, -1 where there is none
    std::array<double, 3> point;
  };
  Lid find_lid(std::size_t q);

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
  std::vector<Lid> lid_list_;                      // by cavity
  std::string defect_;
};

}  // namespace cohort
