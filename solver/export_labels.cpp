#include "solver/export_labels.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "solver/geometry.hpp"
#include "solver/parameter_block.hpp"
#include "solver/precision.hpp"

namespace cohort {

namespace {

constexpr std::uint8_t first_cavity = 128;
constexpr std::size_t cells_at_a_time = std::size_t{1} << 22;
constexpr double most_voxels = 2e9;

/// Label of a region in convention `cohort`; regions that no heart has follow from first_other_label.
std::int32_t label_of(const std::string& region, std::int32_t& next) {
  const auto it = std::find(std::begin(heart_regions), std::end(heart_regions), region);
  return it != std::end(heart_regions) ? static_cast<std::int32_t>(it - std::begin(heart_regions)) + 1
                                       : next++;
}

/// Samples a computed geometry; values as kernels/export_labels.cl gives them.
std::vector<std::uint8_t> sample(Device& device, const Scene& scene, const Member& member,
                                 const std::array<double, 3>& origin, const std::array<int, 3>& cells,
                                 double h) {
  std::vector<std::string> files = geometry_files(scene);
  files.push_back("export_labels.cl");
  std::vector<std::string> options;
  if (scene.geometry == GeometryKind::heart) options.push_back("CAVITIES");
  if (scene.precision == Precision::double_) options.push_back("DOUBLE");
  const cl::Program program =
      device.build(files, options, parameter_macros(scene.parameters) + geometry_source(scene));
  Launcher launcher(device, scene.precision);
  Launcher::Handle kernel = launcher.handle(program, "export_labels");
  const std::vector<std::byte> packed = pack(member.values, scene.precision);
  const cl::Buffer parameters = device.allocate(packed.size(), "parameters");
  launcher.queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());

  const auto layer = static_cast<std::size_t>(cells[0]) * static_cast<std::size_t>(cells[1]);
  const std::size_t layers = std::max<std::size_t>(1, cells_at_a_time / layer);
  constexpr std::size_t group = 64;
  const auto rounded = [&](std::size_t n) { return (n + group - 1) / group * group; };
  const cl::Buffer labels = device.allocate(rounded(layers * layer), "labels");
  std::vector<std::uint8_t> result(layer * static_cast<std::size_t>(cells[2]));
  for (std::size_t z = 0; z < static_cast<std::size_t>(cells[2]); z += layers) {
    const std::size_t count = std::min(layers, static_cast<std::size_t>(cells[2]) - z) * layer;
    launcher(kernel, cl::NDRange(rounded(count)), cl::NDRange(group), static_cast<double>(count), parameters,
             Real4{origin[0], origin[1], origin[2] + h * static_cast<double>(z), h},
             cl_int2{{cells[0], cells[1]}}, labels);
    launcher.queue().enqueueReadBuffer(labels, CL_TRUE, 0, count, &result[z * layer]);
  }
  return result;
}

}  // namespace

LabelImage label_image(Device& device, const Scene& scene, const Member& member, double spacing_mm) {
  const Grid grid = make_grid(scene, {&member, 1});
  // Fine enough to keep the ECG of the heart that is read back: solver/README.md, "What a heart loses".
  constexpr double fine_mm = 0.5, least_per_cell = 2, most_per_cell = 4;
  const double per_cell = std::clamp(std::ceil(grid.dx_mm / fine_mm - 1e-6), least_per_cell, most_per_cell);
  double h = spacing_mm > 0 ? spacing_mm : grid.dx_mm / per_cell;
  std::array<int, 3> cells;
  std::vector<std::uint8_t> voxels;
  std::vector<std::pair<std::string, Sphere>> sites;
  std::array<std::int32_t, 256> label{};  // of each value of a voxel
  std::int32_t next = first_other_label;
  std::string comment = "Cohort label map; lengths in mm, in the frame of the heart\n";
  const auto name_label = [&](std::size_t value, std::int32_t code, const std::string& name,
                              const char* kind) {
    label[value] = code;
    comment += fmt::format("label {} {} {}\n", code, name, kind);
  };
  const bool labels = scene.geometry == GeometryKind::labels;
  if (labels) {
    LabelLandmarks marks;
    FineLabels fine = fine_labels(scene, grid, marks);
    h = fine.spacing_mm;
    cells = fine.cells;
    voxels = std::move(fine.parts);
    sites = marks.sites;
  } else {
    double size = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      cells[a] = static_cast<int>(std::ceil(grid.cells[a] * grid.dx_mm / h - 1e-6));
      size *= cells[a];
    }
    if (size > most_voxels)
      throw std::runtime_error(fmt::format("a label map of {:.3g} voxels is too large", size));
    voxels = sample(device, scene, member, grid.origin_mm, cells, h);
    for (const std::string& name : stimulus_sites(scene.geometry))
      sites.emplace_back(name, site(scene, name, member.values));
  }
  const std::size_t regions = labels ? first_region_part : 1, blood = labels ? lv_blood_part : first_cavity;
  for (std::size_t r = 0; r < scene.regions.size(); ++r) {
    const std::int32_t code = label_of(scene.regions[r].name, next);
    if (code > 255) throw std::runtime_error("a label map holds no more regions than 155");
    name_label(regions + r, code, scene.regions[r].name, scene.regions[r].excitable ? "excitable" : "inert");
  }
  for (std::size_t b = 0; b < std::size(blood_names); ++b)
    if (labels || (scene.geometry == GeometryKind::heart && b < 4))
      name_label(blood + b, first_blood_label + static_cast<std::int32_t>(b), blood_names[b], "blood");
  for (const auto& [name, sphere] : sites)
    comment += fmt::format("site {} {:.6f} {:.6f} {:.6f} {:.6f}\n", name, sphere.centre[0], sphere.centre[1],
                           sphere.centre[2], sphere.radius);

  LabelImage image;
  image.cells = cells;
  for (std::size_t a = 0; a < 3; ++a) {
    image.to_world.row[a] = {0, 0, 0, grid.origin_mm[a] + 0.5 * h};
    image.to_world.row[a][a] = h;
  }
  image.comment = comment;
  image.orientation = "sform";
  image.labels.resize(256);
  for (std::int32_t value = 0; value < 256; ++value) image.labels[static_cast<std::size_t>(value)] = value;
  image.counts.assign(256, 0);
  image.voxels = std::move(voxels);
  for (std::uint8_t& voxel : image.voxels) ++image.counts[voxel = static_cast<std::uint8_t>(label[voxel])];
  return image;
}

}  // namespace cohort
