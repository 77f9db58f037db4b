#pragma once

#include "solver/tension_drive.hpp"
#include "solver/tissue_places.hpp"
#include "tests/solid_run.hpp"

namespace cohort::test {

/// A box of tissue whose tension single cells drive behind arrival times; it does not move.
class DrivenSlab {
 public:
  DrivenSlab(const std::string& tension, const std::string& cell_model, const Settings& set,
             const std::vector<Settings>& by_member = {{}}, Precision precision = Precision::double_)
      : scene(structure(tension, cell_model, precision)) {
    declare_parameters(scene);
    for (const auto& [path, value] : box_size(4, 2, 2, 1)) put(path, value);
    for (const auto& [path, value] : set) put(path, value);
    std::vector<double> values;
    for (const Settings& own : by_member) {
      Member& member = members.emplace_back(Member{0, scene.parameters.values()});
      for (const auto& [path, value] : own)
        member.values[static_cast<std::size_t>(scene.parameters.index(path))] = value;
      scene.parameters.resolve(member.values);
      values.insert(values.end(), member.values.begin(), member.values.end());
    }
    const Grid grid = make_grid(scene, members);
    const Definitions definitions = scene_definitions(scene, grid);
    const int count = static_cast<int>(members.size());
    launcher = std::make_unique<Launcher>(device(), precision);
    const std::vector<std::byte> packed = pack(values, precision);
    parameters = device().allocate(packed.size());
    launcher->queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());
    tissue = std::make_unique<Tissue>(*launcher, scene, grid, count);
    tissue->build(parameters, count);
    drive = std::make_unique<TensionDrive>(*launcher, scene, definitions, count);
    solid = std::make_unique<Solid>(*launcher, scene, definitions, grid, count, false, drive->options());
    solid->build(parameters, members);
    drive->prepare(members);
    std::vector<std::size_t> all;
    for (std::size_t m = 0; m < members.size(); ++m) all.push_back(m);
    drive->connect(members, all, *tissue, parameters, nearest_places(*solid, *tissue, {}, all), *solid);
    start = solid->state();
  }

  /// Tension of every cell of the mesh at the end of each of `steps` steps of dt ms. activation: by cell, ms.
  std::vector<std::vector<double>> tensions(const std::vector<float>& activation, double beat_ms, double dt,
                                            int steps) {
    solid->activate(activation);
    std::vector<std::vector<double>> result;
    for (int n = 1; n <= steps; ++n) {
      std::vector<double> state = start;
      const double t = n * dt, beat = std::floor(t / beat_ms);
      for (std::size_t m = 0; m < members.size(); ++m) {
        double* S = &state[m * Solid::state_size];
        S[Solid::step] = S[Solid::odd_step] = dt;
        S[Solid::load_share] = 1;
        S[Solid::beat_time] = t - beat * beat_ms;
        S[Solid::beat_number] = beat;
        S[Solid::beat_length] = beat_ms;
      }
      solid->set_state(state);
      solid->forces(parameters);
      result.push_back(solid->tensions());
    }
    return result;
  }

  Scene scene;
  std::vector<Member> members;
  std::unique_ptr<Launcher> launcher;
  cl::Buffer parameters;
  std::unique_ptr<Tissue> tissue;
  std::unique_ptr<TensionDrive> drive;
  std::unique_ptr<Solid> solid;
  std::vector<double> start;

 private:
  static Scene structure(const std::string& tension, const std::string& cell_model, Precision precision) {
    Scene scene = Slab::box(cell_model, precision, {}, ActivationMethod::eikonal);
    scene.mechanics = Mechanics{.law = "guccione", .tension = tension, .cavities = {}, .boundary = {}};
    return scene;
  }
  void put(const std::string& path, double value) {
    scene.parameters[scene.parameters.index(path)].value = value;
  }
};

}  // namespace cohort::test
