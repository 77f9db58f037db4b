// Cells of the mechanics from a label map: shares of tissue and voids, what lies near vertices, where fibres
// follow from.
#include "solver/solid_labels.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "solver/label_coordinates.hpp"
#include "solver/labels.hpp"
#include "solver/mechanics_structure.hpp"
#include "solver/solid_voids.hpp"

namespace cohort {

namespace {

constexpr int no_void = -1, outside_ventricles = -6, above_base = -7, outside_atria = -8, below_atria = -9,
              vessels = -10;  // as -1 - k of void k of the heart
constexpr std::uint8_t no_region = 255;

/// What a part of the label map is for the mechanics at a height: a region (>= 0), or -1 - k in void k of
/// the heart (solid_voids). The planes lie on faces of the grid.
class PartRule {
 public:
  PartRule(const Scene& scene, const Grid& grid)
      : heart_(*scene.labels), walls_(deforming_walls(*scene.mechanics)) {
    const auto face = [&](double z) {
      return grid.origin_mm[2] + grid.dx_mm * std::round((z - grid.origin_mm[2]) / grid.dx_mm);
    };
    base_ = face(scene.parameters.value("mechanics.base_mm"));
    if (walls_.atria())
      atrial_base_ = std::max(face(scene.parameters.value("mechanics.atrial_base_mm")), base_ + grid.dx_mm);
    for (std::size_t r = 0; r < heart_.regions.size(); ++r) {
      const std::string& name = heart_.regions[r].name;
      const bool inert = label_fibres(heart_, name) == LabelFibres::none;
      if (name == "la" || name == "ra" || name == "bachmann")
        kinds_.push_back(name == "la"             ? (walls_.la ? Kind::atrial : Kind::none)
                         : name == "ra"           ? (walls_.ra ? Kind::atrial : Kind::none)
                         : walls_.la && walls_.ra ? Kind::atrial
                                                  : Kind::none);
      else if (name == "insulator" || name == "conduction_path")
        kinds_.push_back(name == "insulator" ? Kind::between : Kind::path);
      else
        kinds_.push_back(inert ? Kind::vessel : Kind::ventricular);
    }
  }
  int operator()(Part part, double z) const {
    const bool region = part >= first_region_part;
    const int r = part - first_region_part;
    const Kind kind = region ? kinds_[static_cast<std::size_t>(r)] : Kind::none;
    if (z < base_) {
      if (!walls_.ventricles) return above_base;
      if (part == lv_blood_part || part == rv_blood_part) return -1 - part;
      return kind == Kind::ventricular || kind == Kind::path ? r : outside_ventricles;
    }
    if (!walls_.atria()) return above_base;
    if (z < atrial_base_) return z < 0.5 * (base_ + atrial_base_) ? above_base : below_atria;
    if ((part == la_blood_part && walls_.la) || (part == ra_blood_part && walls_.ra)) return -1 - part;
    // Fat between the atria and what passes them closes their walls.
    if (kind == Kind::atrial || kind == Kind::between || kind == Kind::path) return r;
    const bool ventricular = kind == Kind::ventricular || part == lv_blood_part || part == rv_blood_part;
    return ventricular || kind == Kind::vessel ? vessels : outside_atria;
  }

