#pragma once

#include <cmath>
#include <map>

#include "solver/eikonal_activation.hpp"
#include "solver/template_ecg.hpp"
#include "tests/slab.hpp"

// A coarse heart with a conduction system, as a scene and in its parts on the device.
namespace cohort::test {

using Changes = std::vector<std::pair<std::string, double>>;
inline const std::string tau_close = "electrophysiology.mitchell_schaeffer.tau_close_ms";
inline const std::string slope = "electrophysiology.heterogeneity.tau_close_ms.";

inline Scene coarse_heart() {
  Scene scene;
  scene.geometry = GeometryKind::heart;
  scene.activation_method = ActivationMethod::eikonal;
  scene.conduction_system.emplace().early_sites = default_early_sites();
  scene.heterogeneity.parameters = {"tau_close_ms"};
  scene.ecg.emplace();
  scene.activation.emplace();
  return scene;
}

inline void declare(Scene& scene, double dx_mm = 5) {
  declare_parameters(scene);
  const Changes values = {{"grid.dx_mm", dx_mm},
                          {"time.end_ms", 700},
                          {"outputs.ecg.rate_hz", 500},
                          {"torso.dx_mm", 20},
                          {"electrophysiology.velocity_longitudinal_mm_per_ms", 0.6},
                          {"electrophysiology.velocity_transverse_mm_per_ms", 0.25}};
  const Changes slopes = {{slope + "transmural", -12}, {slope + "apico_basal", 22}, {slope + "lateral", 13}};
  for (const Changes* changes : {&values, &slopes})
    for (const auto& [path, value] : *changes)
      if (changes != &slopes || !scene.heterogeneity.parameters.empty())
        scene.parameters[scene.parameters.index(path)].value = value;
}

inline Member member(const Scene& scene, std::int64_t id, const Changes& changes) {
  Member result{id, scene.parameters.values()};
  for (const auto& [path, value] : changes)
    result.values[static_cast<size_t>(scene.parameters.index(path))] = value;
  scene.parameters.resolve(result.values);
  return result;
}

inline std::vector<Recording> run(const Scene& scene, const std::vector<Member>& members, int batch) {
  PlanOptions options;
  options.members_per_device = batch;
  const Plan plan = make_plan(device(), scene, members, options);
  EXPECT_EQ(plan.activation, ActivationMethod::eikonal);
  Simulation simulation(device(), scene, plan);
  std::vector<Recording> recordings;
  for (size_t first = 0; first < members.size(); first += static_cast<size_t>(batch)) {
    const size_t count = std::min(static_cast<size_t>(batch), members.size() - first);
    for (Recording& recording : simulation.run(std::span(members).subspan(first, count), 600))
      recordings.push_back(std::move(recording));
  }
  return recordings;
}

// Parts of the solver on one heart.
struct Parts {
  explicit Parts(const Scene& scene_, const Changes& changes = {})
      : scene(scene_),
        one(member(scene, 0, changes)),
        grid(make_grid(scene, {&one, 1})),
        definitions(scene_definitions(scene, grid)),
        launcher(device(), scene.precision),
        tissue(launcher, scene, grid, 1),
        activation(launcher, scene, definitions, 1) {
    const std::vector<std::byte> packed = pack(one.values, scene.precision);
    parameters = device().allocate(packed.size());
    launcher.queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());
    tissue.build(parameters, 1);
    tissue.build_fibres(parameters);
    tissue.build_coordinates(parameters);
    coordinates = read<float>(tissue.coordinates, 4);
    activation.assemble(tissue, parameters, {&one, 1});
  }
  template <typename T>
  std::vector<T> read(const cl::Buffer& buffer, std::size_t rows) {
    std::vector<T> host(rows * static_cast<size_t>(tissue.stride));
    launcher.queue().enqueueReadBuffer(buffer, CL_TRUE, 0, host.size() * sizeof(T), host.data());
    return host;
  }
  double coordinate(std::size_t row, std::size_t i) const {
    return static_cast<double>(coordinates[row * static_cast<size_t>(tissue.stride) + i]);
  }

  Scene scene;
  Member one;
  Grid grid;
  Definitions definitions;
  Launcher launcher;
  Tissue tissue;
  EikonalActivation activation;
  cl::Buffer parameters;
  std::vector<float> coordinates;
};

}  // namespace cohort::test
