#pragma once

#include <optional>
#include <string>
#include <vector>

#include "solver/conduction.hpp"
#include "solver/conduction_system.hpp"
#include "solver/eikonal.hpp"
#include "solver/monodomain.hpp"

namespace cohort {

/// The front in one region of one member, from the cable of its cells, and speeds that its parameters set.
struct RegionFront {
  int region;
  Front front;                                   ///< for 1 mm2/ms
  double diffusivity_along, diffusivity_across;  ///< mm2/ms
  double along_mm_per_ms, across_mm_per_ms;      ///< of the cable; 0: no conduction
  double given_along, given_across;              ///< mm/ms, what arrival times take instead; 0: not set
  double width_along_mm, width_across_mm;
};

/// (members, excitable regions) fronts.
std::vector<RegionFront> region_fronts(Conduction& conduction, const Scene& scene,
                                       std::span<const Member> members);

/// Reaction-eikonal activation: arrival times that trigger the cell model (kernels/reaction_eikonal.cl).
class ReactionEikonal {
 public:
  ReactionEikonal(Launcher& launcher, const Scene& scene, const Definitions& definitions,
                  int members_per_batch);

  /// Solves for the arrival times of `members`, whose monodomain has been assembled on `tissue`, and takes
  /// their stimuli out of it.
  /// With a conduction system the tissue's coordinates must have been built.
  void assemble(const Tissue& tissue, Monodomain& monodomain, const cl::Buffer& parameters,
                std::span<const Member> members);

  /// The trigger during [time, time + dt], before the monodomain's step.
  void trigger(const Tissue& tissue, Monodomain& monodomain, const cl::Buffer& parameters, double time_ms,
               double dt_ms);

  /// When the batch's last trigger ends.
  double last_ms() const { return last_ms_; }
  /// (stride) real ms, of the first beat.
  const cl::Buffer& arrival() const { return eikonal_.arrival(); }
  /// Why the arrival times of member m cannot stand for its stimuli; empty when they can.
  std::string defect(const Tissue& tissue, const Monodomain& monodomain, std::size_t m, const Member& member);

  static std::size_t bytes(const Scene& scene, int members, std::int64_t stride);

 private:
  Launcher& launcher_;
  const Scene& scene_;
  Conduction conduction_;
  Eikonal eikonal_;
  std::optional<ConductionNetwork> network_;
  int width_, members_per_batch_, capacity_ = 0;
  double first_ms_ = 0, last_ms_ = 0;  ///< of all triggers of the batch
  std::vector<double> host_arrival_;
  std::vector<std::string> untriggered_;  ///< by member: why its cells cannot be triggered
  cl::Buffer speeds_, latency_, trigger_, beats_, speed_, initial_, slowness_;
  Launcher::Handle front_speed_, front_sources_, front_slowness_, trigger_cells_;
};

}  // namespace cohort
