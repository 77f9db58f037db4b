#pragma once

#include <functional>
#include <string>
#include <vector>

#include "solver/launch.hpp"
#include "solver/scene.hpp"

namespace cohort {

enum class HeartEnd : cl_int { running, done, unstable };
enum class HeartDefect : cl_int { none, no_number, empty, switching, ringing, steep, apart, leaking };

/// How far a member is, as kernels/beats.clh writes it.
struct HeartStatus {
  HeartEnd ended;
  HeartDefect defect;
  cl_int where;           ///< compartment or chamber that the defect is of
  cl_int beats;           ///< completed
  cl_int switches;        ///< of valves, in the beat that had most
  cl_float ended_ms;      ///< since the start of the first beat
  cl_float value;         ///< that the defect is judged by
  cl_float difference;    ///< of the last two beats; NaN before there are two
  cl_float ringing_mmHg;  ///< largest amplitude that alternated from step to step, in chambers of tissue
  cl_float apart_mL;      ///< most between a cavity's blood and its volume
  cl_float steepest_mmHg_per_s;  ///< largest rate of pressure, over a millisecond, in chambers of tissue
};

/// What made a member unstable, in words.
std::string instability(const Scene& scene, const HeartStatus& status);

/// Circulation of a batch of members on the device, in double precision where the device has it. State,
/// clock, extremes of beats and samples of pressure and volume stand on the device; each member has its own
/// time, and steps after its end do nothing.
class LumpedCirculation {
 public:
  static std::size_t bytes(const Scene& scene, int members_per_batch, std::size_t samples);
  /// samples: of pressure and volume, at outputs.pv.rate_hz; of each beat where the scene has beats.
  /// single: without double precision even where the device has it.
  LumpedCirculation(Launcher& launcher, const Scene& scene, int members_per_batch, std::size_t samples,
                    bool single = false);

  /// States at their start. parameters: (members, table size).
  void initialise(const cl::Buffer& parameters, int members);
  /// Enqueues up to `steps` steps of circulation.dt_ms times the member's time.step_factor of every member;
  /// of elastances alone.
  void advance(const cl::Buffer& parameters, int steps);
  int steps_of_beat() const { return steps_of_beat_; }
  double dt_ms() const { return dt_ms_; }

  /// Waits for what is enqueued, as do those below.
  std::vector<HeartStatus> status();
  /// (members, compartments, samples) in mmHg and mL, NaN where not sampled.
  std::vector<float> pressure() { return series(pressure_); }
  std::vector<float> volume() { return series(volume_); }
  /// Blood of every member in all compartments, mL.
  std::vector<double> blood();

  /// (members) heart_state and heart_status of kernels/beats.clh, and the numbers of load_clock(): for
  /// kernels that step tissue too.
  const cl::Buffer& states() const { return states_; }
  const cl::Buffer& statuses() const { return status_; }
  const cl::Buffer& clock() const { return numbers_; }
  const cl::Buffer& pressure_buffer() const { return pressure_; }
  const cl::Buffer& volume_buffer() const { return volume_; }
  int at_most() const { return at_most_; }
  bool single() const { return single_; }

 private:
  std::vector<float> series(const cl::Buffer& buffer);

  Launcher& launcher_;
  std::size_t compartments_, samples_;
  int at_most_, members_ = 0, steps_of_beat_ = 0;
  bool single_;
  double dt_ms_;
  cl::Buffer states_, status_, numbers_, pressure_, volume_, blood_;
  Launcher::Handle start_, advance_, total_;
  std::function<cl::Program()> build_total_;  ///< few ask for the blood
};

}  // namespace cohort
