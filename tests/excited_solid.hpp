#pragma once

#include <limits>
#include <span>

#include "solver/heartbeat.hpp"
#include "solver/tissue_places.hpp"
#include "tests/slab.hpp"

namespace cohort::test {

/// A scene's own member: its excited tissue, and the one that deforms, for tests that step it or look inside.
struct ExcitedSolid {
  explicit ExcitedSolid(const Scene& scene_)
      : scene(scene_),
        member(own_values(scene)),
        plan(make_plan(device(), scene, {&member, 1}, {})),
        launcher(device(), scene.precision),
        excitation(launcher, scene, plan),
        grid(solid_grid(scene, plan)),
        solid(launcher, scene, scene_definitions(scene, grid), grid, 1, plan.viscous) {
    excitation.prepare({&member, 1});
    solid.build(excitation.parameters, {&member, 1});
  }
  /// Arrival times of the deforming cells, from times of the excited ones.
  std::vector<float> brought_over(std::span<const float> times) const {
    const std::size_t first = 0;
    return values_at(nearest_places(solid, excitation.tissue, times, {&first, 1}), times);
  }

  Scene scene;
  Member member;
  Plan plan;
  Launcher launcher;
  Excitation excitation;
  Grid grid;
  Solid solid;

 private:
  static Member own_values(const Scene& scene) {
    Member member{0, scene.parameters.values()};
    scene.parameters.resolve(member.values);
    return member;
  }
};

}  // namespace cohort::test
