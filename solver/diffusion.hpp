#pragma once

#include <vector>

#include "solver/precision.hpp"
#include "solver/tissue.hpp"

namespace cohort {

/// The operator div(D grad u) on the tissue, assembled by kernels/stencil.cl as couplings (6, stride).
class Diffusion {
 public:
  /// What the operator is for: a potential without flux through the surface, or one across jumps of
  /// conductivity (kernels/stencil.cl).
  enum class Use { monodomain, layered };

  Diffusion(Launcher& launcher, const Scene& scene, const Definitions& definitions);

  /// Assembles couplings of sigma * scale / dx^2 into `stencil` (6, stride), sigma from the regions'
  /// parameters at `offset` (longitudinal, transverse behind it), for the monodomain equation divided by each
  /// member's chi Cm. The tissue's fibres must have been built.
  void assemble(const Tissue& tissue, const cl::Buffer& parameters, int offset, double scale, Use use,
                const cl::Buffer& stencil);

  /// As above, from tensors (6, stride) xx yy zz xy xz yz that the caller has written, already divided by
  /// dx^2.
  void assemble_tensors(const Tissue& tissue, const cl::Buffer& tensors, Use use, const cl::Buffer& stencil);

  /// The ECG's source: writes its faces (3, stride; kernels/source_faces.cl) and returns the tensors sigma *
  /// scale of the cells (6, stride) xx yy zz xy xz yz, sigma as above. They stand until the next call.
  const cl::Buffer& assemble_source(const Tissue& tissue, const cl::Buffer& parameters, int offset,
                                    double scale, const cl::Buffer& faces);

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
  void compile();
  void conductivities(Launcher::Handle& kernel, const Tissue& tissue, const cl::Buffer& parameters,
                      int offset, double scale, bool membrane);

  Launcher& launcher_;
  Definitions definitions_;
  Precision precision_;
  int width_;
  cl::Buffer conductivity_, block_bound_;
  int capacity_ = 0;
  Launcher::Handle tensor_, assemble_, source_tensor_, faces_, bound_;
};

}  // namespace cohort
