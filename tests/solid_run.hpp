#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "solver/mechanics.hpp"
#include "solver/solid.hpp"
#include "tests/slab.hpp"

namespace cohort::test {

using Settings = std::vector<std::pair<std::string, double>>;

/// Deforming tissue of a scene, for tests that look inside: forces, energies and volumes of given motions,
/// and steps of a given length.
class SolidRun {
 public:
  /// A scene whose structure is set; its parameters are declared here. by_member: changes to the values of
  /// each member; one member where there are none.
  SolidRun(Scene structure, const Settings& set, const std::vector<Settings>& by_member = {{}})
      : scene(std::move(structure)) {
    declare_parameters(scene);
    for (const auto& [path, value] : set) scene.parameters[scene.parameters.index(path)].value = value;
    for (const Settings& own : by_member) {
      Member member{static_cast<std::int64_t>(members.size()), scene.parameters.values()};
      for (const auto& [path, value] : own)
        member.values[static_cast<std::size_t>(scene.parameters.index(path))] = value;
      scene.parameters.resolve(member.values);
      members.push_back(std::move(member));
    }
    grid = make_grid(scene, members);
    launcher = std::make_unique<Launcher>(device(), scene.precision);
    solid = std::make_unique<Solid>(
        *launcher, scene, scene_definitions(scene, grid), grid, static_cast<int>(members.size()),
        std::any_of(members.begin(), members.end(),
                    [&](const Member& member) { return viscous(scene, member.values); }));
    std::vector<double> values;
    for (const Member& member : members)
      values.insert(values.end(), member.values.begin(), member.values.end());
    const std::vector<std::byte> packed = pack(values, scene.precision);
    parameters = device().allocate(packed.size());
    launcher->queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());
    solid->build(parameters, members);
    start = solid->state();
  }

  const SolidMesh& mesh() const { return solid->mesh(); }
  std::size_t nodes() const { return static_cast<std::size_t>(mesh().nodes); }
  bool is_node(std::size_t a) const { return mesh().vertex[a] >= 0; }
  std::array<double, 3> place(std::size_t a) const {
    return {mesh().position[a], mesh().position[nodes() + a], mesh().position[2 * nodes() + a]};
  }
  double density() const { return scene.parameters.value("mechanics.density_mg_per_mm3"); }
  /// Mass of a node, mg.
  double mass(std::size_t a) const { return density() / mesh().inverse_mass[a]; }
  /// Cells of which a node is a corner.
  std::vector<std::size_t> cells_of(std::size_t a) const {
    std::vector<std::size_t> result;
    for (std::size_t c = 0; c < 8; ++c) {
      const auto cell = static_cast<std::size_t>(mesh().corners[c * nodes() + a]);
      if (mesh().grid_cell[cell] >= 0) result.push_back(cell);
    }
    return result;
  }
  double quarter(std::size_t cell, std::size_t g) const {
    return mesh().share[SolidMesh::in_tile(cell, g, 4)];
  }
  /// Whether all cells around a node are there, each filled with tissue.
  bool within_tissue(std::size_t a) const {
    const std::vector<std::size_t> cells = cells_of(a);
    return cells.size() == 8 && std::all_of(cells.begin(), cells.end(), [&](std::size_t cell) {
             for (std::size_t g = 0; g < 4; ++g)
               if (quarter(cell, g) < 1) return false;
             return true;
           });
  }

  /// A field (3, nodes) of f(place).
  std::vector<double> field(
      const std::function<std::array<double, 3>(const std::array<double, 3>&)>& f) const {
    std::vector<double> u(3 * nodes(), 0);
    for (std::size_t a = 0; a < nodes(); ++a) {
      if (!is_node(a)) continue;
      const std::array<double, 3> value = f(place(a));
      for (std::size_t k = 0; k < 3; ++k) u[k * nodes() + a] = value[k];
    }
    return u;
  }
  /// Of numbers from -size to size.
  std::vector<double> random_field(double size, unsigned seed) const {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(-size, size);
    return field([&](const std::array<double, 3>&) {
      return std::array{uniform(random), uniform(random), uniform(random)};
    });
  }
  std::vector<double> at_rest() const { return std::vector<double>(3 * nodes(), 0); }

