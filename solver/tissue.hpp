#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "solver/launch.hpp"
#include "solver/scene.hpp"

namespace cohort {

struct LabelCells;

/// The grid that holds the members of a campaign: cells (nx, ny, nz), nx a multiple of 8, faces on multiples
/// of dx.
struct Grid {
  std::array<int, 3> cells;
  std::array<double, 3> origin_mm;
  double dx_mm;
  Real4 origin_and_spacing() const { return {origin_mm[0], origin_mm[1], origin_mm[2], dx_mm}; }
  std::int64_t size() const { return std::int64_t{cells[0]} * cells[1] * cells[2]; }
};

/// The smallest grid with a free layer of cells around the tissue of every member.
Grid make_grid(const Scene& scene, std::span<const Member> members);

/// Generated source and -D options that every program of a scene shares: parameter macros, regions, grid,
/// precision.
struct Definitions {
  std::string generated;
  std::vector<std::string> options;
  /// Program of `files` with these and `more` options.
  cl::Program build(Device& device, const std::vector<std::string>& files,
                    const std::vector<std::string>& more = {}) const;
};
Definitions scene_definitions(const Scene& scene, const Grid& grid);

/// Tissue of a batch of members in compact form (kernels/segments.clh): segments of 8 cells, member after
/// member, each member padded to whole blocks of 32 segments with at least one void segment at its end.
class Tissue {
 public:
  static constexpr int lanes = 8, first_cell_place = 32, block_cells = 256;
  /// Work-items of a group in kernels over cells: divides every stride. Given always, since PoCL compiles a
  /// kernel anew for each group size that it chooses itself.
  static constexpr std::size_t group = 64;

  /// Which regions it is made of: those that are excitable, or what conducts in the bidomain equations, these
  /// and the bath.
  enum class Holds { excitable, conductors };

  Tissue(Launcher& launcher, const Scene& scene, const Grid& grid, int members,
         Holds holds = Holds::excitable);

  /// Evaluates the geometry of `members` members, whose blocks stand in `parameters` (members, table size),
  /// and fills everything below. Throws std::runtime_error where device memory does not suffice.
  void build(const cl::Buffer& parameters, int members);
  /// Fibre directions of the tissue built last, (3, stride).
  void build_fibres(const cl::Buffer& parameters);

  /// Coordinates of the tissue built last, (4, stride): see `coordinates`.
  void build_coordinates(const cl::Buffer& parameters);

  /// Types of the grid's vertices after build(): (members, nz+1, ny+1, nx+1), 0 outside, 1 solid, 2 surface.
  std::vector<std::uint8_t> vertices(int members);

  int stride = 0;                          ///< cells of a compact field, void ones included
  int blocks = 0;                          ///< blocks of 256 cells over all members
  std::vector<int> first_block;            ///< (members + 1)
  std::vector<std::int64_t> tissue_cells;  ///< by member
  std::vector<std::uint8_t> regions;       ///< (stride) host copy of `region`
  std::vector<int> first_cells;  ///< (stride / 8) grid cell of each segment, counted over members, or -1
  std::vector<int> places;       ///< (members, nz, ny, nx/8) segment of each run of the grid, 1 where void
  /// By member: tissue reaches the outermost cells of the grid, where neighbours would be missing.
  std::vector<bool> touches_boundary;

  cl::Buffer first_cell, place, member_of, neighbours, region, capacity, inverse_capacity, fibre;
  /// (4, stride), after build_coordinates(): transmural 0 (endocardium) to 1, apico-basal 0 (apex) to 1
  /// (base), angle around the axis (radians, 0 at the septum), signed distance in mm to the nearest
  /// endocardium.
  cl::Buffer coordinates;

  const Grid& grid() const { return grid_; }
  /// Place in the compact fields of a grid cell of member m; nothing where it is no tissue.
  std::optional<std::size_t> cell_at(const std::array<std::int64_t, 3>& cell, std::size_t m) const;
  /// Centre of the tissue cell at a place of the compact fields, mm.
  std::array<double, 3> centre(std::size_t place_in_fields) const;
  /// Device bytes for `members` members with `stride` compact cells in all.
  static std::size_t bytes(const Grid& grid, int members, std::int64_t stride, Precision precision);

 private:
  void compact(const std::vector<std::uint8_t>& flags, int members);
  void upload_labels(int members);
  void build_label_tables();

  Launcher& launcher_;
  Device& device_;
  Precision precision_;
  Grid grid_;
  Definitions definitions_;
  cl::Buffer grid_region_, grid_fraction_, flag_;
  std::shared_ptr<const LabelCells> labels_;  // geometry `labels`: its cells, the same for all members
  cl::Buffer label_direction_, label_coordinates_;
  int label_members_ = 0;
  int capacity_members_ = 0, capacity_stride_ = 0, coordinates_stride_ = 0;
  Launcher::Handle classify_, classify_vertices_, flag_segments_, gather_, link_, fibre_field_,
      coordinate_field_;
};

}  // namespace cohort
