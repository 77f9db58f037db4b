#include "solver/solid.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "solver/circulation.hpp"
#include "solver/energy_balance.hpp"
#include "solver/geometry.hpp"
#include "solver/lumped_circulation.hpp"
#include "solver/mechanics.hpp"
#include "solver/new_buffer.hpp"
#include "solver/precision.hpp"
#include "solver/pv_output.hpp"
#include "solver/solid_labels.hpp"
#include "solver/solid_voids.hpp"
#include "solver/solid_walls.hpp"

namespace cohort {

namespace {

constexpr int samples_along_edge = 6;
constexpr int registers_of_forces =
    96;  // H200: 0.173 ms of 42 hearts at 2 mm, 0.205 without a limit, 0.176 with 80

std::vector<cl_ushort> members_of_blocks(const std::vector<int>& blocks, int count, int stride) {
  std::vector<cl_ushort> result(static_cast<std::size_t>(count), 0);
  for (std::size_t m = 0; stride > 0 && m + 1 < blocks.size(); ++m)
    for (int b = blocks[m]; b < blocks[m + 1]; ++b)
      result[static_cast<std::size_t>(b)] = static_cast<cl_ushort>(m / static_cast<std::size_t>(stride));
  return result;
}

}  // namespace

Solid::Solid(Launcher& launcher, const Scene& scene, const Definitions& definitions, const Grid& grid,
             int members, bool viscous, const std::vector<std::string>& more)
    : launcher_(launcher),
      scene_(scene),
      grid_(grid),
      capacity_(members),
      voids_(static_cast<int>(solid_voids(scene).size())),
      samples_(scene.circulation ? 0 : pv_times_ms(scene).size()),
      wide_(launcher.device().has_double()),
      viscous_(viscous),
      balances_(balances_energy(scene)) {
  Device& device = launcher.device();
  std::vector<std::string> files = geometry_files(scene);
  for (const std::string& file : solid_part_files(scene)) files.push_back(file);
  Definitions setup = definitions;
  setup.generated += geometry_source(scene) + solid_part_source(scene);
  const MechanicsText text = mechanics_text(scene);
  std::vector<std::string> options = {"SAMPLES=" + std::to_string(samples_along_edge),
                                      "SOLID_BLOCK=" + std::to_string(SolidMesh::block)};
  if (text.law.sheets) options.emplace_back("SHEETS");
  const cl::Program geometry = setup.build(device, files, options);
  const bool labels = scene.geometry == GeometryKind::labels;
  if (labels) {
    labels_ = solid_labels(scene, grid);
  } else {
    parts_ = launcher.handle(geometry, "solid_parts");
    vertex_voids_ = launcher.handle(geometry, "solid_vertex_voids");
  }
  fibres_ = launcher.handle(geometry, labels ? "solid_label_fibres" : "solid_fibres");

  Definitions stepping = definitions;
  stepping.generated += text.generated;
  const bool beats = scene.circulation.has_value();
  std::vector<std::string> parts;
  if (beats) {
    parts = {"circulation.clh", "beats.clh"};
    stepping.generated += circulation_tables(scene, !wide_) + "constant int chamber_of_cavity[] = {";
    for (const Mechanics::Cavity& cavity : scene.mechanics->cavities) {
      std::size_t chamber = 0;
      while (chamber < chamber_count && cavity.name != chamber_names[chamber]) ++chamber;
      stepping.generated += std::to_string(chamber) + ",";
    }
    stepping.generated += "};\n";
  } else if (!wide_) {
    stepping.generated += "#define CIRCULATION_SINGLE\n";
  }
  parts.emplace_back("solid_tile.clh");
  parts.emplace_back("solid.clh");
  parts.emplace_back("tension_drive.clh");
  const bool windows = std::find(more.begin(), more.end(), "WINDOWS=1") != more.end();
  parts.insert(parts.end(), text.files.begin(), text.files.end());
  for (const char* file : {"solid_reduce.clh", "solid_energy.clh", "solid_cells.clh"})
    parts.emplace_back(file);
  std::vector<std::string> of_forces = parts;
  of_forces.emplace_back("solid_forces.cl");
  for (const char* file : {"solid_nodes.cl", "solid_measure.cl", "solid_look.clh", "solid_energy.cl"})
    parts.emplace_back(file);
  if (scene.displacement) parts.emplace_back("solid_record.cl");
  // Halts that find rest need the fastest modes resolved in time: no share of them is looked for.
  const bool waves = !viscous && !scene.mechanics->quasi_static;
  if (waves) parts.emplace_back("solid_waves.cl");
  if (windows) parts.emplace_back("solid_windows.cl");
  parts.emplace_back(beats ? "solid_beat.cl" : "solid_load.cl");
  options = {"SOLID_BLOCK=" + std::to_string(SolidMesh::block),
             "CAVITIES=" + std::to_string(scene.mechanics->cavities.size()),
             "MASS_FLOOR=R(" + std::to_string(SolidMesh::mass_floor) + ")",
             "MOST_SLOTS=" + std::to_string(8 * SolidMesh::block),
             "MEMBER_GROUP=" + std::to_string(member_group),
             std::string("BEATS=") + (beats ? "1" : "0")};
  options.emplace_back(std::string("ENERGY=") + (balances_ ? "1" : "0"));
  if (viscous) options.emplace_back("VISCOUS");
  options.insert(options.end(), more.begin(), more.end());
  program_ = stepping.build(device, parts, options);
  // In a program of its own: with fewer registers it is faster in single precision, the others are slower.
  if (scene.precision == Precision::single_)
    for (const std::string& option : device.register_cap(registers_of_forces)) options.push_back(option);
  const cl::Program forces = stepping.build(device, of_forces, options);
  tension_states_ = text.tension.states;
  sheets_ = text.law.sheets;
  forces_ = launcher.handle(forces, "solid_forces");
  predict_ = launcher.handle(program_, "solid_predict");
  member_ = launcher.handle(program_, beats ? "solid_beat" : "solid_load");
  move_ = launcher.handle(program_, "solid_move");
  measure_ = launcher.handle(program_, "solid_measure");
  if (windows) release_ = launcher.handle(program_, "solid_release");
  bound_ = launcher.handle(program_, "solid_bound");
  if (balances_) find_dashpots_ = launcher.handle(program_, "solid_dashpots");
  if (!waves) return;  // steps are bounded cell by cell
  wave_start_ = launcher.handle(program_, "solid_wave_start");
  wave_cells_ = launcher.handle(program_, "solid_wave_cells");
  wave_nodes_ = launcher.handle(program_, "solid_wave_nodes");
  wave_member_ = launcher.handle(program_, "solid_wave_member");
}

std::size_t Solid::bytes_of_tile() const {
  return real_bytes(scene_.precision) *
         static_cast<std::size_t>(std::max(8 * mesh_.most_slots, SolidMesh::block));
}

void Solid::build(const cl::Buffer& parameters, std::span<const Member> members) {
  parameters_ = parameters;
  members_ = static_cast<int>(members.size());
  odd_ = 0;
  release();
  mesh_ = build_solid_mesh(
      scene_, grid_, labels_ ? for_members(labels_->parts, members_) : find_parts(parameters), members_);
  if (const Device& device = launcher_.device(); device.info().gpu && bytes_of_tile() > device.local_bytes())
    throw std::runtime_error(
        fmt::format("mechanics: a tile of {} nodes needs {} bytes of local memory, the device has {}: tissue "
                    "in scattered "
                    "cells? A larger mechanics.dx_mm or single precision may do",
                    mesh_.most_slots, bytes_of_tile(), device.local_bytes()));
  upload(parameters, members);
  build_supports(members);
  // Halts that find rest need the fastest modes resolved in time.
  if (!viscous_ && !scene_.mechanics->quasi_static) find_fastest_mode(parameters);
}

SolidParts Solid::find_parts(const cl::Buffer& parameters) {
  const auto& [nx, ny, nz] = grid_.cells;
  const auto members = static_cast<std::size_t>(members_);
  const auto cells = static_cast<std::size_t>(grid_.size()) * members;
  const auto planes = static_cast<std::size_t>(nz) * members;
  const cl::Buffer counts = launcher_.device().allocate(
      cells * static_cast<std::size_t>(4 * (voids_ + 1)) * sizeof(cl_ushort), "counts");
  const cl::Buffer region = launcher_.device().allocate(cells, "region");
  launcher_(parts_, cl::NDRange(static_cast<std::size_t>(nx), static_cast<std::size_t>(ny), planes),
            launcher_.device().info().gpu ? cl::NullRange : cl::NDRange(8, 1, 1),
            static_cast<double>(cells) * (2 + voids_), parameters, grid_.origin_and_spacing(), counts,
            region);
  SolidParts parts;
  parts.samples = 3 * samples_along_edge * samples_along_edge * samples_along_edge;
  parts.counts.resize(cells * static_cast<std::size_t>(4 * (voids_ + 1)));
  parts.region.resize(cells);
  launcher_.queue().enqueueReadBuffer(counts, CL_TRUE, 0, parts.counts.size() * sizeof(cl_ushort),
                                      parts.counts.data());
  launcher_.queue().enqueueReadBuffer(region, CL_TRUE, 0, parts.region.size(), parts.region.data());
  return parts;
}

void Solid::upload(const cl::Buffer& parameters, std::span<const Member> members) {
  const auto n = [](int count) { return static_cast<std::size_t>(count); };
  Device& device = launcher_.device();
  const std::size_t real = real_bytes(scene_.precision);
  const std::size_t cavities = scene_.mechanics->cavities.size();
  member_of_cell_ = upload_new(
      launcher_, members_of_blocks(mesh_.cell_blocks, mesh_.cells / SolidMesh::block, 1), "member of cell");
  member_of_node_ = upload_new(
      launcher_, members_of_blocks(mesh_.node_blocks, mesh_.nodes / SolidMesh::block, 1), "member of node");
  member_of_item_ = upload_new(
      launcher_,
      members_of_blocks(mesh_.item_blocks, mesh_.items / SolidMesh::block, static_cast<int>(cavities)),
      "member of item");
  cell_nodes_ = upload_new(launcher_, mesh_.cell_nodes, "cell nodes");
  share_ = reals(mesh_.share);
  region_ = upload_new(launcher_, mesh_.region, "region");
  tile_slots_ = upload_new(launcher_, mesh_.tile_slots, "tile slots");
  slot_node_ = upload_new(launcher_, mesh_.slot_node, "slot node");
  cell_slots_ = upload_new(launcher_, mesh_.cell_slots, "cell slots");
  corners_ = upload_new(launcher_, mesh_.corners, "corners");
  first_slot_ = upload_new(launcher_, mesh_.first_slot, "first slot");
  node_slots_ = upload_new(launcher_, mesh_.node_slots, "node slots");
  cavity_block_ = upload_new(launcher_, mesh_.cavity_block, "cavity block");
  std::vector<int> ends;
  for (std::size_t m = 0; m < members.size(); ++m) {
    int end = mesh_.node_blocks[m + 1];
    while (end > mesh_.node_blocks[m] && mesh_.cavity_block[n(end - 1)] == 0) --end;
    ends.push_back(end);
  }
  cavity_ends_ = upload_new(launcher_, ends, "cavity ends");
  std::vector<int> moving;
  for (int b = 0; b < mesh_.nodes / SolidMesh::block; ++b)
    if (!scene_.circulation || mesh_.cavity_block[n(b)] != 0) moving.push_back(b);
  moving_blocks_ = static_cast<int>(moving.size());
  moving_ = upload_new(launcher_, moving, "moving");
  item_cell_ = upload_new(launcher_, mesh_.item_cell, "item cell");
  item_cavity_ = upload_new(launcher_, mesh_.item_cavity, "item cavity");
  item_share_ = reals(mesh_.item_share);
  item_faces_ = reals(mesh_.item_faces);
  item_tile_slots_ = upload_new(launcher_, mesh_.item_tile_slots, "item tile slots");
  item_slot_node_ = upload_new(launcher_, mesh_.item_slot_node, "item slot node");
  item_slots_ = upload_new(launcher_, mesh_.item_slots, "item slots");
  position_ = reals(mesh_.position);
  lid_ = reals(mesh_.lid);
  constexpr unsigned cavity_bits = 28;  // as in kernels/solid_nodes.cl
  std::vector<cl_uint> cavity_of(mesh_.cavity_of.size(), 0);
  for (std::size_t a = 0; a < cavity_of.size(); ++a) {
    if (mesh_.cavity_of[a] < 0) continue;
    cavity_of[a] = static_cast<cl_uint>(mesh_.cavity_of[a]);
    for (std::size_t q = 0; q < cavities; ++q)
      if (const std::size_t place = q * n(mesh_.cavity_nodes) + n(mesh_.cavity_of[a]);
          mesh_.cavity_first[place + 1] > mesh_.cavity_first[place])
        cavity_of[a] |= 1u << (cavity_bits + q);
  }
  cavity_of_ = upload_new(launcher_, cavity_of, "cavity of");
  cavity_first_ = upload_new(launcher_, mesh_.cavity_first, "cavity first");
  cavity_slots_ = upload_new(launcher_, mesh_.cavity_slots, "cavity slots");
  node_blocks_ = upload_new(launcher_, mesh_.node_blocks, "node blocks");
  cell_blocks_ = upload_new(launcher_, mesh_.cell_blocks, "cell blocks");
  item_blocks_ = upload_new(launcher_, mesh_.item_blocks, "item blocks");

  direction_ = device.allocate(n(mesh_.cells) * (sheets_ ? 24 : 12) * real, "direction");
  if (labels_) {
    std::vector<int> place(n(mesh_.cells), -1);
    for (std::size_t i = 0; i < place.size(); ++i)
      if (mesh_.grid_cell[i] >= 0) place[i] = labels_->place[n(mesh_.grid_cell[i]) % labels_->place.size()];
    launcher_(fibres_, cl::NDRange(n(mesh_.cells)), cl::NDRange(SolidMesh::block), 0.0, parameters,
              member_of_cell_, upload_new(launcher_, place), region_,
              upload_new(launcher_, labels_->direction), direction_);
  } else {
    const cl::Buffer grid_cell = upload_new(launcher_, mesh_.grid_cell, "grid cell");
    launcher_(fibres_, cl::NDRange(n(mesh_.cells)), cl::NDRange(SolidMesh::block), 0.0, parameters,
              grid_.origin_and_spacing(), grid_cell, region_, direction_);
  }
  launcher_.queue().finish();

  std::vector<double> inverse(mesh_.inverse_mass);
  const auto density = n(scene_.parameters.index("mechanics.density_mg_per_mm3"));
  for (std::size_t m = 0; m < members.size(); ++m)
    for (int a = mesh_.node_blocks[m] * SolidMesh::block; a < mesh_.node_blocks[m + 1] * SolidMesh::block;
         ++a)
      inverse[n(a)] /= members[m].values[density];
  inverse_mass_ = reals(inverse);
  u_ = zeros(3 * n(mesh_.nodes));
  v_ = zeros(3 * n(mesh_.nodes));
  force_ = zeros(3 * mesh_.slot_node.size());
  pulls_ = zeros(n(mesh_.cells / SolidMesh::block));
  gradient_ = zeros(3 * mesh_.item_slot_node.size());
  volume_ = zeros(n(mesh_.items / SolidMesh::block));
  cavity_gradient_ = zeros(3 * cavities * n(mesh_.cavity_nodes));
  activation_ = zeros(n(mesh_.cells));
  drive_ = drive_column_ = reals({});
  std::vector<double> tension(n(tension_fields() * mesh_.cells), 0);
  for (std::size_t i = 0; i < n(mesh_.cells); ++i)
    for (int k = tension_states_; k < tension_fields(); k += 2)
      tension[SolidMesh::in_tile(i, n(k), n(tension_fields()))] = 1;  // stretch
  tension_ = reals(tension);
  const std::size_t sums = 4 + cavities + cavities * (cavities + 1) / 2;
  node_sums_ = zeros(sums * n(mesh_.nodes / SolidMesh::block));
  measures_ = zeros((balances_ ? 4 : 2) * n(mesh_.cells / SolidMesh::block));
  dashpots_ = zeros(balances_ ? n(mesh_.nodes / SolidMesh::block) : 0);
  cell_bounds_ = zeros(n(mesh_.cells));
  speeds_ = zeros(n(mesh_.nodes / SolidMesh::block));
  std::vector<double> state(members.size() * state_size, 0), inflation, mass_damping, pressures;
  for (std::size_t m = 0; m < members.size(); ++m) {
    const auto value = [&](const std::string& path) {
      return members[m].values[n(scene_.parameters.index("mechanics." + path))];
    };
    mass_damping.push_back(value("damping_per_ms"));
    state[m * state_size + Slot::pressure_share] = 1;
    state[m * state_size + Slot::beat_time] = scene_.circulation ? -1 : 0;
    constexpr double endless = 1e9;  // ms: without a circulation nothing comes again
    state[m * state_size + Slot::beat_length] = endless;
    state[m * state_size + Slot::damping] = scene_.mechanics->quasi_static ? 0 : mass_damping.back();
    if (!scene_.circulation)
      for (const Mechanics::Cavity& cavity : scene_.mechanics->cavities)
        pressures.push_back(cavity.pressure == Mechanics::Cavity::Pressure::constant
                                ? value("cavities." + cavity.name + ".pressure_kPa")
                                : 0);
    if (!scene_.circulation) continue;
    constexpr double kPa_per_mmHg = 1 / 7.50061683;
    inflation.push_back(value("inflation.duration_ms"));
    inflation.push_back(value("inflation.damping_per_ms"));
    for (const Mechanics::Cavity& cavity : scene_.mechanics->cavities)
      inflation.push_back(value("inflation." + cavity.name + "_pressure_mmHg") * kPa_per_mmHg);
  }
  set_state(state);
  damping_ = reals(mass_damping);
  inflation_ = reals(inflation);
  pressures_ = reals(pressures);
  series_ = upload_new(
      launcher_,
      std::vector<float>(members.size() * 2 * cavities * samples_, std::numeric_limits<float>::quiet_NaN()),
      "series");
  if (scene_.circulation) return;
  const bool still = scene_.mechanics->quasi_static;
  const auto structural = [&](const char* path) { return scene_.parameters.value(path); };
  loads_ = {structural("mechanics.load.ramp_ms"),
            still ? structural("mechanics.load.at_most_ms") : structural("time.end_ms"),
            still ? structural("mechanics.load.tolerance") : 0, still ? 1.0 : 0.0};
}

void Solid::activate(const std::vector<float>& times) {
  activation_ = reals(std::vector<double>(times.begin(), times.end()));
}

void Solid::release(double time_ms) {
  const double whole = std::floor(time_ms);
  launcher_.counted(release_, static_cast<std::size_t>(members_), 0, state_, Real{whole},
                    Real{time_ms - whole}, odd_);
}

void Solid::drive(const cl::Buffer& values, const cl::Buffer& column, const Real4& clock) {
  drive_ = values;
  drive_column_ = column;
  drive_clock_ = clock;
}

void Solid::drive(const cl::Buffer& values, const std::vector<double>& column, const Real4& clock) {
  drive(values, reals(column), clock);
}

}  // namespace cohort
