#include "solver/tissue.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "solver/electrophysiology.hpp"
#include "solver/geometry.hpp"
#include "solver/labels.hpp"
#include "solver/parameter_block.hpp"
#include "solver/precision.hpp"

namespace cohort {

namespace {

int round_up(int value, int multiple) {
  return (value + multiple - 1) / multiple * multiple;
}

template <typename T>
void upload(cl::CommandQueue& queue, const cl::Buffer& buffer, const std::vector<T>& host) {
  queue.enqueueWriteBuffer(buffer, CL_TRUE, 0, host.size() * sizeof(T), host.data());
}

}  // namespace

cl::Program Definitions::build(Device& device, const std::vector<std::string>& files,
                               const std::vector<std::string>& more) const {
  std::vector<std::string> all = options;
  all.insert(all.end(), more.begin(), more.end());
  return device.build(files, all, generated);
}

Grid make_grid(const Scene& scene, std::span<const Member> members) {
  Grid grid{};
  grid.dx_mm = scene.parameters.value("grid.dx_mm");
  std::array<double, 3> lower{}, upper{};
  lower.fill(1e30);
  upper.fill(-1e30);
  const auto include = [&](const std::vector<double>& values) {
    const Extent extent = geometry_extent(scene, values);
    for (size_t axis = 0; axis < 3; ++axis) {
      lower[axis] = std::min(lower[axis], extent.lower[axis]);
      upper[axis] = std::max(upper[axis], extent.upper[axis]);
    }
  };
  for (const Member& member : members) include(member.values);
  if (members.empty()) {
    std::vector<double> values = scene.parameters.values();
    scene.parameters.resolve(values);
    include(values);
  }
  constexpr double rounding = 1e-6;  // cells; an extent on a face must not take another cell
  constexpr int free_layers = 2;     // one that a cut cell may reach into, one that stays free
  for (size_t axis = 0; axis < 3; ++axis) {
    const double first = std::floor(lower[axis] / grid.dx_mm + rounding) - free_layers;
    const double last = std::ceil(upper[axis] / grid.dx_mm - rounding) + free_layers;
    grid.origin_mm[axis] = first * grid.dx_mm;
    if (!(last - first < 1e6))
      throw std::invalid_argument("the grid would have more than a million cells along an axis");
    grid.cells[axis] = static_cast<int>(last - first);
  }
  grid.cells[0] = round_up(grid.cells[0], Tissue::lanes);
  return grid;
}

Definitions scene_definitions(const Scene& scene, const Grid& grid) {
  Definitions result;
  const RegionParameters regions = region_parameters(scene);
  std::string excitable = "{", slot = "constant int region_slot[] = {",
              bath = "constant int bath_parameter[] = {";
  for (size_t r = 0; r < scene.regions.size(); ++r) {
    excitable += scene.regions[r].excitable ? "1," : "0,";
    slot += std::to_string(regions.slot[r]) + ",";
    bath += std::to_string(regions.bath[r]) + ",";
  }
  result.generated = parameter_macros(scene.parameters) + slot + "};\n" + bath +
                     "};\n#define EXCITABLE_TABLE " + excitable + "}\n";
  const auto define = [&](const std::string& name, int value) {
    result.options.push_back(name + "=" + std::to_string(value));
  };
  define("NX", grid.cells[0]);
  define("NY", grid.cells[1]);
  define("NZ", grid.cells[2]);
  define("BLOCK", Tissue::block_cells);
  define("PARAMETERS", scene.parameters.size());
  define("REGION_FIRST", regions.first);
  define("REGION_STRIDE", regions.stride);
  define("REGION_SLOTS", regions.slots);
  define("REGION_VELOCITY_OFFSET", regions.velocity_offset);
  if (scene.precision == Precision::double_) result.options.push_back("DOUBLE");
  return result;
}

Tissue::Tissue(Launcher& launcher, const Scene& scene, const Grid& grid, int members, Holds holds)
    : launcher_(launcher),
      device_(launcher.device()),
      precision_(scene.precision),
      grid_(grid),
      definitions_(scene_definitions(scene, grid)),
      capacity_members_(members) {
  if (grid.size() * members >= std::int64_t{1} << 31)
    throw std::runtime_error("a batch of " + std::to_string(members) + " members on " +
                             std::to_string(grid.size()) + " cells is larger than 2^31 cells");
  Definitions definitions = definitions_;
  if (holds == Holds::conductors) {
    definitions.generated += "#undef EXCITABLE_TABLE\n#define EXCITABLE_TABLE {";
    for (const Region& part : scene.regions)
      definitions.generated += part.excitable || part.bath ? "1," : "0,";
    definitions.generated += "}\n";
  }
  std::vector<std::string> files = geometry_files(scene);
  files.insert(files.end(), {"segments.clh", "tissue.cl"});
  const bool labels = scene.geometry == GeometryKind::labels;
  if (labels) {
    files.insert(files.end(), {"label_fibres.clh", "labels.cl"});
    labels_ = label_cells(scene);
  }
  if (scene.conduction_system || !scene.heterogeneity.parameters.empty())
    definitions.options.emplace_back("COORDINATES");
  const cl::Program program =
      device_.build(files, definitions.options, definitions.generated + geometry_source(scene));
  if (!labels) classify_ = launcher.handle(program, "classify_cells");
  flag_segments_ = launcher.handle(program, "flag_segments");
  gather_ = launcher.handle(program, "gather_cells");
  link_ = launcher.handle(program, "link_segments");
  fibre_field_ = launcher.handle(program, labels ? "label_fibres" : "fibre_field");
  coordinate_field_ = launcher.handle(program, labels ? "label_coordinates" : "coordinate_field");

  const auto cells = static_cast<std::size_t>(grid.size()) * static_cast<std::size_t>(members);
  grid_region_ = device_.allocate(cells, "grid region");
  grid_fraction_ = device_.allocate(cells * sizeof(float), "grid fraction");
  flag_ = device_.allocate(cells / lanes, "flag");
  place = device_.allocate(cells / lanes * sizeof(int), "place");
}

std::size_t Tissue::bytes(const Grid& grid, int members, std::int64_t stride, Precision precision) {
  const auto cells = static_cast<std::size_t>(grid.size()) * static_cast<std::size_t>(members);
  const auto compact = static_cast<std::size_t>(stride);
  return cells * (1 + sizeof(float)) + cells / lanes * (1 + sizeof(int)) +
         compact / lanes * (sizeof(int) + sizeof(cl_ushort) + sizeof(cl_int8)) +
         compact * (1 + 5 * real_bytes(precision));
}

void Tissue::compact(const std::vector<std::uint8_t>& flags, int members) {
  const auto runs = static_cast<std::size_t>(grid_.size() / lanes);
  places.assign(runs * static_cast<std::size_t>(members), 1);
  first_cells.assign(first_cell_place / lanes, -1);
  first_block.assign(1, 0);
  std::vector<cl_ushort> member_of_host(first_cells.size(), 0);
  constexpr std::size_t block_segments = block_cells / lanes;
  for (int m = 0; m < members; ++m) {
    const std::size_t first_run = static_cast<std::size_t>(m) * runs;
    for (std::size_t run = first_run; run < first_run + runs; ++run) {
      if (!flags[run]) continue;
      places[run] = static_cast<int>(first_cells.size());
      first_cells.push_back(static_cast<int>(run * lanes));
    }
    // At least one void segment behind every member: an unstable neighbour in memory must never be read with
    // weight.
    do first_cells.push_back(-1);
    while ((first_cells.size() - first_cell_place / lanes) % block_segments != 0);
    member_of_host.resize(first_cells.size(), static_cast<cl_ushort>(m));
    first_block.push_back(static_cast<int>((first_cells.size() - first_cell_place / lanes) / block_segments));
  }
  blocks = first_block.back();
  for (int margin = 0; margin < first_cell_place / lanes; ++margin) first_cells.push_back(-1);
  member_of_host.resize(first_cells.size(), 0);
  stride = static_cast<int>(first_cells.size()) * lanes;

  if (stride > capacity_stride_) {
    capacity_stride_ = stride + stride / 16;  // room for the next members, whose hearts differ a little
    const auto cells = static_cast<std::size_t>(capacity_stride_);
    first_cell = device_.allocate(cells / lanes * sizeof(int), "first cell");
    member_of = device_.allocate(cells / lanes * sizeof(cl_ushort), "member of");
    neighbours = device_.allocate(cells / lanes * sizeof(cl_int8), "neighbours");
    region = device_.allocate(cells, "region");
    capacity = device_.allocate(cells * real_bytes(precision_), "capacity");
    inverse_capacity = device_.allocate(cells * real_bytes(precision_), "inverse capacity");
    fibre = device_.allocate(3 * cells * real_bytes(precision_), "fibre");
  }
  cl::CommandQueue& queue = launcher_.queue();
  upload(queue, first_cell, first_cells);
  upload(queue, member_of, member_of_host);
  upload(queue, place, places);
}

void Tissue::build(const cl::Buffer& parameters, int members) {
  const auto& [nx, ny, nz] = grid_.cells;
  cl::CommandQueue& queue = launcher_.queue();
  const auto cells = static_cast<std::size_t>(grid_.size()) * static_cast<std::size_t>(members);
  if (labels_)
    upload_labels(members);
  else
    launcher_(classify_, cl::NDRange(nx, ny, static_cast<size_t>(nz) * static_cast<size_t>(members)),
              device_.info().gpu ? cl::NullRange : cl::NDRange(lanes, 1, 1), 5.0 * static_cast<double>(cells),
              parameters, grid_.origin_and_spacing(), grid_region_, grid_fraction_);
  launcher_(flag_segments_, cl::NDRange(cells / lanes), cl::NullRange, 1.125 * static_cast<double>(cells),
            grid_region_, flag_);
  std::vector<std::uint8_t> flags(cells / lanes);
  queue.enqueueReadBuffer(flag_, CL_TRUE, 0, flags.size(), flags.data());
  compact(flags, members);

  const auto n = static_cast<std::size_t>(stride);
  const double size = static_cast<double>(n);
  launcher_(gather_, cl::NDRange(n), cl::NDRange(group),
            size * (6.5 + 2.0 * static_cast<double>(real_bytes(precision_))), grid_region_, grid_fraction_,
            first_cell, region, capacity, inverse_capacity);
  launcher_(link_, cl::NDRange(n / lanes), cl::NDRange(group / lanes), size / lanes * 68, first_cell, place,
            neighbours, static_cast<int>(cells));
  regions.resize(n);
  queue.enqueueReadBuffer(region, CL_TRUE, 0, n, regions.data());

  tissue_cells.assign(static_cast<size_t>(members), 0);
  touches_boundary.assign(static_cast<size_t>(members), false);
  for (std::size_t s = 0; s < first_cells.size(); ++s) {
    if (first_cells[s] < 0) continue;
    const auto member = static_cast<std::size_t>(first_cells[s] / grid_.size());
    const auto cell = first_cells[s] % grid_.size();
    const auto x = cell % nx, y = cell / nx % ny, z = cell / (std::int64_t{nx} * ny);
    const bool rim = y == 0 || y == ny - 1 || z == 0 || z == nz - 1;
    for (int lane = 0; lane < lanes; ++lane) {
      if (regions[s * lanes + static_cast<size_t>(lane)] == 255) continue;
      ++tissue_cells[member];
      if (rim || x + lane == 0 || x + lane == nx - 1) touches_boundary[member] = true;
    }
  }
}

// Cells of a label map stay as they are from batch to batch; only more members ask for more copies.
void Tissue::upload_labels(int members) {
  const auto cells = static_cast<std::size_t>(grid_.size());
  if (labels_->grid.cells != grid_.cells || labels_->grid.origin_mm != grid_.origin_mm)
    throw std::logic_error("a label map was sampled on another grid");
  for (; label_members_ < members; ++label_members_) {
    const auto first = static_cast<std::size_t>(label_members_) * cells;
    launcher_.queue().enqueueWriteBuffer(grid_region_, CL_TRUE, first, cells, labels_->region.data());
    launcher_.queue().enqueueWriteBuffer(grid_fraction_, CL_TRUE, first * sizeof(float),
                                         cells * sizeof(float), labels_->fraction.data());
  }
}

// Tables by place in member 0's compact fields.
void Tissue::build_label_tables() {
  if (label_direction_() != nullptr) return;
  const auto member = static_cast<std::size_t>(first_cell_place + first_block[1] * block_cells);
  std::vector<float> direction(4 * member, 0.0f), position(4 * member, 0.0f);
  for (std::size_t t = 0; t < labels_->tissue.size(); ++t) {
    const auto cell = static_cast<std::size_t>(labels_->tissue[t]);
    const std::size_t at = static_cast<std::size_t>(places[cell / lanes]) * lanes + cell % lanes;
    for (std::size_t k = 0; k < 4; ++k) {
      direction[4 * at + k] = labels_->direction[4 * t + k];
      position[4 * at + k] = labels_->coordinates[4 * t + k];
    }
  }
  label_direction_ = device_.allocate(direction.size() * sizeof(float), "label direction");
  label_coordinates_ = device_.allocate(position.size() * sizeof(float), "label coordinates");
  upload(launcher_.queue(), label_direction_, direction);
  upload(launcher_.queue(), label_coordinates_, position);
}

void Tissue::build_fibres(const cl::Buffer& parameters) {
  const auto n = static_cast<std::size_t>(stride);
  const double bytes = static_cast<double>(n) * (1 + 3.0 * static_cast<double>(real_bytes(precision_)));
  if (labels_) {
    build_label_tables();
    launcher_(fibre_field_, cl::NDRange(n), cl::NDRange(group), bytes, parameters, first_cell, place,
              member_of, region, label_direction_, fibre, stride);
    return;
  }
  launcher_(fibre_field_, cl::NDRange(n), cl::NDRange(group), bytes, parameters, grid_.origin_and_spacing(),
            first_cell, member_of, region, fibre, stride);
}

void Tissue::build_coordinates(const cl::Buffer& parameters) {
  const auto n = static_cast<std::size_t>(stride), real = real_bytes(precision_);
  if (stride > coordinates_stride_) {
    coordinates_stride_ = capacity_stride_;
    coordinates = device_.allocate(4 * static_cast<std::size_t>(coordinates_stride_) * real, "coordinates");
  }
  if (labels_) {
    build_label_tables();
    launcher_(coordinate_field_, cl::NDRange(n), cl::NDRange(group),
              static_cast<double>(n) * (17 + 4.0 * static_cast<double>(real)), first_cell, place, region,
              label_coordinates_, coordinates, stride);
    return;
  }
  launcher_(coordinate_field_, cl::NDRange(n), cl::NDRange(group),
            static_cast<double>(n) * (1 + 4.0 * static_cast<double>(real)), parameters,
            grid_.origin_and_spacing(), first_cell, member_of, region, coordinates, stride);
}

std::optional<std::size_t> Tissue::cell_at(const std::array<std::int64_t, 3>& cell, std::size_t m) const {
  const auto& [nx, ny, nz] = grid_.cells;
  const auto& [x, y, z] = cell;
  if (x < 0 || y < 0 || z < 0 || x >= nx || y >= ny || z >= nz) return {};
  const std::int64_t place_in_grid = x + nx * (y + ny * (z + nz * static_cast<std::int64_t>(m)));
  const auto i = static_cast<std::size_t>(places[static_cast<std::size_t>(place_in_grid / lanes)]) * lanes +
                 static_cast<std::size_t>(place_in_grid % lanes);
  if (regions[i] == 255) return {};
  return i;
}

std::array<double, 3> Tissue::centre(std::size_t place_in_fields) const {
  const std::int64_t cell =
      (first_cells[place_in_fields / lanes] + static_cast<std::int64_t>(place_in_fields % lanes)) %
      grid_.size();
  const auto& [nx, ny, nz] = grid_.cells;
  const std::array<std::int64_t, 3> index = {cell % nx, cell / nx % ny, cell / (std::int64_t{nx} * ny)};
  std::array<double, 3> result{};
  for (size_t axis = 0; axis < 3; ++axis)
    result[axis] = grid_.origin_mm[axis] + grid_.dx_mm * (static_cast<double>(index[axis]) + 0.5);
  return result;
}

std::vector<std::uint8_t> Tissue::vertices(int members) {
  const auto& [nx, ny, nz] = grid_.cells;
  const auto count = static_cast<std::size_t>(nx + 1) * static_cast<std::size_t>(ny + 1) *
                     static_cast<std::size_t>(nz + 1) * static_cast<std::size_t>(members);
  const cl::Buffer types = device_.allocate(count, "types");
  if (classify_vertices_.program() == nullptr)
    classify_vertices_ = launcher_.handle(
        definitions_.build(device_, {"segments.clh", "classify_vertices.cl"}), "classify_vertices");
  launcher_(classify_vertices_,
            cl::NDRange(nx + 1, ny + 1, static_cast<size_t>(nz + 1) * static_cast<size_t>(members)),
            cl::NullRange, 2.0 * static_cast<double>(count), grid_region_, types);
  std::vector<std::uint8_t> host(count);
  launcher_.queue().enqueueReadBuffer(types, CL_TRUE, 0, count, host.data());
  return host;
}

}  // namespace cohort
