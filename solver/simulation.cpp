#include "solver/simulation.hpp"

#include <spdlog/spdlog.h>

#include <stdexcept>

#include "solver/simulation_state.hpp"

namespace cohort {

Simulation::State::State(Device& device, const Scene& scene_, const Plan& plan)
    : scene(scene_), launcher(device, scene_.precision) {
  if (excites(scene)) excitation.emplace(launcher, scene, plan);
  if (Heartbeat::wanted(scene)) heartbeat.emplace(launcher, scene, plan);
}

Simulation::Simulation(Device& device, const Scene& scene, const Plan& plan)
    : state_(std::make_unique<State>(device, scene, plan)) {}
Simulation::~Simulation() = default;

std::vector<Recording> Simulation::run(std::span<const Member> members, double timeout_s) {
  State& s = *state_;
  const auto start = Clock::now();
  std::vector<Recording> recordings(members.size(), blank_recording(s.scene));
  try {
    if (s.excitation) {
      s.launcher.profile(s.excitation->batches == 1);
      s.excitation->prepare(members);
      s.launcher.profile(false);
      s.launcher.queue().finish();
      spdlog::debug("{} members are set up for waves in {:.3g} s, with {} of the device's memory",
                    members.size(), seconds_since(start), s.launcher.device().allocated_bytes());
      Excitation::Beat beat;
      if (s.heartbeat)
        beat = [&](std::span<const Member> own, std::span<Recording* const> own_recordings,
                   const TimeSteps& steps) {
          s.heartbeat->run(own, own_recordings, &*s.excitation, steps, timeout_s);
        };
      s.excitation->run(members, recordings, start, timeout_s, beat);
    } else {
      std::vector<Recording*> all;
      for (Recording& recording : recordings) all.push_back(&recording);
      s.heartbeat->run(members, all, nullptr, {}, timeout_s);
    }
  } catch (const std::runtime_error& error) {
    // Lead fields that do not converge, a heart too large for the memory: one member's matter. Of several
    // the culprit is not known; each is tried alone.
    s.launcher.profile(false);
    if (members.size() == 1) {
      recordings[0] = blank_recording(s.scene);
      reject(recordings[0], error.what());
      return recordings;
    }
    spdlog::info("a batch of {} is run one by one: {}", members.size(), error.what());
    try {
      for (size_t m = 0; m < members.size(); ++m)
        recordings[m] = std::move(run(members.subspan(m, 1), timeout_s).front());
    } catch (const DeviceError& broken) {
      throw DeviceError(fmt::format("{}, behind \"{}\"", broken.what(), error.what()));
    }
    return recordings;
  } catch (const cl::Error& error) {
    throw DeviceError(error);
  }
  for (Recording& recording : recordings)
    recording.wall_s = seconds_since(start) / static_cast<double>(members.size());
  return recordings;
}

void Simulation::observe(Observer observer) {
  if (!state_->excitation) {
    spdlog::warn("there is no tissue to show");
    return;
  }
  Excitation& excitation = *state_->excitation;
  if (excitation.eikonal && observer.interval_ms > 0) {
    spdlog::warn("activation: eikonal keeps no potentials to show; reaction_eikonal and monodomain do");
    observer.interval_ms = 0;
  }
  excitation.observation.emplace(std::move(observer), state_->scene.precision,
                                 sampling_interval_ms(state_->scene));
}

void Simulation::time_every_launch(bool on) {
  state_->launcher.time_every_launch(on);
}

std::vector<KernelPerformance> Simulation::performance() const {
  return state_->launcher.performance();
}
double Simulation::simulated_ms() const {
  return state_->excitation ? state_->excitation->simulated_ms : state_->heartbeat->simulated_ms();
}
double Simulation::cell_updates() const {
  return state_->excitation ? state_->excitation->cell_updates : 0;
}

}  // namespace cohort
