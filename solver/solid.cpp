#include "solver/solid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "solver/circulation.hpp"
#include "solver/geometry.hpp"
#include "solver/lumped_circulation.hpp"
#include "solver/mechanics.hpp"
#include "solver/precision.hpp"
#include "solver/pv_output.hpp"
#include "solver/solid_voids.hpp"
#include "solver/solid_walls.hpp"

namespace cohort {

namespace {

constexpr int samples_along_edge = 6, member_group = 256;
constexpr double courant = 0.95;

template <typename T>
cl::Buffer upload_new(Launcher& launcher, const std::vector<T>& host) {
  const cl::Buffer buffer = launcher.device().allocate(std::max<std::size_t>(1, host.size()) * sizeof(T));
  if (!host.empty())
    launcher.queue().enqueueWriteBuffer(buffer, CL_TRUE, 0, host.size() * sizeof(T), host.data());
  return buffer;
}

using Matrix = std::array<double, 6>;  // xx yy zz yz xz xy
constexpr std::array<std::array<std::size_t, 2>, 6> entries = {
    {{0, 0}, {1, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}};

/// Projects a symmetric matrix to Q A Q.
Matrix projected(const Matrix& Q, const Matrix& A) {
  const auto full = [](const Matrix& M) {
    return std::array<std::array<double, 3>, 3>{{{M[0], M[5], M[4]}, {M[5], M[1], M[3]}, {M[4], M[3], M[2]}}};
  };
  const auto q = full(Q), a = full(A);
  Matrix result{};
  for (std::size_t k = 0; k < 6; ++k)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) result[k] += q[entries[k][0]][i] * a[i][j] * q[j][entries[k][1]];
  return result;
}

/// A node and what resists its displacement, in some unit.
struct Held {
  int node;
  Matrix resists;
};

/// How many of the six rigid motions `held` leaves free.
int count_free_motions(const SolidMesh& mesh, const std::vector<Held>& held) {
  const auto nodes = static_cast<std::size_t>(mesh.nodes);
  std::array<double, 3> centre{};
  double radius = 0;
  const auto place = [&](const Held& one, std::size_t axis) {
    return mesh.position[axis * nodes + static_cast<std::size_t>(one.node)];
  };
  for (const Held& one : held)
    for (std::size_t axis = 0; axis < 3; ++axis) centre[axis] += place(one, axis) / double(held.size());
  for (const Held& one : held)
    for (std::size_t axis = 0; axis < 3; ++axis)
      radius = std::max(radius, std::abs(place(one, axis) - centre[axis]));
  std::array<std::array<double, 6>, 6> stiffness{};
  for (const Held& one : held) {
    // Translations, then rotations about the axes by an angle of 1/radius.
    std::array<std::array<double, 3>, 6> motion{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
      motion[k][k] = 1;
      motion[3 + k][j] = radius > 0 ? (place(one, i) - centre[i]) / radius : 0;
      motion[3 + k][i] = radius > 0 ? -(place(one, j) - centre[j]) / radius : 0;
    }
    for (std::size_t p = 0; p < 6; ++p)
      for (std::size_t q = 0; q < 6; ++q)
        for (std::size_t k = 0; k < 6; ++k) {
          const auto [i, j] = entries[k];
          stiffness[p][q] +=
              one.resists[k] * (i == j ? motion[p][i] * motion[q][i]
                                       : motion[p][i] * motion[q][j] + motion[p][j] * motion[q][i]);
        }
  }
  const std::array<double, 6> found = eigenvalues(stiffness);
  constexpr double nothing = 1e-6;
  return static_cast<int>(
      std::count_if(found.begin(), found.end(), [&](double x) { return !(x > nothing * found[5]); }));
}

std::vector<cl_ushort> members_of_blocks(const std::vector<int>& blocks, int count, int stride) {
  std::vector<cl_ushort> result(static_cast<std::size_t>(count), 0);
  for (std::size_t m = 0; stride > 0 && m + 1 < blocks.size(); ++m)
    for (int b = blocks[m]; b < blocks[m + 1]; ++b)
      result[static_cast<std::size_t>(b)] = static_cast<cl_ushort>(m / static_cast<std::size_t>(stride));
  return result;
}

}  // namespace

Solid::Solid(Launcher& launcher, const Scene& scene, const Definitions& definitions, const Grid& grid,
             int members, bool viscous)
    : launcher_(launcher),
      scene_(scene),
      grid_(grid),
      capacity_(members),
      voids_(static_cast<int>(solid_voids(scene).size())),
      samples_(scene.circulation ? 0 : pv_times_ms(scene).size()),
      wide_(launcher.device().has_double()) {
  Device& device = launcher.device();
  std::vector<std::string> files = geometry_files(scene);
  for (const std::string& file : solid_part_files(scene)) files.push_back(file);
  files.push_back("solid_setup.cl");
  Definitions setup = definitions;
  setup.generated += geometry_source(scene) + solid_part_source(scene);
  const MechanicsText text = mechanics_text(scene);
  std::vector<std::string> options = {"SAMPLES=" + std::to_string(samples_along_edge)};
  if (text.law.sheets) options.emplace_back("SHEETS");
  const cl::Program geometry = setup.build(device, files, options);
  parts_ = launcher.handle(geometry, "solid_parts");
  vertex_voids_ = launcher.handle(geometry, "solid_vertex_voids");
  fibres_ = launcher.handle(geometry, "solid_fibres");

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
  parts.emplace_back("solid.clh");
  parts.insert(parts.end(), text.files.begin(), text.files.end());
  for (const char* file : {"solid_reduce.clh", "solid_nodes.cl", "solid_cells.cl", "solid_record.cl"})
    parts.emplace_back(file);
  parts.emplace_back(beats ? "solid_beat.cl" : "solid_load.cl");
  options = {"SOLID_BLOCK=" + std::to_string(SolidMesh::block),
             "CAVITIES=" + std::to_string(scene.mechanics->cavities.size()),
             "MASS_FLOOR=R(" + std::to_string(SolidMesh::mass_floor) + ")",
             "MEMBER_GROUP=" + std::to_string(member_group), std::string("BEATS=") + (beats ? "1" : "0")};
  if (viscous) options.emplace_back("VISCOUS");
  program_ = stepping.build(device, parts, options);
  tension_states_ = text.tension.states;
  sheets_ = text.law.sheets;
  forces_ = launcher.handle(program_, "solid_forces");
  predict_ = launcher.handle(program_, "solid_predict");
  member_ = launcher.handle(program_, beats ? "solid_beat" : "solid_load");
  move_ = launcher.handle(program_, "solid_move");
  measure_ = launcher.handle(program_, "solid_measure");
}

cl::Buffer Solid::reals(const std::vector<double>& host) {
  const std::vector<std::byte> packed = pack(host, scene_.precision);
  const cl::Buffer buffer = launcher_.device().allocate(std::max<std::size_t>(8, packed.size()));
  if (!packed.empty()) launcher_.queue().enqueueWriteBuffer(buffer, CL_TRUE, 0, packed.size(), packed.data());
  return buffer;
}

void Solid::build(const cl::Buffer& parameters, std::span<const Member> members) {
  parameters_ = parameters;
  members_ = static_cast<int>(members.size());
  odd_ = 0;
  const auto& [nx, ny, nz] = grid_.cells;
  const auto cells = static_cast<std::size_t>(grid_.size()) * members.size();
  const auto planes = static_cast<std::size_t>(nz) * members.size();
  const cl::Buffer counts =
      launcher_.device().allocate(cells * static_cast<std::size_t>(4 * (voids_ + 1)) * sizeof(cl_ushort));
  const cl::Buffer region = launcher_.device().allocate(cells);
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
  mesh_ = build_solid_mesh(scene_, grid_, parts, members_);
  upload(parameters, members);
  build_supports(members);
}

void Solid::upload(const cl::Buffer& parameters, std::span<const Member> members) {
  const auto n = [](int count) { return static_cast<std::size_t>(count); };
  Device& device = launcher_.device();
  const std::size_t real = real_bytes(scene_.precision);
  const std::size_t cavities = scene_.mechanics->cavities.size();
  member_of_cell_ =
      upload_new(launcher_, members_of_blocks(mesh_.cell_blocks, mesh_.cells / SolidMesh::block, 1));
  member_of_node_ =
      upload_new(launcher_, members_of_blocks(mesh_.node_blocks, mesh_.nodes / SolidMesh::block, 1));
  member_of_item_ = upload_new(launcher_, members_of_blocks(mesh_.item_blocks, mesh_.items / SolidMesh::block,
                                                            static_cast<int>(cavities)));
  cell_nodes_ = upload_new(launcher_, mesh_.cell_nodes);
  share_ = reals(mesh_.share);
  region_ = upload_new(launcher_, mesh_.region);
  corners_ = upload_new(launcher_, mesh_.corners);
  item_cell_ = upload_new(launcher_, mesh_.item_cell);
  item_cavity_ = upload_new(launcher_, mesh_.item_cavity);
  item_share_ = reals(mesh_.item_share);
  item_faces_ = reals(mesh_.item_faces);
  position_ = reals(mesh_.position);
  lid_ = reals(mesh_.lid);
  cavity_of_ = upload_new(launcher_, mesh_.cavity_of);
  cavity_corners_ = upload_new(launcher_, mesh_.cavity_corners);
  node_blocks_ = upload_new(launcher_, mesh_.node_blocks);
  cell_blocks_ = upload_new(launcher_, mesh_.cell_blocks);
  item_blocks_ = upload_new(launcher_, mesh_.item_blocks);

  direction_ = device.allocate(n(mesh_.cells) * (sheets_ ? 24 : 12) * real);
  const cl::Buffer grid_cell = upload_new(launcher_, mesh_.grid_cell);
  launcher_(fibres_, cl::NDRange(n(mesh_.cells)), cl::NDRange(SolidMesh::block), 0.0, parameters,
            grid_.origin_and_spacing(), grid_cell, region_, direction_, mesh_.cells);
  launcher_.queue().finish();

  std::vector<double> inverse(mesh_.inverse_mass);
  const auto density = n(scene_.parameters.index("mechanics.density_mg_per_mm3"));
  for (std::size_t m = 0; m < members.size(); ++m)
    for (int a = mesh_.node_blocks[m] * SolidMesh::block; a < mesh_.node_blocks[m + 1] * SolidMesh::block;
         ++a)
      inverse[n(a)] /= members[m].values[density];
  inverse_mass_ = reals(inverse);
  u_ = reals(std::vector<double>(3 * n(mesh_.nodes), 0));
  v_ = reals(std::vector<double>(3 * n(mesh_.nodes), 0));
  force_ = reals(std::vector<double>(24 * n(mesh_.cells), 0));
  gradient_ = reals(std::vector<double>(24 * n(mesh_.items), 0));
  volume_ = reals(std::vector<double>(n(mesh_.items), 0));
  cavity_gradient_ = reals(std::vector<double>(3 * cavities * n(mesh_.cavity_nodes), 0));
  activation_ = reals(std::vector<double>(n(mesh_.cells), 0));
  std::vector<double> tension(n(tension_states_ + 2) * n(mesh_.cells), 0);
  std::fill_n(tension.begin() + tension_states_ * mesh_.cells, mesh_.cells, 1.0);  // stretch
  tension_ = reals(tension);
  const std::size_t sums = 4 + cavities + cavities * (cavities + 1) / 2;
  node_sums_ = reals(std::vector<double>(sums * n(mesh_.nodes / SolidMesh::block), 0));
  measures_ = reals(std::vector<double>(3 * n(mesh_.cells / SolidMesh::block), 0));
  std::vector<double> state(members.size() * state_size, 0), inflation, mass_damping, pressures;
  for (std::size_t m = 0; m < members.size(); ++m) {
    const auto value = [&](const std::string& path) {
      return members[m].values[n(scene_.parameters.index("mechanics." + path))];
    };
    mass_damping.push_back(value("damping_per_ms"));
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
  series_ = upload_new(launcher_, std::vector<float>(members.size() * 2 * cavities * samples_,
                                                     std::numeric_limits<float>::quiet_NaN()));
  if (scene_.circulation) return;
  const bool still = scene_.mechanics->quasi_static;
  const auto structural = [&](const char* path) { return scene_.parameters.value(path); };
  loads_ = {structural("mechanics.load.ramp_ms"),
            still ? structural("mechanics.load.at_most_ms") : structural("time.end_ms"),
            still ? structural("mechanics.load.tolerance") : 0, still ? 1.0 : 0.0};
}

void Solid::build_supports(std::span<const Member> members) {
  struct Support {
    Matrix stiffness{}, dashpot{}, projector{1, 1, 1, 0, 0, 0};
  };
  std::vector<int> support_of(static_cast<std::size_t>(mesh_.nodes), -1);
  std::vector<Support> supports;
  const auto at = [&](int node) -> Support& {
    int& place = support_of[static_cast<std::size_t>(node)];
    if (place < 0) {
      place = static_cast<int>(supports.size());
      supports.emplace_back();
    }
    return supports[static_cast<std::size_t>(place)];
  };
  // Nodes near the void of a clamp are held.
  std::vector<cl_ushort> near(static_cast<std::size_t>(mesh_.nodes), 0);
  const cl::Buffer near_on_device = upload_new(launcher_, near);
  const cl::Buffer vertex = upload_new(launcher_, mesh_.vertex);
  std::vector<double> values;
  for (const Member& member : members)
    values.insert(values.end(), member.values.begin(), member.values.end());
  const cl::Buffer block = reals(values);
  launcher_(vertex_voids_, cl::NDRange(static_cast<std::size_t>(mesh_.nodes)), cl::NDRange(SolidMesh::block),
            0.0, block, grid_.origin_and_spacing(), vertex, near_on_device);
  launcher_.queue().enqueueReadBuffer(near_on_device, CL_TRUE, 0, near.size() * sizeof(cl_ushort),
                                      near.data());

  using Kind = Mechanics::Boundary::Kind;
  const auto& conditions = scene_.mechanics->boundary;
  std::vector<bool> reached(conditions.size() * members.size(), false);
  for (std::size_t b = 0; b < conditions.size(); ++b) {
    const bool normal = conditions[b].kind == Kind::clamp_normal || conditions[b].kind == Kind::spring_normal;
    const bool clamp = conditions[b].kind == Kind::clamp || conditions[b].kind == Kind::clamp_normal;
    const std::string path = "mechanics.boundary." + conditions[b].name;
    const int surface = void_of_surface(scene_, conditions[b].surface);
    const int stiffness = scene_.parameters.find(path + ".stiffness_kPa_per_mm"),
              dashpot = scene_.parameters.find(path + ".damping_kPa_ms_per_mm");
    for (const SolidMesh::Patch& patch : mesh_.surfaces[b]) {
      const double area = std::hypot(patch.area[0], patch.area[1], patch.area[2]);
      if (!(area > 0)) continue;
      const auto m =
          static_cast<std::size_t>(std::upper_bound(mesh_.node_blocks.begin(), mesh_.node_blocks.end(),
                                                    patch.node / SolidMesh::block) -
                                   mesh_.node_blocks.begin() - 1);
      Matrix direction{1, 1, 1, 0, 0, 0};
      if (normal)
        for (std::size_t k = 0; k < 6; ++k)
          direction[k] = patch.area[entries[k][0]] * patch.area[entries[k][1]] / (area * area);
      if (clamp) {
        if (!(near[static_cast<std::size_t>(patch.node)] >> surface & 1)) continue;
        mesh_.held[b].push_back(patch.node);
        reached[b * members.size() + m] = true;
        Support& support = at(patch.node);
        if (!normal) {
          support.projector = {0, 0, 0, 0, 0, 0};
          continue;
        }
        // Q - (Q n)(Q n) / (n Q n): also what several clamps leave.
        Matrix held = projected(support.projector, direction);
        const double trace = held[0] + held[1] + held[2];
        if (trace > 1e-6)
          for (std::size_t k = 0; k < 6; ++k) support.projector[k] -= held[k] / trace;
        continue;
      }
      reached[b * members.size() + m] = true;
      Support& support = at(patch.node);
      for (std::size_t k = 0; k < 6; ++k) {
        support.stiffness[k] += area * direction[k] * members[m].values[static_cast<std::size_t>(stiffness)];
        support.dashpot[k] += area * direction[k] * members[m].values[static_cast<std::size_t>(dashpot)];
      }
    }
  }
  for (std::size_t b = 0; b < conditions.size(); ++b)
    for (std::size_t m = 0; m < members.size(); ++m) {
      if (reached[b * members.size() + m] || !mesh_.defects[m].empty()) continue;
      const bool clamp = conditions[b].kind == Kind::clamp || conditions[b].kind == Kind::clamp_normal;
      mesh_.defects[m] = "mechanics.boundary." + conditions[b].name + ": the " +
                         (clamp ? "clamp" : "spring") + " holds nothing: surface \"" + conditions[b].surface +
                         "\" bounds no cell of the tissue";
    }
  free_motions_.clear();
  for (std::size_t m = 0; m < members.size(); ++m) {
    // What resists: of clamps their directions, of springs their stiffness over the largest.
    double stiffest = 0;
    const auto of_member = [&](const auto& visit) {
      for (int a = mesh_.node_blocks[m] * SolidMesh::block; a < mesh_.node_blocks[m + 1] * SolidMesh::block;
           ++a)
        if (const int s = support_of[static_cast<std::size_t>(a)]; s >= 0)
          visit(a, supports[static_cast<std::size_t>(s)]);
    };
    of_member([&](int, const Support& s) {
      stiffest = std::max(stiffest, s.stiffness[0] + s.stiffness[1] + s.stiffness[2]);
    });
    std::vector<Held> held;
    of_member([&](int node, const Support& s) {
      Held one{node, s.projector};
      for (std::size_t k = 0; k < 6; ++k)
        one.resists[k] = (k < 3 ? 1 : 0) - one.resists[k] + (stiffest > 0 ? s.stiffness[k] / stiffest : 0);
      held.push_back(one);
    });
    free_motions_.push_back(count_free_motions(mesh_, held));
  }
  supports_ = std::max<int>(1, static_cast<int>(supports.size()));
  std::vector<double> fields(18 * static_cast<std::size_t>(supports_), 0);
  for (std::size_t s = 0; s < supports.size(); ++s) {
    const Matrix stiffness = projected(supports[s].projector, supports[s].stiffness),
                 dashpot = projected(supports[s].projector, supports[s].dashpot);
    for (std::size_t k = 0; k < 6; ++k) {
      fields[k * static_cast<std::size_t>(supports_) + s] = stiffness[k];
      fields[(6 + k) * static_cast<std::size_t>(supports_) + s] = dashpot[k];
      fields[(12 + k) * static_cast<std::size_t>(supports_) + s] = supports[s].projector[k];
    }
  }
  support_of_ = upload_new(launcher_, support_of);
  support_ = reals(fields);
}

void Solid::activate(const std::vector<float>& times) {
  activation_ = reals(std::vector<double>(times.begin(), times.end()));
}

void Solid::forces(const cl::Buffer& parameters) {
  const auto cells = static_cast<std::size_t>(mesh_.cells);
  const std::size_t items = scene_.mechanics->cavities.empty() ? 0 : static_cast<std::size_t>(mesh_.items);
  const double real = static_cast<double>(real_bytes(scene_.precision));
  launcher_(forces_, cl::NDRange(cells + items), cl::NDRange(SolidMesh::block),
            static_cast<double>(cells) * (33 + real * (4 + 12 + 24 + 3)) +
                static_cast<double>(items) * (5 + 32 + real * (7 + 24 + 1 + 6)),
            parameters, state_, member_of_cell_, cell_nodes_, share_, region_, direction_, activation_,
            tension_, u_, v_, force_, member_of_item_, item_cell_, item_cavity_, item_share_, item_faces_,
            position_, lid_, gradient_, volume_, mesh_.cells, mesh_.nodes, mesh_.items, Real{grid_.dx_mm},
            odd_);
}

void Solid::predict() {
  const bool gpu = launcher_.device().info().gpu;
  const auto nodes = static_cast<std::size_t>(mesh_.nodes);
  const double real = static_cast<double>(real_bytes(scene_.precision));
  launcher_(predict_, cl::NDRange(gpu ? nodes : nodes / SolidMesh::block),
            cl::NDRange(gpu ? SolidMesh::block : 1), static_cast<double>(nodes) * (40 + real * (24 + 1 + 9)),
            state_, member_of_node_, corners_, inverse_mass_, support_of_, support_, cavity_of_,
            cavity_corners_, force_, gradient_, cavity_gradient_, u_, v_, node_sums_, mesh_.cells,
            mesh_.nodes, supports_, mesh_.items, mesh_.cavity_nodes, odd_);
}

void Solid::load(bool measured) {
  const bool gpu = launcher_.device().info().gpu;
  const auto groups = static_cast<std::size_t>(members_);
  launcher_(member_, cl::NDRange(gpu ? groups * member_group : groups), cl::NDRange(gpu ? member_group : 1),
            0.0, parameters_, node_sums_, measures_, volume_, node_blocks_, cell_blocks_, item_blocks_,
            pressures_, loads_, state_, series_, static_cast<int>(samples_),
            Real{samples_ > 0 ? 1000 / scene_.parameters.value("outputs.pv.rate_hz") : 0},
            mesh_.nodes / SolidMesh::block, mesh_.cells / SolidMesh::block, measured ? 1 : 0,
            Real{grid_.dx_mm}, Real{courant}, odd_);
}

void Solid::beat(const cl::Buffer& parameters, const LumpedCirculation& circulation, int samples,
                 bool measured) {
  const bool gpu = launcher_.device().info().gpu;
  const auto groups = static_cast<std::size_t>(members_);
  launcher_(member_, cl::NDRange(gpu ? groups * member_group : groups), cl::NDRange(gpu ? member_group : 1),
            0.0, parameters, node_sums_, measures_, volume_, node_blocks_, cell_blocks_, item_blocks_,
            inflation_, damping_, state_, circulation.states(), circulation.statuses(), circulation.clock(),
            circulation.pressure_buffer(), circulation.volume_buffer(), circulation.at_most(), samples,
            mesh_.nodes / SolidMesh::block, mesh_.cells / SolidMesh::block, measured ? 1 : 0,
            Real{grid_.dx_mm}, Real{courant}, odd_);
}

void Solid::move() {
  const auto nodes = static_cast<std::size_t>(mesh_.nodes);
  const double real = static_cast<double>(real_bytes(scene_.precision));
  launcher_(move_, cl::NDRange(nodes), cl::NDRange(SolidMesh::block), static_cast<double>(nodes) * real * 10,
            state_, member_of_node_, inverse_mass_, support_of_, support_, cavity_of_, cavity_gradient_, u_,
            v_, mesh_.nodes, supports_, mesh_.cavity_nodes, odd_);
  odd_ = 1 - odd_;
}

void Solid::measure(const cl::Buffer& parameters) {
  const bool gpu = launcher_.device().info().gpu;
  const auto cells = static_cast<std::size_t>(mesh_.cells);
  launcher_(measure_, cl::NDRange(gpu ? cells : cells / SolidMesh::block),
            cl::NDRange(gpu ? SolidMesh::block : 1), static_cast<double>(cells) * 100, parameters, state_,
            member_of_cell_, cell_nodes_, share_, region_, direction_, tension_, u_, measures_, mesh_.cells,
            mesh_.nodes, Real{grid_.dx_mm});
}

std::vector<double> Solid::read(const cl::Buffer& field, std::size_t count) {
  std::vector<double> result(count);
  if (scene_.precision == Precision::double_) {
    launcher_.queue().enqueueReadBuffer(field, CL_TRUE, 0, count * sizeof(double), result.data());
    return result;
  }
  std::vector<float> single(count);
  launcher_.queue().enqueueReadBuffer(field, CL_TRUE, 0, count * sizeof(float), single.data());
  std::copy(single.begin(), single.end(), result.begin());
  return result;
}

std::vector<double> Solid::state() {
  std::vector<double> result(static_cast<std::size_t>(members_) * state_size);
  if (wide_) {
    launcher_.queue().enqueueReadBuffer(state_, CL_TRUE, 0, result.size() * sizeof(double), result.data());
    return result;
  }
  std::vector<float> single(result.size());
  launcher_.queue().enqueueReadBuffer(state_, CL_TRUE, 0, single.size() * sizeof(float), single.data());
  std::copy(single.begin(), single.end(), result.begin());
  return result;
}

void Solid::set_state(const std::vector<double>& state) {
  state_ = wide_ ? upload_new(launcher_, state)
                 : upload_new(launcher_, std::vector<float>(state.begin(), state.end()));
}

double Solid::first_step_ms(const cl::Buffer& parameters) {
  measure(parameters);
  const std::vector<double> found = read(measures_, static_cast<std::size_t>(mesh_.cells / SolidMesh::block));
  return courant * grid_.dx_mm / std::sqrt(*std::max_element(found.begin(), found.end()));
}

std::size_t Solid::bytes() const {
  const std::size_t real = real_bytes(scene_.precision), cavities = scene_.mechanics->cavities.size();
  const auto cells = static_cast<std::size_t>(mesh_.cells), nodes = static_cast<std::size_t>(mesh_.nodes),
             items = static_cast<std::size_t>(mesh_.items),
             rim = static_cast<std::size_t>(mesh_.cavity_nodes);
  const std::size_t directions = sheets_ ? 24 : 12;
  return cells * (33 + real * (4 + directions + 24 + 1 + static_cast<std::size_t>(tension_states_ + 2))) +
         nodes * (8 * 4 + 8 + real * (3 + 3 + 3 + 1)) + items * (5 + real * (4 + 6 + 24 + 1)) +
         rim * cavities * (32 + 3 * real) + static_cast<std::size_t>(supports_) * 18 * real +
         static_cast<std::size_t>(grid_.size()) * (1 + 2 * static_cast<std::size_t>(4 * (voids_ + 1)));
}

std::array<double, 3> Solid::centre(std::size_t cell) const {
  const std::int64_t at = mesh_.grid_cell[cell] % grid_.size();
  const auto& [nx, ny, nz] = grid_.cells;
  const std::array<std::int64_t, 3> index = {at % nx, at / nx % ny, at / (std::int64_t{nx} * ny)};
  std::array<double, 3> result{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    result[axis] = grid_.origin_mm[axis] + grid_.dx_mm * (static_cast<double>(index[axis]) + 0.5);
  return result;
}

std::pair<std::size_t, double> Solid::worst_cell(std::size_t k) {
  const std::vector<double> u = displacement(), v = velocity();
  double worst = 1e30;
  std::size_t where = 0;
  const auto nodes = static_cast<std::size_t>(mesh_.nodes);
  for (int i = mesh_.cell_blocks[k] * SolidMesh::block; i < mesh_.cell_blocks[k + 1] * SolidMesh::block;
       ++i) {
    const auto cell = static_cast<std::size_t>(i);
    if (mesh_.grid_cell[cell] < 0) continue;
    // Volume of the cell by its edges' means.
    std::array<std::array<double, 3>, 3> F{};
    double speeds = 0;  // no number where a velocity is none: displacements follow a step later
    for (int corner = 0; corner < 8; ++corner) {
      const auto node = static_cast<std::size_t>(
          mesh_.cell_nodes[static_cast<std::size_t>(corner) * static_cast<std::size_t>(mesh_.cells) + cell]);
      for (std::size_t row = 0; row < 3; ++row) {
        speeds += v[row * nodes + node];
        for (std::size_t axis = 0; axis < 3; ++axis)
          F[row][axis] += (corner >> axis & 1 ? 0.25 : -0.25) / grid_.dx_mm * u[row * nodes + node];
      }
    }
    for (std::size_t row = 0; row < 3; ++row) F[row][row] += 1;
    const double J = F[0][0] * (F[1][1] * F[2][2] - F[1][2] * F[2][1]) -
                     F[0][1] * (F[1][0] * F[2][2] - F[1][2] * F[2][0]) +
                     F[0][2] * (F[1][0] * F[2][1] - F[1][1] * F[2][0]);
    if (!std::isfinite(J) || !std::isfinite(speeds)) return {cell, std::numeric_limits<double>::quiet_NaN()};
    if (J < worst) {
      worst = J;
      where = cell;
    }
  }
  return {where, worst};
}

std::string Solid::failure(std::size_t k, SolidEnd end) {
  const auto [where, worst] = worst_cell(k);
  const std::array<double, 3> X = centre(where);
  std::ostringstream text;
  text.precision(3);
  switch (end) {
    case SolidEnd::inverted:
      text << "a cell of the tissue is inverted";
      break;
    case SolidEnd::runaway:
      text << "the tissue runs away: its energy is no number";
      break;
    case SolidEnd::stiff:
      text << "the tissue collapses: its waves ask for steps of less than 2 % of the first";
      break;
    case SolidEnd::unsettled:
      text << "the tissue comes to no rest under its loads";
      break;
    case SolidEnd::moves:
    case SolidEnd::settled:
      break;
  }
  text << "; smallest volume ratio " << worst << " at (" << X[0] << ", " << X[1] << ", " << X[2]
       << ") mm, region " << scene_.regions[mesh_.region[where]].name;
  return text.str();
}

std::vector<double> Solid::displacement() {
  return read(u_, 3 * static_cast<std::size_t>(mesh_.nodes));
}
std::vector<double> Solid::velocity() {
  return read(v_, 3 * static_cast<std::size_t>(mesh_.nodes));
}

void Solid::set_motion(const std::vector<double>& displacement, const std::vector<double>& velocity) {
  u_ = reals(displacement);
  v_ = reals(velocity);
}

std::vector<float> Solid::cavity_series() {
  std::vector<float> result(static_cast<std::size_t>(members_) * 2 * scene_.mechanics->cavities.size() *
                            samples_);
  if (!result.empty())
    launcher_.queue().enqueueReadBuffer(series_, CL_TRUE, 0, result.size() * sizeof(float), result.data());
  return result;
}

Solid::Place Solid::place_of(std::size_t m, const std::array<double, 3>& X) const {
  const double h = grid_.dx_mm;
  double nearest = 1e30;
  int cell = -1;
  std::array<double, 3> inside{};
  for (int i = mesh_.cell_blocks[m] * SolidMesh::block; i < mesh_.cell_blocks[m + 1] * SolidMesh::block;
       ++i) {
    if (mesh_.grid_cell[static_cast<std::size_t>(i)] < 0) continue;
    const auto first = static_cast<std::size_t>(mesh_.cell_nodes[static_cast<std::size_t>(i)]);
    std::array<double, 3> at{};
    double distance = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      at[axis] = (X[axis] - mesh_.position[axis * static_cast<std::size_t>(mesh_.nodes) + first]) / h;
      distance = std::max(distance, std::abs(at[axis] - 0.5));
    }
    if (distance < nearest) {
      nearest = distance;
      cell = i;
      inside = at;
    }
  }
  Place place;
  place.beyond_mm = std::max(0.0, nearest - 0.5) * h;
  for (std::size_t c = 0; c < 8 && cell >= 0; ++c) {
    place.nodes[c] =
        mesh_.cell_nodes[c * static_cast<std::size_t>(mesh_.cells) + static_cast<std::size_t>(cell)];
    place.weights[c] = 1;
    for (std::size_t axis = 0; axis < 3; ++axis)
      place.weights[c] *= c >> axis & 1 ? inside[axis] : 1 - inside[axis];
  }
  return place;
}

std::array<double, 3> Solid::displacement_at(std::size_t m, const std::array<double, 3>& X,
                                             const std::vector<double>& displacement) const {
  const Place place = place_of(m, X);
  std::array<double, 3> result{};
  for (std::size_t c = 0; c < 8; ++c)
    for (std::size_t axis = 0; axis < 3; ++axis)
      result[axis] += place.weights[c] * displacement[axis * static_cast<std::size_t>(mesh_.nodes) +
                                                      static_cast<std::size_t>(place.nodes[c])];
  return result;
}

}  // namespace cohort
