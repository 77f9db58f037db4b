#pragma once

#include <memory>
#include <span>
#include <vector>

#include "solver/diffusion.hpp"
#include "solver/torso.hpp"

namespace cohort {

/// The ECG by a solve of the torso at every sample (kernels/forward_ecg.cl): what lead fields are checked
/// against.
class ForwardEcg {
 public:
  ForwardEcg(Launcher& launcher, const Scene& scene, const Definitions& definitions);

  /// Torsos, the source of sigma_i, and where the dipole of each tissue cell goes. The tissue's fibres must
  /// have been built.
  void assemble(const Tissue& tissue, Diffusion& diffusion, const cl::Buffer& parameters,
                std::span<const Member> members);
  /// Writes the eight leads (I, II, V1 ... V6; mV) of the potential V (stride) as a row of `series` for each
  /// member: (members, row) reals from row number members * slot on. Waits for the device.
  void sample(const Tissue& tissue, const cl::Buffer& V, const cl::Buffer& series, int row, int slot);

  /// Residual over source where it was largest since assemble(), by member.
  const std::vector<double>& worst_residual() const { return worst_residual_; }
  /// The torso of member m, set up.
  Torso& torso(std::size_t m) { return *hearts_[m].torso; }
  double iterations_per_sample() const;

  static std::size_t bytes(std::int64_t stride, Precision precision);  ///< without the torsos

 private:
  struct Heart {
    std::unique_ptr<Torso> torso;
    cl::Buffer node, start, from, share, source, potential;
    int nodes = 0, entries = 0;
    double inverse_conductivity = 0;
  };
  void find_nodes(const Tissue& tissue, std::size_t m, const Member& member);

  Launcher& launcher_;
  const Scene& scene_;
  int intracellular_offset_, width_, capacity_ = 0;
  cl::Buffer faces_, conductivity_, dipoles_;
  std::vector<Heart> hearts_;
  std::vector<double> worst_residual_;
  std::int64_t solves_ = 0, iterations_ = 0;
  Launcher::Handle dipole_, deposit_, read_;
};

}  // namespace cohort
