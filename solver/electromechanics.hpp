#pragma once

#include <span>
#include <string>
#include <vector>

#include "solver/monodomain.hpp"
#include "solver/solid.hpp"

namespace cohort {

/// What excited cells and the deforming tissue give each other at the ends of windows of time, on the device
/// (kernels/electromechanics.cl): the cells' own potential or calcium drives the tension, and stretch opens
/// channels. The two may have grids of their own.
class Electromechanics {
 public:
  /// Whether cells and tissue of the scene go through time together: not by eikonal, whose cells are
  /// templates, and not where the tension needs no more than activation times.
  static bool wanted(const Scene& scene, ActivationMethod activation);
  /// definitions: of the excited tissue.
  Electromechanics(Launcher& launcher, const Scene& scene, const Definitions& definitions);

  /// Of the program of the deforming tissue.
  static std::vector<std::string> options(const Scene& scene);
  /// Where cells of both find each other. members: of the tissue, by member of the solid.
  void connect(Solid& solid, const Tissue& tissue, std::span<const std::size_t> members);
  /// Potential or calcium, and activation times, for a window that begins at begin_ms of the beat. first: it
  /// has been so before as well.
  void drive(Solid& solid, const Tissue& tissue, const Monodomain& monodomain, double begin_ms,
             double length_ms, bool first);
  /// Stretch, for the cells' next steps. parameters: blocks of the tissue's members.
  void stretch(const Solid& solid, const Tissue& tissue, const Monodomain& monodomain,
               const cl::Buffer& parameters);

  static std::size_t bytes(const Scene& scene, std::size_t cells, std::size_t stride);

 private:
  Launcher& launcher_;
  const Scene& scene_;
  bool driven_, calcium_;
  cl::Buffer first_, places_, drive_, cell_of_;
  Launcher::Handle bring_drive_, bring_activation_, bring_stretch_;
};

}  // namespace cohort
