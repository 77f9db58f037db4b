#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "solver/device.hpp"
#include "solver/scene.hpp"

namespace cohort {

struct Observer;

/// How a member ended. The numbers stand in the shared file.
enum class Outcome : std::uint8_t { done = 3, failed = 4, timeout = 5, unstable = 6, rejected = 7 };

/// One simulated heart: its row in the shared file and a value for every parameter, in table order, resolved.
struct Member {
  std::int64_t id;
  std::vector<double> values;
};

/// What a member left. Everything but the times is a function of the scene and the member's values alone.
struct Recording {
  Outcome outcome = Outcome::failed;
  std::string reason;  ///< empty when done
  double failed_at_ms = std::numeric_limits<double>::quiet_NaN();
  std::vector<float> ecg;               ///< (leads, samples) mV, row-major; empty without an ECG request
  std::vector<float> pressure, volume;  ///< (compartments, samples) mmHg, mL; empty without a pv request
  std::vector<float> displacement;      ///< (points, 3, samples) mm; empty without a displacement request
  std::vector<float> features;          ///< Layout::features, NaN where undefined
  double dt_ms = 0, dx_mm = 0;
  double wall_s = 0, setup_s = 0, device_s = 0;  ///< timings, shares of the batch
};

/// Shapes and names of what every member of a scene records.
struct Layout {
  std::vector<std::string> leads;         ///< I II III aVR aVL aVF V1 ... V6, or empty
  std::vector<double> ecg_ms;             ///< sample times
  std::vector<std::string> compartments;  ///< of pressure and volume (solver/pv_output.hpp), or empty
  std::vector<double> pv_ms;              ///< sample times, from the start of what is recorded
  std::vector<std::string> points;        ///< whose displacement is recorded, or empty
  std::vector<double> displacement_ms;    ///< sample times, from the start of what is recorded
  std::vector<std::string> features;      ///< names
  std::vector<std::string> feature_units;
};
Layout layout(const Scene& scene);

/// One line of what a plan runs or leaves out.
struct PlannedModule {
  std::string name;  ///< "monodomain", "torso", "mechanics", ...
  bool runs;
  std::string reason;  ///< why it runs or is left out
  std::size_t bytes;   ///< device memory of one batch
};

/// Plane fronts of one excitable region of the scene's own values.
struct PlannedConduction {
  std::string region;
  double along_mm_per_ms, across_mm_per_ms;  ///< converged, or as the region's parameters set it; 0: none
  double width_along_mm, width_across_mm;    ///< of the front: amplitude over steepest slope
};

struct Plan {
  std::vector<PlannedModule> modules;
  ActivationMethod activation = ActivationMethod::monodomain;  ///< never automatic
  std::string activation_reason;
  std::vector<PlannedConduction> conduction;
  std::array<int, 3> cells;  ///< grid extents that hold every member
  std::array<double, 3> origin_mm;
  std::size_t tissue_cells = 0, segments = 0;  ///< of the scene's own values
  int members_per_device = 1;
  int steps = 0;
  double dt_ms = 0;
  bool viscous = false;   ///< some member's deforming tissue is viscous
  std::size_t bytes = 0;  ///< all modules
};

struct PlanOptions {
  int members_per_device = 0;          ///< 0: chosen by size
  int most_members = 0;                ///< of what is chosen; 0: no limit
  std::size_t memory_limit_bytes = 0;  ///< 0: what the device has
};

/// Decides what runs for `scene` on `device`, in how much memory. `members` are all those of the campaign:
/// the grid holds each of them. Evaluates the geometry of the scene's own values and nothing else. Throws
/// std::runtime_error with the bytes named where memory does not suffice, std::invalid_argument for a scene
/// that cannot run (an empty region, a step that does not divide the sampling interval).
Plan make_plan(Device& device, const Scene& scene, std::span<const Member> members,
               const PlanOptions& options);

/// Time and traffic of one kernel.
struct KernelPerformance {
  std::string kernel;
  std::int64_t calls = 0;
  double device_ms = 0;       ///< all calls, from a profiled sample
  double bytes_per_call = 0;  ///< least traffic, declared
};

/// Runs members of one scene on one device, batch after batch. Programs are built once, buffers are kept.
class Simulation {
 public:
  Simulation(Device& device, const Scene& scene, const Plan& plan);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  /// Runs up to plan.members_per_device members in one batch; results in the order of `members`. A member's
  /// recording does not depend on the others. Members that are not finished after timeout_s of wall time end
  /// as Outcome::timeout. Throws only for what is wrong with the device (DeviceError); what is wrong with
  /// a member is its outcome.
  std::vector<Recording> run(std::span<const Member> members, double timeout_s);

  /// Shows `observer` (solver/observer.hpp) the first member of every batch from now on; results stay the
  /// same.
  void observe(Observer observer);

  /// While on, every launch is timed on the device; performance() is then no estimate. Turn it off before
  /// performance() is asked for.
  void time_every_launch(bool on);

  std::vector<KernelPerformance> performance() const;
  double simulated_ms() const;  ///< summed over members
  double cell_updates() const;  ///< tissue cells x steps, summed over members

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace cohort
