#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <stdexcept>
#include <vector>

#include "solver/diffusion.hpp"
#include "solver/monodomain.hpp"
#include "solver/precision.hpp"

namespace cohort::test {

/// The first device there is: PoCL where there is no GPU.
inline Device& device() {
  static std::unique_ptr<Device> first = [] {
    const std::vector<DeviceInfo> all = devices();
    if (all.empty()) throw std::runtime_error("no OpenCL device");
    return std::make_unique<Device>(all.front());
  }();
  return *first;
}

/// Tissue with the parts of the monodomain solver on it, for tests that look inside: a box unless a scene is
/// given.
struct Slab {
  /// size in mm, from the origin. set: changes to the parameters' values, by path.
  Slab(std::array<double, 3> size_mm, double dx_mm, Precision precision, const std::string& cell_model,
       const std::vector<std::pair<std::string, double>>& set, const std::vector<Stimulus>& stimuli = {},
       ActivationMethod method = ActivationMethod::automatic)
      : Slab(box(cell_model, precision, stimuli, method), with_size(size_mm, dx_mm, set)) {}

  /// A scene whose structure is set; its parameters are declared here.
  Slab(Scene structure, const std::vector<std::pair<std::string, double>>& set)
      : scene(std::move(structure)) {
    declare_parameters(scene);
    for (const auto& [path, value] : set) put(path, value);
    member.values = scene.parameters.values();
    scene.parameters.resolve(member.values);
    const std::span<const Member> one(&member, 1);
    grid = make_grid(scene, one);
    definitions = scene_definitions(scene, grid);
    launcher = std::make_unique<Launcher>(device(), scene.precision);
    tissue = std::make_unique<Tissue>(*launcher, scene, grid, 1);
    diffusion = std::make_unique<Diffusion>(*launcher, scene, definitions);
    monodomain = std::make_unique<Monodomain>(*launcher, scene, definitions, 1);
    const std::vector<std::byte> packed = pack(member.values, scene.precision);
    parameters = device().allocate(packed.size());
    launcher->queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());
    tissue->build(parameters, 1);
    tissue->build_fibres(parameters);
    if (!scene.heterogeneity.parameters.empty()) tissue->build_coordinates(parameters);
    monodomain->assemble(*tissue, *diffusion, parameters, one);
  }

  static Scene box(const std::string& cell_model, Precision precision,
                   const std::vector<Stimulus>& stimuli = {},
                   ActivationMethod method = ActivationMethod::automatic) {
    Scene result;
    result.activation_method = method;
    result.geometry = GeometryKind::box;
    result.cell_model = cell_model;
    result.precision = precision;
    result.stimuli = stimuli;
    return result;
  }
  static std::vector<std::pair<std::string, double>> with_size(
      const std::array<double, 3>& size_mm, double dx_mm,
      const std::vector<std::pair<std::string, double>>& set) {
    std::vector<std::pair<std::string, double>> result = {{"geometry.box.size_mm.x", size_mm[0]},
                                                          {"geometry.box.size_mm.y", size_mm[1]},
                                                          {"geometry.box.size_mm.z", size_mm[2]},
                                                          {"grid.dx_mm", dx_mm}};
    result.insert(result.end(), set.begin(), set.end());
    return result;
  }

  void put(const std::string& path, double value) {
    scene.parameters[scene.parameters.index(path)].value = value;
  }

  std::vector<double> read(const cl::Buffer& buffer, std::size_t count, std::size_t first = 0) {
    const std::size_t real = real_bytes(scene.precision);
    std::vector<std::byte> raw(count * real);
    launcher->queue().enqueueReadBuffer(buffer, CL_TRUE, first * real, raw.size(), raw.data());
    return unpack(raw, scene.precision);
  }
  void write(const cl::Buffer& buffer, const std::vector<double>& numbers, std::size_t first = 0) {
    const std::vector<std::byte> raw = pack(numbers, scene.precision);
    launcher->queue().enqueueWriteBuffer(buffer, CL_TRUE, first * real_bytes(scene.precision), raw.size(),
                                         raw.data());
  }
  std::vector<double> potential() {
    return read(monodomain->potential(), static_cast<size_t>(tissue->stride));
  }

  /// A field (stride) with f at the centre of every tissue cell and `elsewhere` in the others.
  std::vector<double> field(const std::function<double(double, double, double)>& f,
                            double elsewhere = 0) const {
    std::vector<double> result(static_cast<size_t>(tissue->stride), elsewhere);
    each_cell([&](std::size_t i, const std::array<double, 3>& p) { result[i] = f(p[0], p[1], p[2]); });
    return result;
  }
  /// Calls visit(place, centre in mm) for every tissue cell.
  void each_cell(const std::function<void(std::size_t, const std::array<double, 3>&)>& visit) const {
    for (std::size_t i = 0; i < tissue->regions.size(); ++i) {
      if (tissue->regions[i] == 255) continue;
      const std::array<double, 3> centre = tissue->centre(i);
      visit(i, centre);
    }
  }

  Scene scene;
  Member member{0, {}};
  Grid grid{};
  Definitions definitions;
  std::unique_ptr<Launcher> launcher;
  std::unique_ptr<Tissue> tissue;
  std::unique_ptr<Diffusion> diffusion;
  std::unique_ptr<Monodomain> monodomain;
  cl::Buffer parameters;
};

}  // namespace cohort::test
