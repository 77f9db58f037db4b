#pragma once

#include <optional>
#include <span>
#include <vector>

#include "solver/electromechanics.hpp"
#include "solver/excitation.hpp"
#include "solver/lumped_circulation.hpp"
#include "solver/simulation.hpp"
#include "solver/solid_points.hpp"
#include "solver/tension_drive.hpp"

namespace cohort {

/// The mechanics' grid: it holds what the plan's grid holds.
Grid solid_grid(const Scene& scene, const Plan& plan);

/// The beating heart of a batch: deforming tissue, circulation, and what is recorded of them. The host
/// enqueues many steps and reads the members' states now and then; every member has its own time, step and
/// end on the device.
class Heartbeat {
 public:
  /// Whether the scene has what beats.
  static bool wanted(const Scene& scene) { return scene.circulation || scene.mechanics; }
  static std::size_t bytes(const Scene& scene, int members_per_batch);
  Heartbeat(Launcher& launcher, const Scene& scene, const Plan& plan);

  /// Beats of members to their ends: pressures, volumes and their features into `recordings`. Members whose
  /// recording is not done (yet rejected, unstable) are left as they are. excitation: which activated these
  /// members, or will (Excitation::coupled), in steps of `steps`; null where nothing is excited.
  void run(std::span<const Member> members, std::span<Recording* const> recordings, Excitation* excitation,
           const TimeSteps& steps, double timeout_s);

  double simulated_ms() const { return simulated_ms_; }  ///< summed over members
  double prepared_s() const { return prepared_s_; }      ///< of the last run: until its steps began

 private:
  void upload(std::span<const Member> members);
  void activate(std::span<const Member> members, std::span<const std::size_t> of_tissue,
                Excitation& excitation);
  /// Both return whether the time was over first.
  bool beat_alone(Clock::time_point start, double timeout_s);
  bool beat_tissue(Clock::time_point start, double timeout_s);
  /// Step `number` of all that beats; now and then it looks at cells and the speed of waves.
  /// windows: some members may wait, so that any step may be the one before a look.
  void step(std::int64_t number, bool windows);
  /// Cells and tissue together: solver/heartbeat_windows.cpp. all: of the batch, of which `beating` beat.
  bool beat_with_cells(std::span<const Member> all, std::span<Recording* const> recordings,
                       std::span<const std::size_t> beating, Excitation& excitation, const TimeSteps& steps,
                       Clock::time_point start, double timeout_s);
  bool step_until_all_wait(double window_ms, Clock::time_point start, double timeout_s);
  /// timeout_s: that was over before all had ended, or 0.
  void store(const Member& member, std::size_t k, double timeout_s, const HeartStatus& status,
             std::span<const double> tissue, Recording& recording);

  // Steps between two looks at the speed of waves, which sets the next ones' length; a step grows by 0.1 % at
  // most.
  static constexpr int steps_per_measure = 16;

  Launcher& launcher_;
  const Scene& scene_;
  std::size_t samples_;
  std::optional<LumpedCirculation> circulation_;
  std::optional<Solid> solid_;
  std::optional<SolidPoints> points_;
  std::optional<TensionDrive> drive_;  ///< where templates drive the tension
  std::optional<Electromechanics> coupling_;
  cl::Buffer parameters_;
  double simulated_ms_ = 0, prepared_s_ = 0;
};

}  // namespace cohort
