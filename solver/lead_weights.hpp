#pragma once

#include <span>

#include "solver/diffusion.hpp"
#include "solver/torso.hpp"

namespace cohort {

/// Weights that turn potentials of tissue cells into the eight independent leads (kernels/lead_weights.cl).
class LeadWeights {
 public:
  static constexpr int leads = 8;  ///< I, II, V1 ... V6

  LeadWeights(Launcher& launcher, const Scene& scene, const Definitions& definitions, int members_per_batch);

  /// Weights (leads, stride) of the batch on `tissue`, whose fibres must have been built. `parameters` on the
  /// device are those of `members`. Solves the torso where a member's differs from the last one's.
  void assemble(const Tissue& tissue, Diffusion& diffusion, const cl::Buffer& parameters,
                std::span<const Member> members);
  const cl::Buffer& weights() const { return weights_; }
  Torso& torso() { return torso_; }

  static std::size_t bytes(std::int64_t stride, Precision precision);

 private:
  static constexpr int electrodes_a_pass = 3;  // their currents take memory

  Launcher& launcher_;
  const Scene& scene_;
  Torso torso_;
  int intracellular_offset_, width_, capacity_ = 0;
  cl::Buffer currents_, weights_, faces_, block_;
  Launcher::Handle sample_, weigh_;
};

}  // namespace cohort
