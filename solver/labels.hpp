#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "solver/distance_transform.hpp"
#include "solver/geometry.hpp"
#include "solver/label_conventions.hpp"
#include "solver/nifti.hpp"
#include "solver/tissue.hpp"

namespace cohort {

/// Codes of the parts that a voxel can belong to: background, blood pools (1 ...), regions (first_region_part
/// + r), and a conduction path that a delay stands for, until it gives way to what lies around it.
using Part = std::uint8_t;
inline constexpr Part no_part = 0, lv_blood_part = 1, rv_blood_part = 2, la_blood_part = 3, ra_blood_part = 4,
                      idle_path_part = 15, first_region_part = 16;
constexpr Part part_of(int region) {
  return static_cast<Part>(first_region_part + region);
}

/// Mean of points.
struct Mean {
  std::array<double, 3> sum{};
  double count = 0;
  void add(const std::array<double, 3>& p) {
    for (size_t i = 0; i < 3; ++i) sum[i] += p[i];
    ++count;
  }
  std::array<double, 3> value() const { return {sum[0] / count, sum[1] / count, sum[2] / count}; }
};

/// `image`: the image's millimetres (right, anterior, superior) are those of the heart's frame. `heart`: the
/// frame is found from the left ventricle and the direction of the right one (heart_frame).
enum class LabelFrame { image, heart };

struct LabelCells;
struct SolidLabels;

/// A label map with the meaning of its values: the geometry of a scene of kind `labels`. The same for all
/// members.
class LabelHeart {
 public:
  /// `name` stands for the file in messages. Without a frame: `image` for convention `cohort`, else `heart`.
  /// Throws std::invalid_argument: values that the table lacks (each with its number of voxels), no tissue, a
  /// frame that cannot be found.
  LabelHeart(LabelImage image, const std::string& name, const std::string& convention, LabelTable table,
             std::optional<LabelFrame> frame);

  /// The same heart where a delay stands for its conduction path (ConductionSystem::Kind::delay): no region
  /// of its own, and none is grown.
  std::shared_ptr<const LabelHeart> without_path() const;

  const std::shared_ptr<const LabelImage> shared_image;
  const LabelImage& image;
  const std::string convention;
  LabelFrame frame;
  LabelTable table;
  std::string sha256;                                         ///< of the file; set by who reads it
  std::vector<Region> regions;                                ///< those there are, or will be after growth
  std::vector<Part> part_of_label;                            ///< by place in image.labels
  bool grows_rv = false, grows_la = false, grows_ra = false;  ///< walls that the convention lacks
  bool grows_plate = false,
       grows_path = false;  ///< insulator between atria and ventricles, and the path through it
  bool idle_path = false;   ///< without_path(): its landmarks count, its cells do not conduct
  Affine to_heart;          ///< rigid, from the image's world to the heart's frame, mm
  /// What the comment of an export says: sites by name.
  std::vector<std::pair<std::string, Sphere>> sites;

  bool has(const std::string& region) const { return region_index(region) >= 0; }
  /// Index in `regions` or -1.
  int region_index(const std::string& region) const;
  bool has_blood(Part blood) const { return blood_voxels_[blood] > 0; }
  /// Extents in the heart's frame of a part's voxels; empty (lower > upper) where there are none.
  Extent part_extent(Part part) const { return part_extents_[part]; }

  /// Cells computed last (label_cells), for plan and simulation ask for the same. Copies start without.
  struct Cache {
    Cache() = default;
    Cache(const Cache&) {}
    std::mutex mutex;
    std::string key;
    std::shared_ptr<const LabelCells> cells;
    std::string solid_key;
    std::shared_ptr<const SolidLabels> solid;  ///< of the mechanics (solid_labels)
  };
  mutable Cache cache;

 private:
  void read_comment();
  void collect_regions(const std::string& name);
  void measure();

  std::vector<std::pair<std::string, bool>> excitable_;  // from the comment, by region
  std::array<std::int64_t, 256> blood_voxels_{};
  std::array<Extent, 256> part_extents_;
};

/// The rigid transform of LabelFrame::heart: origin where the long axis of the left ventricle's blood (from
/// its apex through its centroid) crosses the height of the mitral contact's centroid; z to the base, x to
/// the right ventricle, y = z x x. The mitral contact is where the ventricle's blood touches the left
/// atrium's; without an atrium, where it touches neither wall nor right ventricle. The apex is the voxel
/// farthest from the contact. Throws std::invalid_argument where blood or contact is missing.
Affine heart_frame(const LabelImage& image, const std::vector<Part>& part_of_label, int rv_part);

/// Where the table has walls but no blood (tags of meshes): background that the labels enclose becomes the
/// blood of the chamber whose wall it touches most, under new values that are added to the table. A pool of
/// which more than a quarter of the surface is wall of the right ventricle or an atrium is that chamber's,
/// else the left ventricle's. Pools smaller than 1 mL stay background.
LabelImage with_enclosed_blood(LabelImage image, LabelTable& table);

/// The heart sampled on a finer copy of the scene's grid: `per_cell` cells to each edge.
struct FineLabels {
  std::array<int, 3> cells{};
  std::array<double, 3> origin_mm{};
  double spacing_mm = 0;
  int per_cell = 1;
  int per_voxel = 1;  ///< cells to the shortest edge of a voxel, at least one
  std::vector<Part> parts;

  std::size_t at(int x, int y, int z) const {
    return std::size_t(x) + std::size_t(cells[0]) * (std::size_t(y) + std::size_t(cells[1]) * std::size_t(z));
  }
  std::array<double, 3> centre(int x, int y, int z) const {
    return {origin_mm[0] + spacing_mm * (x + 0.5), origin_mm[1] + spacing_mm * (y + 0.5),
            origin_mm[2] + spacing_mm * (z + 0.5)};
  }
};

/// Landmarks in the heart's frame, mm.
struct LabelLandmarks {
  double lv_length = 0;  ///< from the AV plane to the apex of the left ventricle's blood
  std::array<double, 3> node{}, his{}, end{};  ///< of the conduction path
  double path_radius = 0;
  std::vector<std::pair<std::string, Sphere>> sites;
};

/// Samples the labels and grows the walls, the plate and the path that the convention lacks.
FineLabels fine_labels(const Scene& scene, const Grid& grid, LabelLandmarks& landmarks);

/// The tissue of a label heart on the scene's grid. Same fields as classify_cells gives, and for each tissue
/// cell, in the order of the grid, what fibres and coordinates follow from.
struct LabelCells {
  Grid grid{};
  std::vector<std::uint8_t> region;  ///< (nz, ny, nx), 255 where there is no excitable tissue
  std::vector<float> fraction;
  std::vector<std::int32_t> tissue;  ///< grid cells that hold tissue, ascending
  std::vector<float> direction;      ///< (tissue, 4): normal of the wall, or axis, and u (unclamped)
  std::vector<float> coordinates;    ///< (tissue, 4): as tissue_coordinates in kernels/geometry_heart.clh
  LabelLandmarks landmarks;
  std::vector<double> volume_mL;  ///< by Part, of the fine labels
};

/// Computed once for a scene and kept with its label map.
std::shared_ptr<const LabelCells> label_cells(const Scene& scene);

/// How fibres follow from `direction` in each region; the table that kernels/labels.cl needs.
enum class LabelFibres { none = 0, helix = 1, circumferential = 2, along = 3, constant = 4 };
LabelFibres label_fibres(const LabelHeart& heart, const std::string& region);

}  // namespace cohort
