#pragma once

#include <optional>
#include <span>
#include <vector>

#include "solver/simulation.hpp"
#include "solver/tissue.hpp"

namespace cohort {

/// Place of a probe of the scene, mm.
std::array<double, 3> probe_point(const Scene& scene, const std::string& probe,
                                  std::span<const double> values);

/// The compact cell of member m whose centre is nearest to `point`, at most two cells away along an axis;
/// nothing where the point lies outside the tissue.
std::optional<std::size_t> nearest_cell(const Tissue& tissue, std::size_t m,
                                        const std::array<double, 3>& point);

/// Names of the probes that lie outside the tissue of member m, whose parameters are `values`.
std::vector<std::string> probes_outside(const Scene& scene, const Tissue& tissue, std::size_t m,
                                        std::span<const double> values);

/// Records the potential at the scene's probes, sample by sample, on the device.
class Probes {
 public:
  /// samples: of the whole run.
  /// Device bytes.
  static std::size_t bytes(const Scene& scene, int members_per_batch, int samples);
  Probes(Launcher& launcher, const Scene& scene, const Definitions& definitions, int members_per_batch,
         int samples);

  void prepare(const Tissue& tissue, std::span<const Member> members);
  void sample(const cl::Buffer& potential, int sample);
  /// (members, probes, samples) mV; read back.
  std::vector<float> series();
  int samples() const { return samples_; }

 private:
  Launcher& launcher_;
  const Scene& scene_;
  int samples_, rows_ = 0;
  cl::Buffer cells_, series_;
  Launcher::Handle record_;
};

}  // namespace cohort
