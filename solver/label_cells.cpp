// From fine labels to the tissue of the scene's grid: regions, fractions, coordinates, directions of fibres.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "solver/geometry_kinds.hpp"
#include "solver/labels.hpp"

namespace cohort {

namespace {

using Vector = std::array<double, 3>;
constexpr std::uint8_t no_region = 255;
constexpr double minimal_fraction = 0.05;       // as MINIMAL_FRACTION of kernels/signed_distance.clh
constexpr double least_share_of_tissue = 1e-3;  // of the parts that faces join: smaller ones are splinters

Part part_of(int region) {
  return static_cast<Part>(first_region_part + region);
}

/// A field on a box of the fine grid, in mm, read between the cells' centres by trilinear interpolation.
class Field {
 public:
  Field() = default;
  Field(const FineLabels& fine, const CellBox& box, std::vector<float> values)
      : spacing_(fine.spacing_mm), n_(box.cells()), values_(std::move(values)) {
    for (size_t a = 0; a < 3; ++a) first_[a] = fine.origin_mm[a] + fine.spacing_mm * (box.lower[a] + 0.5);
  }
  bool empty() const { return values_.empty(); }
  double operator()(const Vector& p) const {
    std::array<int, 3> cell;
    Vector t;
    for (size_t a = 0; a < 3; ++a) {
      const double place = std::clamp((p[a] - first_[a]) / spacing_, 0.0, double(n_[a] - 1));
      cell[a] = std::min(int(place), std::max(0, n_[a] - 2));
      t[a] = place - cell[a];
    }
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
      double weight = 1;
      std::array<int, 3> c;
      for (size_t a = 0; a < 3; ++a) {
        const int up = corner >> a & 1;
        weight *= up ? t[a] : 1 - t[a];
        c[a] = std::min(cell[a] + up, n_[a] - 1);
      }
      if (weight > 0)
        sum += weight *
               double(values_[size_t(c[0]) + size_t(n_[0]) * (size_t(c[1]) + size_t(n_[1]) * size_t(c[2]))]);
    }
    return sum;
  }

