#pragma once

#include <span>
#include <string>

#include "solver/simulation.hpp"
#include "solver/tissue.hpp"

namespace cohort {

/// Writes what a batch computes into the recordings of its members, in the order of layout().
class RecordingWriter {
 public:
  /// quantities: of one member and sample, the leads in mV and then the number of cells without a potential
  /// of use.
  RecordingWriter(const Scene& scene, int quantities);

  /// One sample of every member, row (members, quantities): eight leads to twelve. Members with potentials
  /// that are of no use end as unstable.
  void store_sample(int sample, double time_ms, const double* row,
                    std::span<Recording* const> recordings) const;
  /// Features of member m of the batch, if it is done. activation: (activation fields, stride) ms;
  /// probe_potential: its series, if the scene has probes.
  void store_features(const Tissue& tissue, std::span<const float> activation,
                      std::span<const float> probe_potential, std::size_t m, const Member& member,
                      Recording& recording) const;
  int samples() const { return static_cast<int>(layout_.ecg_ms.size()); }

 private:
  const Scene& scene_;
  Layout layout_;
  int quantities_;
};

/// Of a member that has not begun: nothing but NaN, in the shapes of layout().
Recording blank_recording(const Scene& scene);

/// Ends a member that went wrong in its steps: with half of them it may do.
void end_unstable(Recording& recording, double time_ms, const std::string& reason);

/// Ends a member that cannot run.
void reject(Recording& recording, const std::string& reason);

}  // namespace cohort
