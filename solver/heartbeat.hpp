#pragma once

#include <optional>
#include <span>
#include <vector>

#include "solver/excitation.hpp"
#include "solver/lumped_circulation.hpp"
#include "solver/simulation.hpp"
#include "solver/solid_points.hpp"
#include "solver/tension_drive.hpp"

namespace cohort {

/// Spacing of the mechanics' grid: its own, or that of the scene.
double solid_dx_mm(const Scene& scene);
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
  /// members; null where nothing is excited.
  void run(std::span<const Member> members, std::span<Recording> recordings, Excitation* excitation,
           double timeout_s);

  double simulated_ms() const { return simulated_ms_; }  ///< summed over members

 private:
  void upload(std::span<const Member> members);
  void activate(std::span<const Member> members, std::span<const std::size_t> of_tissue,
                Excitation& excitation);
  /// Both return whether the time was over first.
  bool beat_alone(Clock::time_point start, double timeout_s);
  bool beat_tissue(Clock::time_point start, double timeout_s);
  void store(const Member& member, std::size_t k, bool late, const HeartStatus& status,
             std::span<const double> tissue, Recording& recording);

  Launcher& launcher_;
  const Scene& scene_;
  std::size_t samples_;
  std::optional<LumpedCirculation> circulation_;
  std::optional<Solid> solid_;
  std::optional<SolidPoints> points_;
  std::optional<TensionDrive> drive_;  ///< where templates drive the tension
  cl::Buffer parameters_;
  double simulated_ms_ = 0;
};

}  // namespace cohort
