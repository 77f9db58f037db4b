// From fine labels to the tissue of the scene's grid: regions and fractions.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "solver/geometry_kinds.hpp"
#include "solver/label_coordinates.hpp"

namespace cohort {

namespace {

constexpr std::uint8_t no_region = 255;
constexpr double minimal_fraction = 0.05;       // as MINIMAL_FRACTION of kernels/signed_distance.clh
constexpr double least_share_of_tissue = 1e-3;  // of the parts that faces join: smaller ones are splinters

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
