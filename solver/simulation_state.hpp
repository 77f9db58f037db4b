#pragma once

#include <optional>
#include <span>

#include "solver/excitation.hpp"
#include "solver/heartbeat.hpp"

namespace cohort {

/// What a simulation keeps on its device. What the scene does not ask for is not there.
struct Simulation::State {
  State(Device& device, const Scene& scene, const Plan& plan);

  const Scene& scene;
  Launcher launcher;
  std::optional<Excitation> excitation;
  std::optional<Heartbeat> heartbeat;
};

}  // namespace cohort
