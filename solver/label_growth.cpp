// A label map on the fine grid, and the walls, the insulating plate and the conduction path that its
// convention lacks.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "solver/geometry_kinds.hpp"
#include "solver/label_distance.hpp"

namespace cohort {

namespace {

constexpr double most_fine_cells = 4e7;

using Vector = std::array<double, 3>;

/// How many fine cells to an edge. Where voxels and cells share their faces as many as voxels, so that
/// sampling is exact; else two for each voxel's shortest edge. Fewer where memory would not do.
int fineness(const LabelImage& image, const Affine& voxel_of, const Grid& grid) {
  const auto edges = image.spacing_mm();
  const double finest = *std::min_element(edges.begin(), edges.end());
  const double cells = static_cast<double>(grid.size());
  const int most = std::max(1, static_cast<int>(std::floor(std::cbrt(most_fine_cells / cells))));
  const int same = std::max(1, static_cast<int>(std::lround(grid.dx_mm / finest)));
  bool aligned = same <= most;
  const double h = grid.dx_mm / same;
  Vector first{};
  for (size_t i = 0; i < 3; ++i) first[i] = grid.origin_mm[i] + 0.5 * h;
  first = voxel_of(first);
  constexpr double rounding = 1e-3;
  for (size_t i = 0; i < 3; ++i) {
    aligned = aligned && std::abs(first[i] - std::round(first[i])) < rounding;
    for (size_t j = 0; j < 3; ++j) {
      const double step = voxel_of.row[i][j] * h;
      // Over the whole grid, so that rounding does not add up to another voxel.
      aligned = aligned && std::abs(step - std::round(step)) * grid.cells[j] * same < 0.1;
    }
  }
  return aligned ? same : std::min(most, static_cast<int>(std::ceil(2 * grid.dx_mm / finest)));
}

std::vector<std::uint8_t> seeds(const std::vector<Part>& parts, const std::array<bool, 256>& chosen) {
  std::vector<std::uint8_t> result(parts.size());
  std::transform(parts.begin(), parts.end(), result.begin(), [&](Part p) { return chosen[p] ? 1 : 0; });
  return result;
}

/// Walls of the given thickness around blood: background cells within it, each to the nearest blood, joined
/// through such cells to the blood itself, so that none grows behind another label.
struct Wall {
  Part blood, tissue;
  double thickness;
};

void grow(FineLabels& fine, const std::vector<Wall>& walls) {
  std::vector<float> nearest(fine.parts.size(), no_seed);
  std::vector<Part> grown(fine.parts.size(), no_part);
  for (const Wall& wall : walls) {
    std::array<bool, 256> blood{};
    blood[wall.blood] = true;
    const CellBox box = box_of(fine, blood, wall.thickness);
    if (box.empty()) continue;
    const std::vector<float> distance =
        signed_distance(fine, box, seeds_in(fine, box, [&](Part p, double) { return p == wall.blood; }));
    std::size_t k = 0;
    for (int z = box.lower[2]; z < box.upper[2]; ++z)
      for (int y = box.lower[1]; y < box.upper[1]; ++y)
        for (int x = box.lower[0]; x < box.upper[0]; ++x, ++k) {
          const std::size_t i = fine.at(x, y, z);
          if (fine.parts[i] != no_part || double(distance[k]) > wall.thickness || distance[k] >= nearest[i])
            continue;
          nearest[i] = distance[k];
          grown[i] = wall.tissue;
        }
  }
  const auto nx = static_cast<std::int64_t>(fine.cells[0]), nxy = nx * fine.cells[1];
  const std::int64_t steps[] = {-1, 1, -nx, nx, -nxy, nxy};
  const auto count = static_cast<std::int64_t>(grown.size());
  std::vector<std::int64_t> front;
  const auto spread = [&](std::int64_t from, Part tissue) {
    for (const std::int64_t step : steps) {
      const std::int64_t next = from + step;
      if (next < 0 || next >= count || grown[size_t(next)] != tissue || fine.parts[size_t(next)] != no_part)
        continue;
      fine.parts[size_t(next)] = tissue;
      front.push_back(next);
    }
  };
  for (const Wall& wall : walls) {
    for (std::int64_t i = 0; i < count; ++i)
      if (fine.parts[size_t(i)] == wall.blood) spread(i, wall.tissue);
    while (!front.empty()) {
      const std::int64_t from = front.back();
      front.pop_back();
      spread(from, wall.tissue);
    }
  }
}

/// Atrial tissue nearer than `gap` to ventricular tissue becomes insulator.
void insulate(FineLabels& fine, const LabelHeart& heart, double gap) {
  std::array<bool, 256> ventricular{}, atrial{};
  for (const char* name : {"lv", "rv"})
    if (const int r = heart.region_index(name); r >= 0) ventricular[size_t(first_region_part + r)] = true;
  for (const char* name : {"la", "ra", "bachmann"})
    if (const int r = heart.region_index(name); r >= 0) atrial[size_t(first_region_part + r)] = true;
  const std::vector<float> distance = distance_transform(seeds(fine.parts, ventricular), fine.cells);
  const auto insulator = static_cast<Part>(first_region_part + heart.region_index("insulator"));
  for (std::size_t i = 0; i < fine.parts.size(); ++i)
    if (atrial[fine.parts[i]] && (distance[i] - 0.5) * fine.spacing_mm < gap) fine.parts[i] = insulator;
}

struct Mean {
  Vector sum{};
  double count = 0;
  void add(const Vector& p) {
    for (size_t i = 0; i < 3; ++i) sum[i] += p[i];
    ++count;
  }
  Vector value() const { return {sum[0] / count, sum[1] / count, sum[2] / count}; }
};

template <class Visit>
void each_cell(const FineLabels& fine, Visit visit) {
  std::size_t i = 0;
  for (int z = 0; z < fine.cells[2]; ++z)
    for (int y = 0; y < fine.cells[1]; ++y)
      for (int x = 0; x < fine.cells[0]; ++x, ++i)
        if (fine.parts[i] != no_part) visit(i, fine.centre(x, y, z));
}

/// Middle of the septum near height z, at the y nearest to `wanted` where the blood of both ventricles faces
/// it.
bool septum_middle(const FineLabels& fine, double z, double wanted, Vector& place) {
  constexpr double thickest = 30, slab = 2;  // mm
  const int row = std::clamp(int((z - fine.origin_mm[2]) / fine.spacing_mm), 0, fine.cells[2] - 1);
  const int reach = std::max(0, int(slab / fine.spacing_mm));
  double best = 1e30;
  for (int iz = std::max(0, row - reach); iz <= row; ++iz)
    for (int y = 0; y < fine.cells[1]; ++y) {
      int left = -1, right = -1;
      for (int x = 0; x < fine.cells[0]; ++x) {
        const Part p = fine.parts[fine.at(x, y, iz)];
        if (p == lv_blood_part) left = x;
        if (p == rv_blood_part && left >= 0) {
          right = x;
          break;
        }
      }
      if (right < 0 || (right - left) * fine.spacing_mm > thickest) continue;
      const Vector a = fine.centre(left, y, iz), b = fine.centre(right, y, iz);
      const double far = std::abs(a[1] - wanted) + 0.1 * (z - a[2]);
      if (far >= best) continue;
      best = far;
      place = {0.5 * (a[0] + b[0]), a[1], z};
    }
  return best < 1e30;
}

double distance_to_segment(const Vector& p, const Vector& a, const Vector& b) {
  double along = 0, length2 = 0;
  for (size_t i = 0; i < 3; ++i) {
    along += (p[i] - a[i]) * (b[i] - a[i]);
    length2 += (b[i] - a[i]) * (b[i] - a[i]);
  }
  const double t = std::clamp(along / std::max(length2, 1e-12), 0.0, 1.0);
  double d2 = 0;
  for (size_t i = 0; i < 3; ++i) d2 += std::pow(p[i] - a[i] - t * (b[i] - a[i]), 2);
  return std::sqrt(d2);
}

/// Where the path runs: from the right atrial tissue nearest to the top of the septum, through the plate,
/// down the septum's middle.
void find_path(const FineLabels& fine, const LabelHeart& heart, double length, LabelLandmarks& marks) {
  const auto ra = static_cast<Part>(first_region_part + heart.region_index("ra"));
  Mean atrium;
  each_cell(fine, [&](std::size_t i, const Vector& p) {
    if (fine.parts[i] == ra) atrium.add(p);
  });
  if (atrium.count == 0) return;
  const double y = atrium.value()[1];
  // A little below the plane, where the blood of both ventricles is sure to face the septum.
  constexpr double below = 4;
  if (!septum_middle(fine, -below, y, marks.his)) return;
  marks.his[2] = 0;
  if (!septum_middle(fine, -length, marks.his[1], marks.end))
    marks.end = {marks.his[0], marks.his[1], -length};
  double nearest = 1e30;
  each_cell(fine, [&](std::size_t i, const Vector& p) {
    if (fine.parts[i] != ra) return;
    const double d = std::hypot(p[0] - marks.his[0], p[1] - marks.his[1], p[2] - marks.his[2]);
    if (d >= nearest) return;
    nearest = d;
    marks.node = p;
  });
}

/// The path takes the place of background, insulator and muscle, never of blood or vessels.
void carve_path(FineLabels& fine, const LabelHeart& heart, const LabelLandmarks& marks) {
  const auto path = static_cast<Part>(first_region_part + heart.region_index("conduction_path"));
  std::array<bool, 256> gives_way{};
  gives_way[no_part] = true;
  for (const char* name : {"lv", "rv", "ra", "la", "insulator"})
    if (const int r = heart.region_index(name); r >= 0) gives_way[size_t(first_region_part + r)] = true;
  std::size_t i = 0;
  for (int iz = 0; iz < fine.cells[2]; ++iz)
    for (int iy = 0; iy < fine.cells[1]; ++iy)
      for (int ix = 0; ix < fine.cells[0]; ++ix, ++i) {
        if (!gives_way[fine.parts[i]]) continue;
        const Vector p = fine.centre(ix, iy, iz);
        if (std::min(distance_to_segment(p, marks.node, marks.his),
                     distance_to_segment(p, marks.his, marks.end)) <= marks.path_radius)
          fine.parts[i] = path;
      }
}

/// Landmarks of a path that is labelled: means of its voxels at its top, about the AV plane, at its bottom;
/// its radius from its volume over its length.
void measure_path(const FineLabels& fine, Part path, LabelLandmarks& marks) {
  double top = -1e30, bottom = 1e30, volume = 0;
  each_cell(fine, [&](std::size_t i, const Vector& p) {
    if (fine.parts[i] != path) return;
    top = std::max(top, p[2]);
    bottom = std::min(bottom, p[2]);
    ++volume;
  });
  if (volume == 0) return;
  volume *= std::pow(fine.spacing_mm, 3);
  const double thick = std::max(2.0, fine.spacing_mm), plane = std::clamp(0.0, bottom, top);
  Mean node, his, end;
  each_cell(fine, [&](std::size_t i, const Vector& p) {
    if (fine.parts[i] != path) return;
    if (p[2] >= top - 2 * thick) node.add(p);
    if (std::abs(p[2] - plane) <= thick) his.add(p);
    if (p[2] <= bottom + 2 * thick) end.add(p);
  });
  marks.node = node.value();
  marks.his = his.count > 0 ? his.value() : marks.node;
  marks.end = end.value();
  const auto between = [](const Vector& a, const Vector& b) {
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  };
  const double length = between(marks.node, marks.his) + between(marks.his, marks.end) + 2 * thick;
  marks.path_radius = std::sqrt(volume / (std::numbers::pi * length));
}

/// A path that a delay stands for gives way to what tissue lies nearest: septum, plate, atrium.
void dissolve_path(FineLabels& fine, const LabelHeart& heart) {
  CellBox box;
  box.lower = fine.cells;
  std::size_t i = 0;
  for (int z = 0; z < fine.cells[2]; ++z)
    for (int y = 0; y < fine.cells[1]; ++y)
      for (int x = 0; x < fine.cells[0]; ++x, ++i) {
        if (fine.parts[i] != idle_path_part) continue;
        const std::array<int, 3> c = {x, y, z};
        for (size_t a = 0; a < 3; ++a) {
          box.lower[a] = std::min(box.lower[a], c[a]);
          box.upper[a] = std::max(box.upper[a], c[a] + 1);
        }
      }
  if (box.empty()) return;
  constexpr double margin = 10;  // mm
  for (size_t a = 0; a < 3; ++a) {
    const int by = int(margin / fine.spacing_mm) + 1;
    box.lower[a] = std::max(0, box.lower[a] - by);
    box.upper[a] = std::min(fine.cells[a], box.upper[a] + by);
  }
  const auto each = [&](auto visit) {
    std::size_t k = 0;
    for (int z = box.lower[2]; z < box.upper[2]; ++z)
      for (int y = box.lower[1]; y < box.upper[1]; ++y)
        for (int x = box.lower[0]; x < box.upper[0]; ++x) visit(k++, fine.at(x, y, z));
  };
  std::vector<float> nearest(box.size(), no_seed);
  std::vector<Part> heir(box.size(), no_part);
  std::vector<std::uint8_t> seed(box.size());
  for (const char* name : {"lv", "ra", "insulator"}) {
    const int region = heart.region_index(name);
    if (region < 0) continue;
    const auto part = static_cast<Part>(first_region_part + region);
    each([&](std::size_t k, std::size_t cell) { seed[k] = fine.parts[cell] == part; });
    const std::vector<float> distance = distance_transform(seed, box.cells());
    for (std::size_t k = 0; k < heir.size(); ++k)
      if (distance[k] < nearest[k]) {
        nearest[k] = distance[k];
        heir[k] = part;
      }
  }
  each([&](std::size_t k, std::size_t cell) {
    if (fine.parts[cell] == idle_path_part) fine.parts[cell] = heir[k];
  });
}

/// Where the ray from the centroid of the right atrium's blood in direction (0.45, 0.72, 0.6), in units of
/// the pool's half-extents, passes the middle of the atrium's wall: the rule of the schematic heart.
bool sinoatrial_node(const FineLabels& fine, Part ra, Vector& place) {
  Mean blood;
  Vector lower, upper;
  lower.fill(1e30);
  upper.fill(-1e30);
  each_cell(fine, [&](std::size_t i, const Vector& p) {
    if (fine.parts[i] != ra_blood_part) return;
    blood.add(p);
    for (size_t a = 0; a < 3; ++a) {
      lower[a] = std::min(lower[a], p[a]);
      upper[a] = std::max(upper[a], p[a]);
    }
  });
  if (blood.count == 0) return false;
  const Vector centre = blood.value(),
               d = {0.45 * (upper[0] - lower[0]), 0.72 * (upper[1] - lower[1]), 0.6 * (upper[2] - lower[2])};
  const double length = std::hypot(d[0], d[1], d[2]), step = 0.5 * fine.spacing_mm;
  double first = -1, last = -1;
  for (double t = 0;; t += step) {
    std::array<int, 3> cell{};
    bool inside = true;
    for (size_t a = 0; a < 3; ++a) {
      cell[a] = int(std::floor((centre[a] + t * d[a] / length - fine.origin_mm[a]) / fine.spacing_mm));
      inside = inside && cell[a] >= 0 && cell[a] < fine.cells[a];
    }
    if (!inside) break;
    if (fine.parts[fine.at(cell[0], cell[1], cell[2])] != ra) continue;
    if (first < 0) first = t;
    last = t;
  }
  if (first < 0) return false;
  for (size_t a = 0; a < 3; ++a) place[a] = centre[a] + 0.5 * (first + last) * d[a] / length;
  return true;
}

void find_sites(const Scene& scene, const FineLabels& fine, LabelLandmarks& marks) {
  const LabelHeart& heart = *scene.labels;
  marks.sites = heart.sites;
  const auto add = [&](const char* name, const Vector& place, double radius) {
    for (const auto& [known, sphere] : marks.sites)
      if (known == name) return;
    marks.sites.emplace_back(name, Sphere{place, radius});
  };
  if (marks.path_radius > 0) {
    add("av_node", marks.node, marks.path_radius);
    add("his_bundle", marks.his, marks.path_radius);
  }
  Vector node{};
  if (const int ra = heart.region_index("ra");
      ra >= 0 && sinoatrial_node(fine, static_cast<Part>(first_region_part + ra), node))
    add("sinoatrial_node", node, label_size(scene, "sinoatrial_node_radius_mm"));
}

}  // namespace

FineLabels fine_labels(const Scene& scene, const Grid& grid, LabelLandmarks& marks) {
  const LabelHeart& heart = *scene.labels;
  const LabelImage& image = heart.image;
  const Affine voxel_of = inverse(compose(heart.to_heart, image.to_world));
  FineLabels fine;
  fine.per_cell = fineness(image, voxel_of, grid);
  fine.spacing_mm = grid.dx_mm / fine.per_cell;
  const auto edges = image.spacing_mm();
  constexpr double most_per_voxel = 4;
  fine.per_voxel = static_cast<int>(std::clamp(
      std::round(*std::min_element(edges.begin(), edges.end()) / fine.spacing_mm), 1.0, most_per_voxel));
  fine.origin_mm = grid.origin_mm;
  for (size_t a = 0; a < 3; ++a) fine.cells[a] = grid.cells[a] * fine.per_cell;
  fine.parts.assign(std::size_t(fine.cells[0]) * size_t(fine.cells[1]) * size_t(fine.cells[2]), no_part);
  const auto [nx, ny, nz] = image.cells;
  std::size_t i = 0;
  for (int z = 0; z < fine.cells[2]; ++z)
    for (int y = 0; y < fine.cells[1]; ++y) {
      Vector v = voxel_of(fine.centre(0, y, z));
      for (size_t a = 0; a < 3; ++a) v[a] += 0.5;
      for (int x = 0; x < fine.cells[0]; ++x, ++i) {
        const double step = x * fine.spacing_mm;
        const double vx = std::floor(v[0] + step * voxel_of.row[0][0]),
                     vy = std::floor(v[1] + step * voxel_of.row[1][0]),
                     vz = std::floor(v[2] + step * voxel_of.row[2][0]);
        if (vx < 0 || vy < 0 || vz < 0 || vx >= nx || vy >= ny || vz >= nz) continue;
        const std::size_t voxel = size_t(vx) + size_t(nx) * (size_t(vy) + size_t(ny) * size_t(vz));
        fine.parts[i] = heart.part_of_label[image.voxels[voxel]];
      }
    }

  const auto region = [&](const char* name) {
    return static_cast<Part>(first_region_part + heart.region_index(name));
  };
  std::vector<Wall> walls;
  const double atrial = label_size(scene, "atrial_wall_mm");
  if (heart.grows_rv) walls.push_back({rv_blood_part, region("rv"), label_size(scene, "rv_wall_mm")});
  if (heart.grows_la) walls.push_back({la_blood_part, region("la"), atrial});
  if (heart.grows_ra) walls.push_back({ra_blood_part, region("ra"), atrial});
  if (!walls.empty()) grow(fine, walls);
  if (heart.grows_plate) insulate(fine, heart, std::max(label_size(scene, "av_plate_mm"), grid.dx_mm));
  const bool path_labelled =
      std::find(fine.parts.begin(), fine.parts.end(), idle_path_part) != fine.parts.end();
  if (heart.grows_path || (heart.idle_path && !path_labelled)) {
    marks.path_radius = std::max(label_size(scene, "conduction_path_radius_mm"), 0.5 * grid.dx_mm);
    find_path(fine, heart, label_size(scene, "conduction_path_length_mm"), marks);
    if (heart.grows_path) carve_path(fine, heart, marks);
  } else if (heart.idle_path || heart.has("conduction_path")) {
    measure_path(fine, heart.idle_path ? idle_path_part : region("conduction_path"), marks);
    if (heart.idle_path) dissolve_path(fine, heart);
  }
  if (heart.has_blood(lv_blood_part)) marks.lv_length = -heart.part_extent(lv_blood_part).lower[2];
  find_sites(scene, fine, marks);
  return fine;
}

}  // namespace cohort