 private:
  enum class Kind { none, ventricular, atrial, between, path, vessel };
  const LabelHeart& heart_;
  DeformingWalls walls_;
  double base_, atrial_base_ = 0;
  std::vector<Kind> kinds_;
};

/// The points of stress of a cell lie next to the centres of four of its eight parts (kernels/solid.clh):
/// signs of point g.
constexpr int signs[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};

/// Shares of a cell's quarters, as in kernels/solid_setup.cl: each fine cell to the nearest point.
void count(const FineLabels& fine, const PartRule& rule, const Grid& grid, std::size_t voids,
           SolidLabels& result) {
  const int k = 2 * fine.per_cell;
  const auto cells = static_cast<std::size_t>(grid.size());
  std::vector<std::array<std::uint16_t, 4>> quarters(
      static_cast<std::size_t>(k) * static_cast<std::size_t>(k) * static_cast<std::size_t>(k));
  for (int c = 0; c < k * k * k; ++c) {
    const double x = c % k + 0.5 - 0.5 * k, y = c / k % k + 0.5 - 0.5 * k, z = c / (k * k) + 0.5 - 0.5 * k;
    std::array<double, 4> along{};
    for (std::size_t g = 0; g < 4; ++g) along[g] = signs[g][0] * x + signs[g][1] * y + signs[g][2] * z;
    const double most = *std::max_element(along.begin(), along.end());
    int nearest = 0;
    for (const double a : along) nearest += a > most - 0.1;
    for (std::size_t g = 0; g < 4; ++g)
      quarters[static_cast<std::size_t>(c)][g] =
          static_cast<std::uint16_t>(along[g] > most - 0.1 ? 12 / nearest : 0);
  }
  result.parts.samples = 3 * k * k * k;
  result.parts.counts.assign(4 * (voids + 1) * cells, 0);
  result.parts.region.assign(cells, no_region);
  std::size_t cell = 0;
  for (int z = 0; z < grid.cells[2]; ++z)
    for (int y = 0; y < grid.cells[1]; ++y)
      for (int x = 0; x < grid.cells[0]; ++x, ++cell) {
        std::array<int, 256> of_region{};
        for (int c = 0; c < k * k * k; ++c) {
          const int fx = x * k + c % k, fy = y * k + c / k % k, fz = z * k + c / (k * k);
          const int part = rule(fine.parts[fine.at(fx, fy, fz)], fine.centre(fx, fy, fz)[2]);
          if (part == no_void) continue;
          if (part >= 0) ++of_region[static_cast<std::size_t>(part)];
          const auto slot = static_cast<std::size_t>(part >= 0 ? 0 : -1 - part);
          for (std::size_t g = 0; g < 4; ++g)
            result.parts.counts[(4 * slot + g) * cells + cell] =
                static_cast<std::uint16_t>(result.parts.counts[(4 * slot + g) * cells + cell] +
                                           quarters[static_cast<std::size_t>(c)][g]);
        }
        const auto most = std::max_element(of_region.begin(), of_region.end());
        if (*most > 0) result.parts.region[cell] = static_cast<std::uint8_t>(most - of_region.begin());
      }
}

/// Part at the centre of one of the eight parts of a cell, by the place of that part; beyond the grid none.
int part_at(const FineLabels& fine, const PartRule& rule, const std::array<int, 3>& eighth) {
  std::array<int, 3> at{};
  for (std::size_t a = 0; a < 3; ++a) {
    at[a] = eighth[a] * fine.per_cell + fine.per_cell / 2;
    if (eighth[a] < 0 || at[a] >= fine.cells[a]) return no_void;
  }
  return rule(fine.parts[fine.at(at[0], at[1], at[2])], fine.centre(at[0], at[1], at[2])[2]);
}

void look_about_vertices(const FineLabels& fine, const PartRule& rule, const Grid& grid,
                         SolidLabels& result) {
  for (int z = 0; z <= grid.cells[2]; ++z)
    for (int y = 0; y <= grid.cells[1]; ++y)
      for (int x = 0; x <= grid.cells[0]; ++x) {
        std::uint16_t found = 0;
        for (int k = 0; k < 8; ++k) {
          const int part =
              part_at(fine, rule, {2 * x - 1 + (k & 1), 2 * y - 1 + (k >> 1 & 1), 2 * z - 1 + (k >> 2)});
          if (part < no_void) found = static_cast<std::uint16_t>(found | 1 << (-2 - part));
        }
        result.near.push_back(found);
      }
}

/// Coordinates next to the points of stress of every cell with tissue, by its own region.
void find_directions(const FineLabels& fine, const LabelHeart& heart, const Grid& grid, const Grid& halves,
                     const LabelLandmarks& marks, SolidLabels& result) {
  LabelCells eighths;
  eighths.grid = halves;
  eighths.landmarks = marks;
  eighths.region.assign(static_cast<std::size_t>(halves.size()), no_region);
  const auto nx = static_cast<std::size_t>(grid.cells[0]), ny = static_cast<std::size_t>(grid.cells[1]);
  const auto eighth = [&](std::size_t cell, std::size_t g) {
    const std::array<std::size_t, 3> at = {cell % nx, cell / nx % ny, cell / (nx * ny)};
    std::array<std::size_t, 3> part{};
    for (std::size_t a = 0; a < 3; ++a) part[a] = 2 * at[a] + (signs[g][a] > 0 ? 1 : 0);
    return part[0] + 2 * nx * (part[1] + 2 * ny * part[2]);
  };
  result.place.assign(static_cast<std::size_t>(grid.size()), -1);
  int tissue = 0;
  for (std::size_t cell = 0; cell < result.place.size(); ++cell) {
    if (result.parts.region[cell] == no_region) continue;
    result.place[cell] = tissue++;
    for (std::size_t g = 0; g < 4; ++g) eighths.region[eighth(cell, g)] = result.parts.region[cell];
  }
  locate(fine, heart, eighths);
  std::vector<int> row(eighths.region.size(), -1);
  for (std::size_t t = 0; t < eighths.tissue.size(); ++t)
    row[static_cast<std::size_t>(eighths.tissue[t])] = static_cast<int>(t);
  for (std::size_t cell = 0; cell < result.place.size(); ++cell)
    for (std::size_t g = 0; g < 4 && result.place[cell] >= 0; ++g) {
      const auto first = eighths.direction.begin() + 4 * row[eighth(cell, g)];
      result.direction.insert(result.direction.end(), first, first + 4);
    }
}

}  // namespace

SolidParts for_members(const SolidParts& one, int members) {
  SolidParts all;
  all.samples = one.samples;
  const std::size_t cells = one.region.size(), rows = one.counts.size() / cells;
  for (std::size_t row = 0; row < rows; ++row)
    for (int m = 0; m < members; ++m)
      all.counts.insert(all.counts.end(), one.counts.begin() + static_cast<std::ptrdiff_t>(row * cells),
                        one.counts.begin() + static_cast<std::ptrdiff_t>((row + 1) * cells));
  for (int m = 0; m < members; ++m) all.region.insert(all.region.end(), one.region.begin(), one.region.end());
  return all;
}

std::shared_ptr<const SolidLabels> solid_labels(const Scene& scene, const Grid& grid) {
  const LabelHeart& heart = *scene.labels;
  const std::size_t voids = solid_voids(scene).size();
  std::string key = fmt::format("{:.17g}", grid.dx_mm);
  for (std::size_t a = 0; a < 3; ++a) key += fmt::format(" {:.17g} {}", grid.origin_mm[a], grid.cells[a]);
  for (const Mechanics::Cavity& cavity : scene.mechanics->cavities) key += " " + cavity.name;
  for (const Parameter& p : scene.parameters.all())
    if (p.path.starts_with("geometry.grown.") || p.path.ends_with("base_mm"))
      key += fmt::format(" {:.17g}", p.value);
  const std::scoped_lock lock(heart.cache.mutex);
  if (heart.cache.solid && heart.cache.solid_key == key) return heart.cache.solid;
  auto result = std::make_shared<SolidLabels>();
  Grid halves = grid;
  halves.dx_mm = 0.5 * grid.dx_mm;
  for (int& n : halves.cells) n *= 2;
  LabelLandmarks marks;
  const FineLabels fine = fine_labels(scene, halves, marks);
  const PartRule rule(scene, grid);
  count(fine, rule, grid, voids, *result);
  look_about_vertices(fine, rule, grid, *result);
  find_directions(fine, heart, grid, halves, marks, *result);
  heart.cache.solid_key = key;
  heart.cache.solid = result;
  return result;
}

}  // namespace cohort
