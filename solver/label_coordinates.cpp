// Where the cells of a label heart lie in its walls: coordinates and what fibres follow from.
#include "solver/label_coordinates.hpp"

#include <algorithm>
#include <cmath>

#include "solver/label_distance.hpp"

namespace cohort {

namespace {

using Vector = std::array<double, 3>;
constexpr std::uint8_t no_region = 255;

/// Distances that coordinates and fibres are made of.
struct Distances {
  DistanceField lv, rv, la, ra;  ///< to the blood, positive outside it
  DistanceField rv_outflow;      ///< to the right ventricle's blood above the AV plane
  DistanceField lv_outside;  ///< to what lies outside the left ventricle below the AV plane, negative there
  DistanceField background;  ///< to what is no label, negative there
  DistanceField rv_wall, la_wall, ra_wall;  ///< thickness
};

/// Thickness in mm of the thin wall of `region`, whose distance from its blood is `inner`: at its outer
/// surface, where that lies opposite the blood, the sum of both distances; elsewhere that of the nearest such
/// place. What is nearest where a wall ends or another one joins it is not its other side.
DistanceField thickness(const FineLabels& fine, int region, const DistanceField& inner,
                        const DistanceField& outer) {
  if (region < 0 || inner.empty() || outer.empty()) return {};
  std::array<bool, 256> wall{};
  wall[part_of(region)] = true;
  const CellBox box = box_of(fine, wall);
  if (box.empty()) return {};
  const double near = 1.5 * fine.per_voxel * fine.spacing_mm;  // the cells along the surface
  constexpr double opposite = -0.9;
  std::vector<std::uint8_t> seed(box.size());
  std::vector<float> result(box.size());
  std::size_t i = 0;
  for (int z = box.lower[2]; z < box.upper[2]; ++z)
    for (int y = box.lower[1]; y < box.upper[1]; ++y)
      for (int x = box.lower[0]; x < box.upper[0]; ++x, ++i) {
        if (!wall[fine.parts[fine.at(x, y, z)]]) continue;
        const Vector p = fine.centre(x, y, z);
        const double outside = outer(p);
        if (outside > near) continue;
        double inwards2 = 0, outwards2 = 0, both = 0;
        for (size_t a = 0; a < 3; ++a) {
          Vector below = p, above = p;
          below[a] -= near;
          above[a] += near;
          const double to_outer = outer(above) - outer(below), to_inner = inner(above) - inner(below);
          both += to_outer * to_inner;
          outwards2 += to_outer * to_outer;
          inwards2 += to_inner * to_inner;
        }
        if (!(both < opposite * std::sqrt(inwards2 * outwards2))) continue;
        seed[i] = 1;
        result[i] = float(inner(p) + outside);
      }
  if (std::find(seed.begin(), seed.end(), 1) == seed.end()) return {};
  std::vector<std::int32_t> nearest;
  distance_transform(seed, box.cells(), &nearest);
  for (i = 0; i < result.size(); ++i) result[i] = result[size_t(nearest[i])];
  return {fine, box, std::move(result)};
}

Distances distances(const FineLabels& fine, const LabelHeart& heart) {
  std::array<bool, 256> ventricles{}, left_atrium{}, right_atrium{}, hull{};
  std::array<bool, 256> outside{};
  for (std::size_t r = 0; r < heart.regions.size(); ++r) {
    const std::string& name = heart.regions[r].name;
    const Part part = part_of(int(r));
    const LabelFibres rule = label_fibres(heart, name);
    const bool rv = name == "rv", path = name == "conduction_path";
    if (rule == LabelFibres::helix || path) ventricles[part] = true;
    if (name == "la" || name == "bachmann") left_atrium[part] = true;
    if (name == "ra" || name == "bachmann") right_atrium[part] = true;
    if ((rule == LabelFibres::helix && !rv) || path) hull[part] = true;
    if (rv) outside[part] = true;
  }
  outside[no_part] = outside[rv_blood_part] = true;
  hull[lv_blood_part] = true;
  Distances d;
  const auto pool = [&](Part blood, std::array<bool, 256> around, double above_mm = -1e9) {
    if (!heart.has_blood(blood)) return DistanceField();
    around[blood] = true;
    const CellBox box = box_of(fine, around);
    std::vector<std::uint8_t> seeds =
        seeds_in(fine, box, [&](Part p, double z) { return p == blood && z > above_mm; });
    if (std::find(seeds.begin(), seeds.end(), 1) == seeds.end()) return DistanceField();
    return DistanceField(fine, box, signed_distance(fine, box, std::move(seeds)));
  };
  d.lv = pool(lv_blood_part, ventricles);
  d.rv = pool(rv_blood_part, ventricles);
  d.rv_outflow = pool(rv_blood_part, ventricles, 0);
  d.la = pool(la_blood_part, left_atrium);
  d.ra = pool(ra_blood_part, right_atrium);
  if (heart.has_blood(lv_blood_part)) {
    // What lies above the AV plane is no outer surface: there the wall has an end, not a side.
    const CellBox box = box_of(fine, hull);
    d.lv_outside = {fine, box, signed_distance(fine, box, seeds_in(fine, box, [&](Part p, double z) {
                                                 return outside[p] && z < 0;
                                               }))};
  }
  std::array<bool, 256> thin = left_atrium;
  for (std::size_t p = 0; p < 256; ++p) thin[p] = thin[p] || right_atrium[p];
  if (const int rv = heart.region_index("rv"); rv >= 0) thin[part_of(rv)] = true;
  const CellBox box = box_of(fine, thin);
  if (!box.empty())
    d.background = {
        fine, box,
        signed_distance(fine, box, seeds_in(fine, box, [](Part p, double) { return p == no_part; }))};
  d.rv_wall = thickness(fine, heart.region_index("rv"), d.rv, d.background);
  d.la_wall = thickness(fine, heart.region_index("la"), d.la, d.background);
  d.ra_wall = thickness(fine, heart.region_index("ra"), d.ra, d.background);
  return d;
}

/// Axis of Bachmann's bundle: the line of its centroids over x.
class Bundle {
 public:
  Bundle(const FineLabels& fine, int region) {
    if (region < 0) return;
    first_ = fine.origin_mm[0];
    slabs_.resize(size_t(fine.cells[0] * fine.spacing_mm / slab) + 1);
    std::size_t i = 0;
    for (int z = 0; z < fine.cells[2]; ++z)
      for (int y = 0; y < fine.cells[1]; ++y)
        for (int x = 0; x < fine.cells[0]; ++x, ++i) {
          if (fine.parts[i] != part_of(region)) continue;
          const Vector p = fine.centre(x, y, z);
          auto& [sum, count] = slabs_[size_t((p[0] - first_) / slab)];
          for (size_t a = 0; a < 3; ++a) sum[a] += p[a];
          ++count;
        }
  }
  Vector direction(const Vector& p) const {
    Vector ends[2]{};
    const int middle = int((p[0] - first_) / slab);
    for (int side = 0; side < 2; ++side)
      for (int reach = 2; reach >= 0; --reach) {
        const int s = middle + (side ? reach : -reach);
        if (s < 0 || s >= int(slabs_.size()) || slabs_[size_t(s)].count == 0) continue;
        for (size_t a = 0; a < 3; ++a) ends[side][a] = slabs_[size_t(s)].sum[a] / slabs_[size_t(s)].count;
        break;
      }
    Vector d = {ends[1][0] - ends[0][0], ends[1][1] - ends[0][1], ends[1][2] - ends[0][2]};
    const double length = std::hypot(d[0], d[1], d[2]);
    for (double& x : d) x = length > 0 ? x / length : 0;
    return length > 0 ? d : Vector{1, 0, 0};
  }