 private:
  double spacing_ = 1;
  std::array<int, 3> n_{};
  Vector first_{};
  std::vector<float> values_;
};

/// What the fields are asked for: the box of the chosen parts and a margin.
CellBox box_of(const FineLabels& fine, const std::array<bool, 256>& chosen) {
  CellBox box;
  box.lower = fine.cells;
  box.upper = {0, 0, 0};
  std::size_t i = 0;
  for (int z = 0; z < fine.cells[2]; ++z)
    for (int y = 0; y < fine.cells[1]; ++y)
      for (int x = 0; x < fine.cells[0]; ++x, ++i) {
        if (!chosen[fine.parts[i]]) continue;
        const std::array<int, 3> c = {x, y, z};
        for (size_t a = 0; a < 3; ++a) {
          box.lower[a] = std::min(box.lower[a], c[a]);
          box.upper[a] = std::max(box.upper[a], c[a] + 1);
        }
      }
  const int margin = 2 * fine.per_cell;
  for (size_t a = 0; a < 3; ++a) {
    box.lower[a] = std::max(0, box.lower[a] - margin);
    box.upper[a] = std::min(fine.cells[a], box.upper[a] + margin);
  }
  return box;
}

/// Seeds in a box: choose(part, z of the centre).
template <class Choose>
std::vector<std::uint8_t> seeds_in(const FineLabels& fine, const CellBox& box, Choose choose) {
  std::vector<std::uint8_t> result;
  result.reserve(box.size());
  for (int z = box.lower[2]; z < box.upper[2]; ++z)
    for (int y = box.lower[1]; y < box.upper[1]; ++y)
      for (int x = box.lower[0]; x < box.upper[0]; ++x)
        result.push_back(choose(fine.parts[fine.at(x, y, z)], fine.centre(x, y, z)[2]) ? 1 : 0);
  return result;
}

/// Smooths a field by a binomial of variance `times`/2 cells along each axis, the values beyond its ends as
/// those at its ends.
void smooth(std::vector<float>& values, const std::array<int, 3>& n, int times) {
  std::vector<float> old(values.size());
  std::size_t stride = 1;
  for (size_t axis = 0; axis < 3; ++axis) {
    const auto length = size_t(n[axis]);
    for (int turn = 0; turn < times; ++turn) {
      old.swap(values);
      for (std::size_t first = 0; first < old.size(); first += stride * length)
        for (std::size_t k = 0; k < length; ++k) {
          const float *here = &old[first + k * stride], *below = k > 0 ? here - stride : here,
                      *above = k + 1 < length ? here + stride : here;
          float* out = &values[first + k * stride];
          for (std::size_t i = 0; i < stride; ++i) out[i] = 0.5f * here[i] + 0.25f * (below[i] + above[i]);
        }
    }
    stride *= length;
  }
}

/// The quantile z of the normal distribution, Phi(z) = p, for p in (0, 1): M. Abramowitz and I. Stegun,
/// Handbook of Mathematical Functions (1964), 26.2.23, |error| < 4.5e-4.
float normal_quantile(float p) {
  const float tail = std::min(p, 1 - p), t = std::sqrt(-2 * std::log(tail));
  const float z = t - (2.515517f + t * (0.802853f + t * 0.010328f)) /
                          (1 + t * (1.432788f + t * (0.189269f + t * 0.001308f)));
  return p < 0.5f ? -z : z;
}

/// Signed distance in mm to the surface of the seeds, negative inside. The surface is that of the shape that
/// voxels sampled, not their faces: next to it the distance follows from the share of seeds about a cell,
/// which goes through a plane of any direction as a normal distribution; farther away from that of the
/// nearest cell on the other side.
Field signed_distance(const FineLabels& fine, const CellBox& box, std::vector<std::uint8_t> seed) {
  if (box.empty()) return {};
  const std::size_t size = seed.size();
  const auto width = float(fine.per_voxel);  // standard deviation of the smoothing, in cells
  std::vector<float> near(size);
  for (std::size_t i = 0; i < size; ++i) near[i] = seed[i] ? 1.0f : 0.0f;
  smooth(near, box.cells(), 2 * fine.per_voxel * fine.per_voxel);
  constexpr float least_share = 1e-3f;
  for (float& x : near) x = -width * normal_quantile(std::clamp(x, least_share, 1 - least_share));

  const auto n = box.cells();
  const std::size_t strides[] = {1, size_t(n[0]), size_t(n[0]) * size_t(n[1])};
  const auto beyond = [&](std::size_t cell, std::size_t foot) {
    Vector normal{}, way{};
    for (size_t a = 0; a < 3; ++a) {
      const auto there = int(foot / strides[a] % size_t(n[a]));
      way[a] = int(cell / strides[a] % size_t(n[a])) - there;
      normal[a] = double(near[there + 1 < n[a] ? foot + strides[a] : foot] -
                         near[there > 0 ? foot - strides[a] : foot]);
    }
    const double length = std::hypot(normal[0], normal[1], normal[2]);
    if (!(length > 0)) return near[cell];
    return near[foot] + float((way[0] * normal[0] + way[1] * normal[1] + way[2] * normal[2]) / length);
  };
  std::vector<std::int32_t> nearest;
  std::vector<float> result(size);
  const auto h = static_cast<float>(fine.spacing_mm);
  for (const bool inside : {false, true}) {
    // From the plane that the surface is at the nearest cell on the other side.
    distance_transform(seed, box.cells(), &nearest);
    for (std::size_t i = 0; i < size; ++i) {
      if (seed[i]) continue;
      float d = near[i];
      if (nearest[i] < 0)
        d = inside ? -no_seed : no_seed;
      else if (std::abs(d) > width)
        d = beyond(i, size_t(nearest[i]));
      result[i] = h * d;
    }
    for (std::uint8_t& s : seed) s = !s;
  }
  return {fine, box, std::move(result)};
}

/// Distances that coordinates and fibres are made of.
struct Distances {
  Field lv, rv, la, ra;  ///< to the blood, positive outside it
  Field rv_outflow;      ///< to the right ventricle's blood above the AV plane
  Field lv_outside;      ///< to what lies outside the left ventricle below the AV plane, negative there
  Field background;      ///< to what is no label, negative there
};

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
    if (!heart.has_blood(blood)) return Field();
    around[blood] = true;
    const CellBox box = box_of(fine, around);
    std::vector<std::uint8_t> seeds =
        seeds_in(fine, box, [&](Part p, double z) { return p == blood && z > above_mm; });
    if (std::find(seeds.begin(), seeds.end(), 1) == seeds.end()) return Field();
    return signed_distance(fine, box, std::move(seeds));
  };
  d.lv = pool(lv_blood_part, ventricles);
  d.rv = pool(rv_blood_part, ventricles);
  d.rv_outflow = pool(rv_blood_part, ventricles, 0);
  d.la = pool(la_blood_part, left_atrium);
  d.ra = pool(ra_blood_part, right_atrium);
  if (heart.has_blood(lv_blood_part)) {
    // What lies above the AV plane is no outer surface: there the wall has an end, not a side.
    const CellBox box = box_of(fine, hull);
    d.lv_outside = signed_distance(
        fine, box, seeds_in(fine, box, [&](Part p, double z) { return outside[p] && z < 0; }));
  }
  std::array<bool, 256> thin = left_atrium;
  for (std::size_t p = 0; p < 256; ++p) thin[p] = thin[p] || right_atrium[p];
  if (const int rv = heart.region_index("rv"); rv >= 0) thin[part_of(rv)] = true;
  const CellBox box = box_of(fine, thin);
  if (!box.empty())
    d.background =
        signed_distance(fine, box, seeds_in(fine, box, [](Part p, double) { return p == no_part; }));
  return d;
}

