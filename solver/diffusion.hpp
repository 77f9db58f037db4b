#pragma once

#include <vector>

#include "solver/precision.hpp"
#include "solver/tissue.hpp"

namespace cohort {

/// The operator div(D grad u) on the tissue, assembled by kernels/stencil.cl as couplings (6, stride).
class Diffusion {
 public:
  /// What the operator is for: a potential without flux through the surface, the source of the ECG
  /// (kernels/stencil.cl says how they differ in cut cells), or a potential across jumps of conductivity.
  enum class Use { monodomain, ecg_source, layered };

  Diffusion(Launcher& launcher, const Scene& scene, const Definitions& definitions);

  /// Assembles couplings of sigma * scale / dx^2 into `stencil` (6, stride), sigma from the regions'
  /// parameters at `offset` (longitudinal, transverse behind it), for the monodomain equation divided by each
  /// member's chi Cm. The tissue's fibres must have been built.
  void assemble(const Tissue& tissue, const cl::Buffer& parameters, int offset, double scale, Use use,
                const cl::Buffer& stencil);

  /// As above, from tensors (6, stride) xx yy zz xy xz yz that the caller has written, already divided by
  /// dx^2.
  void assemble_tensors(const Tissue& tissue, const cl::Buffer& tensors, Use use, const cl::Buffer& stencil);

  /// Gershgorin's bound of the largest |eigenvalue| of the operator over capacity, 1/ms, by member; read
  /// back.
  std::vector<double> bound(const Tissue& tissue, const cl::Buffer& stencil);

  static std::size_t bytes(std::int64_t stride, Precision precision) {
    return static_cast<std::size_t>(stride) * 6 * real_bytes(precision);
  }
  /// Of the tensors and bounds that stencils of up to `stride` cells are assembled from.
  static std::size_t scratch_bytes(std::int64_t stride, Precision precision) {
    return bytes(stride, precision) +
           static_cast<std::size_t>(stride / Tissue::block_cells + 1) * real_bytes(precision);
  }

 private:
  void reserve(const Tissue& tissue);

  Launcher& launcher_;
  Definitions definitions_;
  Precision precision_;
  int width_;
  cl::Buffer conductivity_, block_bound_;
  int capacity_ = 0;
  Launcher::Handle tensor_, assemble_, bound_;
};

}  // namespace cohort
