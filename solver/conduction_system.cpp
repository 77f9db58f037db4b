#include "solver/conduction_system.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "solver/geometry.hpp"
#include "solver/labels.hpp"

namespace cohort {

namespace {

using Surface = ConductionSystem::Surface;

const std::string root = "electrophysiology.conduction_system.";
const char* tuned = "fitted to a normal activation and ECG; sites as in Durrer et al. 1970";
constexpr int target_numbers = 4;

struct Defaults {
  const char* name;
  Surface surface;
  double height, angle_deg, time_ms;
};
constexpr Defaults normal_sites[] = {
    {"lv_septum", Surface::lv, 0.50, -15, 0},         {"lv_anterior", Surface::lv, 0.59, 84, 1},
    {"lv_inferior", Surface::lv, 0.44, -76, 1},       {"lv_lateral", Surface::lv, 0.40, 182, 7.5},
    {"rv_septum", Surface::rv_septum, 0.53, -3, 7.5}, {"rv_free_wall", Surface::rv_free_wall, 0.38, 36, 7}};

void check_conducts(const Scene& scene) {
  if (scene.geometry == GeometryKind::heart) return;
  if (scene.geometry != GeometryKind::labels)
    throw std::invalid_argument("electrophysiology.conduction_system: only the heart has one");
  const LabelHeart& heart = *scene.labels;
  for (const char* name : {"lv", "rv", "ra"})
    if (!heart.has(name))
      throw std::invalid_argument(std::string("electrophysiology.conduction_system: the label map has no ") +
                                  name);
  for (const Part blood : {lv_blood_part, rv_blood_part})
    if (!heart.has_blood(blood))
      throw std::invalid_argument(std::string("electrophysiology.conduction_system: the label map has no ") +
                                  blood_names[blood - lv_blood_part] + ", and so no endocardium");
}

/// Length, mm, of the apico-basal coordinate.
double apico_basal_length(const Scene& scene, std::span<const double> values) {
  if (scene.geometry == GeometryKind::labels) return label_cells(scene)->landmarks.lv_length;
  return values[static_cast<size_t>(scene.parameters.index("geometry.heart.lv_length_mm"))] *
         values[static_cast<size_t>(scene.parameters.index("geometry.heart.scale"))];
}

}  // namespace

std::vector<ConductionSystem::EarlySite> default_early_sites() {
  std::vector<ConductionSystem::EarlySite> sites;
  for (const Defaults& site : normal_sites) sites.push_back({site.name, site.surface});
  return sites;
}

void declare_conduction_system(Scene& scene) {
  if (!scene.conduction_system) return;
  check_conducts(scene);
  ParameterTable& table = scene.parameters;
  table.add({root + "sinoatrial_start_ms", "ms", 10, 0, 1e6, "when the sinoatrial node fires",
             "leaves a baseline before the P wave"});
  if (scene.conduction_system->kind == ConductionSystem::Kind::delay)
    table.add({root + "atrioventricular_delay_ms", "ms", 92, 0, 1000,
               "from the arrival at the atrioventricular node to time 0 of the early sites", tuned});
  table.add({root + "fast_layer_velocity_mm_per_ms", "mm/ms", 1.5, 0.1, 10,
             "conduction velocity of the subendocardial layer", tuned});
  table.add({root + "lv_fast_layer_height", "1", 0.85, 0, 1.2,
             "apico-basal coordinate up to which the left ventricle has it", tuned});
  table.add({root + "rv_fast_layer_height", "1", 1.0, 0, 1.2,
             "apico-basal coordinate up to which the right ventricle has it", tuned});
  if (scene.conduction_system->kind == ConductionSystem::Kind::path) return;
  for (const ConductionSystem::EarlySite& site : scene.conduction_system->early_sites) {
    Defaults place{"", site.surface, 0.5, 0, 0};
    for (const Defaults& normal : normal_sites)
      if (site.name == normal.name) place = normal;
    const std::string path = root + "early_sites." + site.name + ".";
    table.add({path + "height", "1", place.height, -0.2, 1.2, "apico-basal coordinate of the site", tuned});
    table.add({path + "angle_deg", "deg", place.angle_deg, -360, 360,
               "angle around the left ventricle's axis, 0 at the septum, 90 anterior", tuned});
    table.add({path + "time_ms", "ms", place.time_ms, 0, 1000, "after the first site", tuned});
  }
}

std::vector<std::uint8_t> activation_graphs(const Scene& scene) {
  if (scene.geometry != GeometryKind::heart && scene.geometry != GeometryKind::labels) return {};
  constexpr std::uint8_t atria = 1, ventricles = 2;
  std::vector<std::uint8_t> graphs;
  for (const Region& region : scene.regions) {
    if (region.name == "la" || region.name == "ra" || region.name == "bachmann")
      graphs.push_back(atria);
    else
      graphs.push_back(region.name == "conduction_path" ? atria | ventricles : ventricles);
  }
  return graphs;
}

/// A place for nearest_cells, and the wave that starts there.
struct ConductionNetwork::Target {
  std::string name;
  std::array<double, target_numbers> numbers;
  double start_ms;
  bool after_node;  ///< triggered by the atrioventricular node
  bool starts;      ///< the atrioventricular node itself starts no wave
};

std::vector<ConductionNetwork::Target> ConductionNetwork::targets(std::span<const double> values) const {
  const auto value = [&](const std::string& name) {
    return values[static_cast<size_t>(scene_.parameters.index(root + name))];
  };
  std::vector<Target> result;
  const auto add_node = [&](const std::string& name, double start_ms, bool starts) {
    const std::array<double, 3> p = site(scene_, name, values).centre;
    result.push_back({name, {0, p[0], p[1], p[2]}, start_ms, false, starts});
  };
  add_node("sinoatrial_node", value("sinoatrial_start_ms"), true);
  if (scene_.conduction_system->kind == ConductionSystem::Kind::path) return result;
  add_node("av_node", 0, false);
  const double length_mm = apico_basal_length(scene_, values);
  for (const ConductionSystem::EarlySite& early : scene_.conduction_system->early_sites) {
    const std::string path = "early_sites." + early.name + ".";
    const double kind = 1 + static_cast<double>(early.surface);
    // Above the layer there is nothing to start: at its rim.
    const double rim = value(early.surface == Surface::lv ? "lv_fast_layer_height" : "rv_fast_layer_height");
    result.push_back({early.name,
                      {kind, std::min(value(path + "height"), rim),
                       value(path + "angle_deg") * std::numbers::pi / 180, length_mm},
                      value("atrioventricular_delay_ms") + value(path + "time_ms"),
                      true,
                      true});
  }
  return result;
}

ConductionNetwork::ConductionNetwork(Launcher& launcher, const Scene& scene, const Definitions& definitions,
                                     int members_per_batch)
    : launcher_(launcher), scene_(scene), members_per_batch_(members_per_batch) {
  const std::vector<double> base = [&] {
    std::vector<double> values = scene.parameters.values();
    scene.parameters.resolve(values);
    return values;
  }();
  targets_ = static_cast<int>(targets(base).size());
  Device& device = launcher.device();
  std::vector<std::string> options = definitions.options;
  options.push_back("TARGETS=" + std::to_string(targets_));
  options.push_back("TARGET_NUMBERS=" + std::to_string(target_numbers));
  const cl::Program program = device.build({"segments.clh", "field_gradient.clh", "conduction_system.cl"},
                                           options, definitions.generated + geometry_source(scene));
  sheet_kernel_ = launcher.handle(program, "fast_layer");
  fibres_kernel_ = launcher.handle(program, "surface_fibres");
  nearest_ = launcher.handle(program, "nearest_cells");
  points_kernel_ = launcher.handle(program, "target_points");
  const auto rows = static_cast<std::size_t>(members_per_batch * targets_);
  target_block_ = device.allocate(rows * target_numbers * real_bytes(scene.precision), "target block");
  cells_ = device.allocate(rows * sizeof(int), "cells");
  points_ = device.allocate(4 * rows * real_bytes(scene.precision), "points");
  member_range_ =
      device.allocate(static_cast<std::size_t>(members_per_batch + 1) * sizeof(int), "member range");
}

std::size_t ConductionNetwork::bytes(const Scene& scene, int members, std::int64_t stride) {
  // Distance, speed, depth, fibres; Eikonal's metric, times and slowed depth.
  constexpr std::size_t of_sheet = 15;
  constexpr std::size_t small = 10;  // buffers that may be less than the least
  const std::size_t real = real_bytes(scene.precision);
  const bool delay = scene.conduction_system->kind == ConductionSystem::Kind::delay;
  const std::size_t sources = delay ? 1 + scene.conduction_system->early_sites.size() : 1,
                    targets = sources + (delay ? 1 : 0);
  // Places, cells and points of targets; of twice as many sources cells, triggers, their points, two times.
  const std::size_t of_member = targets * ((target_numbers + 4) * real + sizeof(int)) + sizeof(int) +
                                2 * sources * (2 * sizeof(int) + 10 * real);
  return static_cast<std::size_t>(stride) * (1 + of_sheet * real) +
         static_cast<std::size_t>(members) * of_member + small * Device::least_bytes;
}

void ConductionNetwork::assemble(const Tissue& tissue, const cl::Buffer& parameters,
                                 const cl::Buffer& velocity, std::span<const Member> members) {
  const std::size_t real = real_bytes(scene_.precision);
  if (tissue.stride > capacity_) {
    capacity_ = tissue.stride + tissue.stride / 16;
    const auto n = static_cast<std::size_t>(capacity_);
    fibres_ = launcher_.device().allocate(3 * n * real, "fibres");
    sheet_id_ = launcher_.device().allocate(n, "sheet id");
    sheet_speed_ = launcher_.device().allocate(n * real, "sheet speed");
    sheet_depth_ = launcher_.device().allocate(n * real, "sheet depth");
    sheet_distance_ = launcher_.device().allocate(n * real, "sheet distance");
  }
  cl::CommandQueue& queue = launcher_.queue();
  const auto n = static_cast<std::size_t>(tissue.stride);
  const double dx = tissue.grid().dx_mm;
  const int grid_cells = static_cast<int>(tissue.places.size()) * Tissue::lanes;
  launcher_(sheet_kernel_, cl::NDRange(n), cl::NDRange(Tissue::group),
            static_cast<double>(n) * (2 + 6 * static_cast<double>(real)), parameters, tissue.member_of,
            tissue.region, tissue.coordinates, velocity, tissue.fibre, tissue.first_cell, tissue.place,
            sheet_id_, sheet_speed_, sheet_depth_, sheet_distance_, tissue.stride, Real{dx}, grid_cells);

  launcher_(fibres_kernel_, cl::NDRange(n), cl::NDRange(Tissue::group),
            static_cast<double>(n) * (1 + 7 * static_cast<double>(real)), parameters, tissue.member_of,
            tissue.region, tissue.coordinates, tissue.fibre, tissue.first_cell, tissue.place, fibres_,
            tissue.stride, Real{dx}, grid_cells);

  std::vector<std::vector<Target>> wanted;
  std::vector<double> numbers;
  for (const Member& member : members) {
    wanted.push_back(targets(member.values));
    for (const Target& target : wanted.back())
      numbers.insert(numbers.end(), target.numbers.begin(), target.numbers.end());
  }
  const std::vector<std::byte> packed = pack(numbers, scene_.precision);
  queue.enqueueWriteBuffer(target_block_, CL_TRUE, 0, packed.size(), packed.data());
  queue.enqueueWriteBuffer(member_range_, CL_TRUE, 0, tissue.first_block.size() * sizeof(int),
                           tissue.first_block.data());
  const std::size_t rows = members.size() * static_cast<std::size_t>(targets_);
  const bool gpu = launcher_.device().info().gpu;
  const auto group = static_cast<std::size_t>(Tissue::block_cells);
  launcher_(nearest_, cl::NDRange(gpu ? rows * group : rows), cl::NDRange(gpu ? group : 1),
            static_cast<double>(n) * targets_ * 2, target_block_, tissue.grid().origin_and_spacing(),
            tissue.first_cell, member_range_, tissue.region, sheet_id_, sheet_depth_, tissue.coordinates,
            cells_, tissue.stride);
  launcher_.counted(points_kernel_, rows, 0, target_block_, cells_, tissue.grid().origin_and_spacing(),
                    tissue.first_cell, tissue.place, tissue.region, tissue.coordinates, points_,
                    tissue.stride, grid_cells);
  std::vector<int> cells(rows);
  queue.enqueueReadBuffer(cells_, CL_TRUE, 0, rows * sizeof(int), cells.data());
  std::vector<std::byte> raw(4 * rows * real);
  queue.enqueueReadBuffer(points_, CL_TRUE, 0, raw.size(), raw.data());
  const std::vector<double> points = unpack(raw, scene_.precision);

  sources_.clear();
  missing_.assign(members.size(), {});
  for (size_t m = 0; m < members.size(); ++m) {
    const std::size_t row = m * static_cast<size_t>(targets_);
    const int* cell = cells.data() + row;
    const auto point = [&](std::size_t k) {
      const double* p = points.data() + 4 * (row + k);
      return std::array<double, 3>{p[0], p[1], p[2]};
    };
    constexpr size_t node = 1;  // place of the atrioventricular node among the targets
    for (size_t k = 0; k < wanted[m].size(); ++k) {
      const Target& target = wanted[m][k];
      if (cell[k] < 0)
        missing_[m] = "conduction system: \"" + target.name + "\" finds no cell";
      else if (target.starts && !(target.after_node && cell[node] < 0))
        sources_.push_back({cell[k], target.start_ms, target.after_node ? cell[node] : -1, point(k),
                            target.after_node ? std::optional(point(node)) : std::nullopt});
    }
  }
}

}  // namespace cohort