/// Owner and fraction of each cell, from the shares of its fine cells; the rules of
/// kernels/geometry_heart.clh.
void classify(const FineLabels& fine, const LabelHeart& heart, LabelCells& cells) {
  const auto& [nx, ny, nz] = cells.grid.cells;
  const int k = fine.per_cell;
  const double all = double(k) * k * k;
  const int path = heart.region_index("conduction_path"), bundle = heart.region_index("bachmann");
  const auto regions = int(heart.regions.size());
  cells.region.assign(size_t(cells.grid.size()), no_region);
  cells.fraction.assign(size_t(cells.grid.size()), 0.0f);
  std::array<int, 256> count{};
  std::size_t cell = 0;
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x, ++cell) {
        count.fill(0);
        for (int c = 0; c < k; ++c)
          for (int b = 0; b < k; ++b) {
            const Part* row = &fine.parts[fine.at(x * k, y * k + b, z * k + c)];
            for (int a = 0; a < k; ++a) ++count[row[a]];
          }
        // The bundle is laid over walls whose share beneath it is not known: where it fills less than half of
        // a cell, it owns the cell if little else is in it.
        double excitable = 0, inert = 0, most = 0, atrial = 0;
        int owner = -1;
        for (int r = 0; r < regions; ++r) {
          const double share = count[part_of(r)] / all;
          const Region& region = heart.regions[size_t(r)];
          (region.excitable ? excitable : inert) += share;
          if (region.name == "la" || region.name == "ra") atrial += share;
          if (!region.excitable || r == path || r == bundle || share <= most) continue;
          most = share;
          owner = r;
        }
        const double on_path = path < 0 ? 0 : count[part_of(path)] / all;
        const double on_bundle = bundle < 0 ? 0 : count[part_of(bundle)] / all;
        if (on_bundle >= 0.5 || on_bundle > 2 * atrial) owner = bundle;
        bool conducts = excitable - on_path >= inert;
        // In the plate a sliver of the path conducts: it must not break where it passes between cells.
        const bool in_plate = inert > excitable - on_path;
        if (on_path >= 0.5 || (in_plate && on_path >= minimal_fraction) ||
            on_path > excitable - on_path + inert) {
          owner = path;
          conducts = true;
        }
        if (!conducts || owner < 0 || excitable + inert < minimal_fraction) continue;
        cells.region[cell] = static_cast<std::uint8_t>(owner);
        cells.fraction[cell] = static_cast<float>(std::min(1.0, excitable + inert));
      }
}

/// Atrial cells that touch ventricular ones by a face or an edge, as diffusion reaches, insulate: only the
/// path may conduct. Of what a convention of public images or an export at another spacing leaves there, one
/// cell gives way.
void separate(const LabelHeart& heart, LabelCells& cells) {
  const auto& [nx, ny, nz] = cells.grid.cells;
  std::array<int, 256> side{};
  for (std::size_t r = 0; r < heart.regions.size(); ++r) {
    const std::string& name = heart.regions[r].name;
    if (name == "lv" || name == "rv") side[r] = 1;
    if (name == "la" || name == "ra" || name == "bachmann") side[r] = 2;
  }
  side[no_region] = 0;
  const auto n = std::array<std::int64_t, 3>{nx, ny, nz};
  std::vector<std::size_t> inert;
  for (std::int64_t z = 1; z + 1 < n[2]; ++z)
    for (std::int64_t y = 1; y + 1 < n[1]; ++y)
      for (std::int64_t x = 1; x + 1 < n[0]; ++x) {
        const std::int64_t cell = x + n[0] * (y + n[1] * z);
        if (side[cells.region[size_t(cell)]] != 2) continue;
        bool touches = false;
        for (int neighbour = 0; neighbour < 27 && !touches; ++neighbour) {
          const int dx = neighbour % 3 - 1, dy = neighbour / 3 % 3 - 1, dz = neighbour / 9 - 1;
          if (std::abs(dx) + std::abs(dy) + std::abs(dz) > 2) continue;
          touches = side[cells.region[size_t(cell + dx + n[0] * (dy + n[1] * dz))]] == 1;
        }
        if (touches) inert.push_back(size_t(cell));
      }
  for (const std::size_t cell : inert) {
    cells.region[cell] = no_region;
    cells.fraction[cell] = 0;
  }
}

