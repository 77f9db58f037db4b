#pragma once

#include <array>
#include <span>
#include <vector>

#include "solver/cell_models.hpp"
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

  void prepare(const Tissue& tissue, std::span<const Member> members);
  /// Enqueues sample number `slot` of the current half of the buffer. closed: the potential with the
  /// splitting closed, where the caller has it.
  void sample(const Tissue& tissue, Monodomain& monodomain, const cl::Buffer* weights, int slot,
              const cl::Buffer* closed = nullptr);
  /// Enqueues a look at the cells as they stand: their states, and the charge that diffusion moves; the last
  /// one before a fetch comes with it.
  void look(const Tissue& tissue, const Monodomain& monodomain);
  /// The current half: (samples, members, quantities). Leads that are not weighted sums are the caller's to
  /// write.
  const cl::Buffer& series() const { return series_[half_]; }

  /// Starts reading the `count` samples of the current half and turns to the other half. Not blocking.
  void start_fetch(int count);
  /// Waits for the fetch started before the last start_fetch (or, with `all`, for the last one). Rows of
  /// (samples, members, quantities): the leads in mV, then the number of cells without a potential of use.
  std::vector<double> fetched(bool last);
  int quantities() const { return quantities_; }

  /// What a member's cells were like at the look that the rows of fetched() came with.
  struct Look {
    double net, all;     ///< sums over the tissue of the currents of diffusion, and of their magnitudes
    bool states_beyond;  ///< some state is beyond what its model declares
  };
  const std::vector<Look>& looks() const { return looks_; }
  /// Where and when member m first had what is of no use, for who asks after it has been told.
  struct First {
    int sample = 0;
    std::size_t cell = 0;  ///< place in the compact fields
    double what = 0;       ///< the potential, mV, or which of the cell's states
  };
  First first_wild(const Tissue& tissue, std::size_t m);
  First first_state_beyond(const Tissue& tissue, std::size_t m);
  /// mV, between which the potential of member m is of use.
  const std::array<double, 2>& bounds(std::size_t m) const { return bounds_[m]; }
  /// By member: the largest, over the leads, of what the weights of a lead sum up to over what their
  /// magnitudes do.
  std::vector<double> weights_left(const Tissue& tissue, const cl::Buffer& weights);

 private:
  void begin();
  First first(const Tissue& tissue, std::size_t m, const cl::Buffer& places, const cl::Buffer& numbers);
  void make_room(const Tissue& tissue);

  Launcher& launcher_;
  Definitions definitions_;
  Precision precision_;
  int members_per_batch_, samples_, quantities_, weighted_, width_, members_ = 0;
  int half_ = 0;
  int capacity_blocks_ = 0, sample_ = 0;
  std::vector<std::array<double, 2>> bounds_;
  std::vector<Look> looks_;
  const Scene& scene_;
  CellModels models_;
  cl::Buffer partial_, series_[2], first_block_, bounds_buffer_, wild_, wild_mV_, moved_, beyond_,
      beyond_state_, checks_[2];
  std::vector<std::byte> host_[2], host_checks_[2];
  cl::Event arrived_[2];
  Launcher::Handle record_blocks_, record_totals_, check_cells_, check_members_, check_weights_;
};

}  // namespace cohort
