#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "solver/conduction_system.hpp"
#include "solver/electrophysiology.hpp"

namespace cohort {

/// Activation by arrival times alone: regions' velocities, the conduction system's layer and sites.
class EikonalActivation {
 public:
  EikonalActivation(Launcher& launcher, const Scene& scene, const Definitions& definitions,
                    int members_per_batch);

  /// Arrival times of `members`, whose blocks stand in `parameters`. The tissue's fibres and coordinates must
  /// have been built.
  void assemble(const Tissue& tissue, const cl::Buffer& parameters, std::span<const Member> members);
  const cl::Buffer& arrival() const { return eikonal_.arrival(); }
  /// (stride) float as other methods record them, -1 where no wave comes before end_ms; read back.
  std::vector<float> activation(const Tissue& tissue, double end_ms);
  const ConductionNetwork& network() const { return network_; }
  /// Why member m cannot be activated; empty when it can.
  const std::string& defect(std::size_t m) const { return defects_[m]; }

  /// Why this method cannot activate the scene, whatever its velocities; empty when it can.
  static std::string refusal(const Scene& scene);
  /// Why the values of a member give some region no velocity; empty where all have one.
  static std::string without_velocity(const Scene& scene, const RegionParameters& regions,
                                      std::span<const double> values);
  static std::size_t bytes(const Scene& scene, int members, std::int64_t stride);

 private:
  Launcher& launcher_;
  const Scene& scene_;
  Precision precision_;
  ConductionNetwork network_;
  Eikonal eikonal_;
  int capacity_ = 0;
  std::vector<std::string> defects_;  ///< by member
  cl::Buffer speed_, activation_;
  Launcher::Handle speeds_, recorded_;
};

}  // namespace cohort