/// Tissue that no face joins to more than a thousandth of the whole never conducts: none.
void drop_splinters(LabelCells& cells) {
  const auto nx = std::int64_t{cells.grid.cells[0]}, nxy = nx * cells.grid.cells[1], size = cells.grid.size();
  const std::int64_t steps[] = {-1, 1, -nx, nx, -nxy, nxy};
  std::vector<bool> seen(cells.region.size(), false);
  const auto all =
      std::count_if(cells.region.begin(), cells.region.end(), [](std::uint8_t r) { return r != no_region; });
  std::vector<std::int64_t> part;
  for (std::int64_t seed = 0; seed < size; ++seed) {
    if (seen[size_t(seed)] || cells.region[size_t(seed)] == no_region) continue;
    part.assign(1, seed);
    seen[size_t(seed)] = true;
    for (std::size_t i = 0; i < part.size(); ++i)
      for (const std::int64_t step : steps) {
        const std::int64_t next = part[i] + step;
        if (next < 0 || next >= size || seen[size_t(next)] || cells.region[size_t(next)] == no_region)
          continue;
        seen[size_t(next)] = true;
        part.push_back(next);
      }
    if (double(part.size()) >= least_share_of_tissue * double(all)) continue;
    for (const std::int64_t cell : part) {
      cells.region[size_t(cell)] = no_region;
      cells.fraction[size_t(cell)] = 0;
    }
  }
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

/// Fills `direction` and `coordinates` of every tissue cell. u and the distance as in tissue_coordinates of
/// kernels/geometry_heart.clh, the analytic surfaces replaced by those of the labels.
void locate(const FineLabels& fine, const LabelHeart& heart, LabelCells& cells) {
  const Distances d = distances(fine, heart);
  const Bundle bundle(fine, heart.region_index("bachmann"));
  const LabelLandmarks& marks = cells.landmarks;
  const Grid& grid = cells.grid;
  constexpr double thinnest = 0.1;  // mm
  const auto depth = [&](const std::string& name, const Vector& p) -> std::array<double, 2> {
    // Above the base there is the outflow alone: what its wall stands on there is no endocardium.
    const Field& right = p[2] > 0 && !d.rv_outflow.empty() ? d.rv_outflow : d.rv;
    if (name == "rv") return {right.empty() ? 0 : right(p), d.background.empty() ? 0 : d.background(p)};
    if (name == "la" && !d.la.empty()) return {d.la(p), d.background(p)};
    if (name == "ra" && !d.ra.empty()) return {d.ra(p), d.background(p)};
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

}  // namespace

std::shared_ptr<const LabelCells> label_cells(const Scene& scene) {
  const LabelHeart& heart = *scene.labels;
  const Grid grid = make_grid(scene, {});
  std::string key = fmt::format("{:.17g}", grid.dx_mm);
  for (const Parameter& p : scene.parameters.all())
    if (p.path.starts_with("geometry.grown.")) key += fmt::format(" {:.17g}", p.value);
  const std::scoped_lock lock(heart.cache.mutex);
  if (heart.cache.cells && heart.cache.key == key) return heart.cache.cells;
  auto cells = std::make_shared<LabelCells>();
  cells->grid = grid;
  const FineLabels fine = fine_labels(scene, grid, cells->landmarks);
  cells->volume_mL.assign(256, 0.0);
  for (const Part part : fine.parts) ++cells->volume_mL[part];
  for (double& volume : cells->volume_mL) volume *= std::pow(fine.spacing_mm, 3) / 1000;
  classify(fine, heart, *cells);
  separate(heart, *cells);
  drop_splinters(*cells);
  locate(fine, heart, *cells);
  heart.cache.key = key;
  heart.cache.cells = cells;
  return cells;
}

}  // namespace cohort
