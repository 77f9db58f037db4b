#pragma once

#include <span>

#include "solver/lumped_circulation.hpp"
#include "solver/simulation.hpp"

namespace cohort {

/// The beating heart of a batch: its circulation, and what is recorded of it. The host enqueues many steps
/// and reads the members' status now and then; every member has its own time, step and end on the device.
class Heartbeat {
 public:
  /// Whether the scene has what beats.
  static bool wanted(const Scene& scene) { return scene.circulation.has_value(); }
  static std::size_t bytes(const Scene& scene, int members_per_batch);
  Heartbeat(Launcher& launcher, const Scene& scene, int members_per_batch);

  /// Beats of members to their ends: pressures, volumes and their features into `recordings`. Members whose
  /// recording is not done (yet rejected, unstable) are left as they are.
  void run(std::span<const Member> members, std::span<Recording> recordings, double timeout_s);

  double simulated_ms() const { return simulated_ms_; }  ///< summed over members

 private:
  void store(const Member& member, const HeartStatus& status, std::span<const float> pressure,
             std::span<const float> volume, Recording& recording) const;

  Launcher& launcher_;
  const Scene& scene_;
  LumpedCirculation circulation_;
  cl::Buffer parameters_;
  double simulated_ms_ = 0;
  int batches_ = 0;
};

}  // namespace cohort
