#pragma once

#include <vector>

#include "solver/lead_weights.hpp"
#include "solver/monodomain.hpp"

namespace cohort {

/// Samples the leads and checks the potential of a batch on the device; the host reads many samples at a
/// time.
class Recorder {
 public:
  static constexpr int samples_per_fetch = 20;  ///< of a run

  /// Device bytes for `stride` compact cells.
  static std::size_t bytes(const Scene& scene, int members_per_batch, int samples, std::int64_t stride);
  /// samples: the most that are kept on the device between two fetches.
  Recorder(Launcher& launcher, const Scene& scene, const Definitions& definitions, int members_per_batch,
           int samples);

  void prepare(const Tissue& tissue);
  /// Enqueues sample number `slot` of the current half of the buffer. closed: the potential with the
  /// splitting closed, where the caller has it.
  void sample(const Tissue& tissue, Monodomain& monodomain, const cl::Buffer* weights, int slot,
              const cl::Buffer* closed = nullptr);
  /// The current half: (samples, members, quantities). Leads that are not weighted sums are the caller's to
  /// write.
  const cl::Buffer& series() const { return series_[half_]; }

  /// Starts reading the `count` samples of the current half and turns to the other half. Not blocking.
  void start_fetch(int count);
  /// Waits for the fetch started before the last start_fetch (or, with `all`, for the last one). Rows of
  /// (samples, members, quantities): the leads in mV, then the number of cells without a potential of use.
  std::vector<double> fetched(bool last);
  int quantities() const { return quantities_; }

 private:
  void begin();

  Launcher& launcher_;
  Definitions definitions_;
  Precision precision_;
  int members_per_batch_, samples_, quantities_, weighted_, width_, members_ = 0;
  int half_ = 0;
  int capacity_blocks_ = 0;
  cl::Buffer partial_, series_[2], first_block_;
  std::vector<std::byte> host_[2];
  cl::Event arrived_[2];
  Launcher::Handle record_blocks_, record_totals_;
};

}  // namespace cohort