 private:
  static constexpr double slab = 2;  // mm
  struct Slab {
    Vector sum{};
    double count = 0;
  };
  double first_ = 0;
  std::vector<Slab> slabs_;
};

Vector between(const Vector& a, const Vector& b) {
  Vector d = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
  const double length = std::hypot(d[0], d[1], d[2]);
  for (double& x : d) x = length > 0 ? x / length : 0;
  return d;
}

}  // namespace

void locate(const FineLabels& fine, const LabelHeart& heart, LabelCells& cells) {
  const Distances d = distances(fine, heart);
  const Bundle bundle(fine, heart.region_index("bachmann"));
  const LabelLandmarks& marks = cells.landmarks;
  const Grid& grid = cells.grid;
  constexpr double thinnest = 0.1;  // mm
  const auto depth = [&](const std::string& name, const Vector& p) -> std::array<double, 2> {
    // Above the base there is the outflow alone: what its wall stands on there is no endocardium.
    const DistanceField& right = p[2] > 0 && !d.rv_outflow.empty() ? d.rv_outflow : d.rv;
    // From the blood and from the other side.
    const auto thin = [&](const DistanceField& inner, const DistanceField& wall) -> std::array<double, 2> {
      const double in = inner.empty() ? 0 : inner(p);
      return {in, !wall.empty() ? wall(p) - in : !d.background.empty() ? d.background(p) : 0};
    };
    if (name == "rv") return thin(right, d.rv_wall);
    if (name == "la" && !d.la.empty()) return thin(d.la, d.la_wall);
    if (name == "ra" && !d.ra.empty()) return thin(d.ra, d.ra_wall);
    if (name == "bachmann" && (!d.la.empty() || !d.ra.empty()))
      return {std::min(d.la.empty() ? 1e9 : d.la(p), d.ra.empty() ? 1e9 : d.ra(p)), d.background(p)};
    if (name == "la" || name == "ra" || name == "bachmann" || d.lv.empty()) return {0, 0};
    return {d.lv(p), d.lv_outside(p)};
  };
  // The surfaces of voxels are rough at their own size: gradients are taken over half a cell of the scene.
  const double reach = std::max(fine.spacing_mm, 0.5 * grid.dx_mm);
  for (std::size_t cell = 0; cell < cells.region.size(); ++cell) {
    if (cells.region[cell] == no_region) continue;
    const std::size_t nx = size_t(grid.cells[0]), ny = size_t(grid.cells[1]);
    const std::array<std::size_t, 3> index = {cell % nx, cell / nx % ny, cell / (nx * ny)};
    Vector p;
    for (size_t a = 0; a < 3; ++a) p[a] = grid.origin_mm[a] + grid.dx_mm * (double(index[a]) + 0.5);
    const std::string& name = heart.regions[cells.region[cell]].name;
    const LabelFibres rule = label_fibres(heart, name);
    const auto at = depth(name, p);
    const double u = at[0] / std::max(at[0] + at[1], thinnest);
    Vector direction{};
    if (rule == LabelFibres::along) {
      direction = name == "bachmann" ? bundle.direction(p)
                  : p[2] > 0         ? between(marks.his, marks.node)
                                     : between(marks.end, marks.his);
    } else if (rule == LabelFibres::helix || rule == LabelFibres::circumferential) {
      // Of u, in which the nearer surface sets the normal: where the right ventricle's wall meets the left
      // one, only its outer surface goes on.
      for (size_t a = 0; a < 3; ++a)
        for (const double side : {-1.0, 1.0}) {
          Vector q = p;
          q[a] += side * reach;
          const auto there = depth(name, q);
          direction[a] += side * there[0] / std::max(there[0] + there[1], thinnest);
        }
      const double length = std::hypot(direction[0], direction[1], direction[2]);
      if (length > 0)
        for (double& x : direction) x /= length;
      else
        direction = {1, 0, 0};
    }
    double endocardium = at[0];
    if (rule == LabelFibres::helix && name != "rv" && !d.rv.empty())
      endocardium = std::min(endocardium, std::max(d.rv(p), at[1]));
    const double L = marks.lv_length;
    cells.tissue.push_back(static_cast<std::int32_t>(cell));
    for (const double x : {direction[0], direction[1], direction[2], u}) cells.direction.push_back(float(x));
    for (const double x : {std::clamp(u, 0.0, 1.0), L > 0 ? (p[2] + L) / L : 0.0,
                           L > 0 ? std::atan2(p[1], p[0]) : 0.0, endocardium})
      cells.coordinates.push_back(float(x));
  }
}

}  // namespace cohort