  /// Sets a motion, no damping, steps of dt ms, and the pressures (kPa) of the cavities.
  void set(const std::vector<double>& u, const std::vector<double>& v, double dt_ms,
           const std::vector<double>& pressures = {}) {
    std::vector<double> state = start;
    for (std::size_t m = 0; m < members.size(); ++m) {
      double* S = &state[m * Solid::state_size];
      S[Solid::damping] = 0;
      S[Solid::step] = S[Solid::odd_step] = dt_ms;
      S[Solid::load_share] = 1;
      for (std::size_t q = 0; q < pressures.size(); ++q) S[Solid::first_pressure + q] = pressures[q];
    }
    solid->set_state(state);
    solid->set_motion(u, v);
  }
  /// A step of the length that set() gave, with the pressures it gave.
  void step() {
    solid->forces(parameters);
    solid->predict(true);
    solid->move();
  }
  /// Forces on the nodes (3, nodes), mN, under pressures in the cavities.
  std::vector<double> forces(const std::vector<double>& u, const std::vector<double>& pressures = {}) {
    set(u, at_rest(), 1, pressures);
    step();
    std::vector<double> f = solid->velocity();
    for (std::size_t a = 0; a < nodes(); ++a)
      for (std::size_t k = 0; k < 3; ++k) f[k * nodes() + a] *= is_node(a) ? mass(a) : 0;
    return f;
  }
  struct Measured {
    double energy_uJ, volume_mm3, smallest_J, dt_ms;
  };
  /// What solid_measure and solid_forces find in a motion; volume: of the first cavity.
  Measured measured(const std::vector<double>& u) {
    set(u, at_rest(), 0);
    solid->measure(parameters);
    solid->forces(parameters);
    solid->predict(true);
    solid->load(true);
    const std::vector<double> S = solid->state();
    return {S[Solid::strain_energy], S[Solid::first_volume], S[Solid::smallest_J], S[Solid::largest_step]};
  }
  /// A whole step, as the heart makes it: the member's kernel finds its length and the loads.
  void loaded_step(bool look) {
    solid->forces(parameters);
    if (look) solid->measure(parameters);
    solid->predict(true);
    solid->load(look);
    solid->move();
  }

  Scene scene;
  std::vector<Member> members;
  Grid grid{};
  std::unique_ptr<Launcher> launcher;
  std::unique_ptr<Solid> solid;
  cl::Buffer parameters;
  std::vector<double> start;  ///< state that build() leaves
};

inline double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}
inline double largest_of(const std::vector<double>& a) {
  double result = 0;
  for (const double x : a) result = std::isnan(x) ? x : std::max(result, std::abs(x));
  return result;
}

/// A box of tissue.
inline Scene box_of_tissue(const std::string& law, Precision precision,
                           std::vector<Mechanics::Boundary> boundary = {}) {
  Scene scene;
  scene.geometry = GeometryKind::box;
  scene.precision = precision;
  scene.mechanics = Mechanics{.law = law, .tension = {}, .cavities = {}, .boundary = std::move(boundary)};
  return scene;
}
inline Settings box_size(double x, double y, double z, double dx) {
  return {{"geometry.box.size_mm.x", x},         {"geometry.box.size_mm.y", y},
          {"geometry.box.size_mm.z", z},         {"grid.dx_mm", dx},
          {"geometry.fibres.direction.x", 0.48}, {"geometry.fibres.direction.y", 0.6},
          {"geometry.fibres.direction.z", 0.64}};
}

/// A wall between two ellipsoids, whole, or below the plane z = 0 (the inner one's part of it is the cavity's
/// lid). Only the open one can be held at its base.
inline Scene hollow(bool open, const std::string& law, Precision precision, bool held) {
  using K = Shape::Kind;
  using B = Mechanics::Boundary;
  Scene scene;
  scene.geometry = GeometryKind::shapes;
  scene.precision = precision;
  scene.shapes = {{"outer", K::ellipsoid, {}}, {"inner", K::ellipsoid, {}}};
  if (open) {
    scene.shapes.push_back({"below_base", K::half_space, {}});
    scene.shapes.push_back({"shell", K::subtract, {"outer", "inner"}});
    scene.shapes.push_back({"wall", K::intersection, {"shell", "below_base"}});
    scene.shapes.push_back({"blood", K::intersection, {"inner", "below_base"}});
  } else {
    scene.shapes.push_back({"wall", K::subtract, {"outer", "inner"}});
  }
  scene.regions = {
      {.name = "wall", .shape = "wall", .excitable = true, .fibres = Region::Fibres::transmural}};
  Mechanics& mechanics = scene.mechanics.emplace();
  mechanics.law = law;
  mechanics.cavities = {{"lv", open ? "blood" : "inner"}};
  if (held) mechanics.boundary = {{"base", "below_base", B::Kind::clamp}};
  return scene;
}
inline Settings ellipsoids(const std::array<double, 3>& inner, double wall, double dx,
                           const std::array<double, 3>& centre = {0, 0, 0}) {
  Settings result = {{"grid.dx_mm", dx}};
  for (const char* name : {"outer", "inner"})
    for (std::size_t k = 0; k < 3; ++k) {
      const std::string path = std::string("geometry.shapes.") + name + ".ellipsoid.";
      const std::string axis(1, "xyz"[k]);
      result.emplace_back(path + "semi_axes_mm." + axis, inner[k] + (name[0] == 'o' ? wall : 0));
      result.emplace_back(path + "centre_mm." + axis, centre[k]);
    }
  return result;
}

}  // namespace cohort::test
