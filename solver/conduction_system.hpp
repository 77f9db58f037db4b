#pragma once

#include <span>
#include <vector>

#include "solver/eikonal.hpp"
#include "solver/precision.hpp"
#include "solver/scene.hpp"
#include "solver/simulation.hpp"

namespace cohort {

/// The early sites of a normal heart, by name: left septum, anterior, inferior and lateral; right septum and
/// free wall.
std::vector<ConductionSystem::EarlySite> default_early_sites();

/// Declares electrophysiology.conduction_system.*, where the scene has one: times of the sinoatrial and
/// atrioventricular nodes, speed and extent of the fast layer, place and time of each early site.
void declare_conduction_system(Scene& scene);

/// Graphs that each region belongs to for Eikonal, a bit for each: atria and ventricles apart, the conduction
/// path in both. Empty for geometries without atria and ventricles.
std::vector<std::uint8_t> activation_graphs(const Scene& scene);

/// The conduction system of a batch on the device (kernels/conduction_system.cl): the fast layer as a sheet
/// along the endocardium, and the cells where waves start.
class ConductionNetwork {
 public:
  ConductionNetwork(Launcher& launcher, const Scene& scene, const Definitions& definitions,
                    int members_per_batch);

  /// Marks the sheet and finds the sites of `members`, whose blocks stand in `parameters`. The tissue's
  /// coordinates and fibres must have been built. velocity (2, stride) real, along and across fibres, mm/ms.
  /// Reads the cell and the point of each site from the device.
  void assemble(const Tissue& tissue, const cl::Buffer& parameters, const cl::Buffer& velocity,
                std::span<const Member> members);

  /// (3, stride) real: the fibres that arrival times go by.
  const cl::Buffer& fibres() const { return fibres_; }
  Eikonal::Sheet sheet() const { return {sheet_id_, sheet_distance_, sheet_speed_, sheet_depth_}; }
  /// Of all members; the sites that found no cell are left out.
  const std::vector<Eikonal::Source>& sources() const { return sources_; }
  /// By member: what found no cell, empty where all did.
  const std::vector<std::string>& missing() const { return missing_; }

  /// Device bytes for `members` members with `stride` compact cells in all, with what Eikonal keeps of a
  /// sheet and of the sources.
  static std::size_t bytes(const Scene& scene, int members, std::int64_t stride);

 private:
  struct Target;
  std::vector<Target> targets(std::span<const double> values) const;

  Launcher& launcher_;
  const Scene& scene_;
  int members_per_batch_, targets_, capacity_ = 0;
  cl::Buffer fibres_, sheet_id_, sheet_distance_, sheet_speed_, sheet_depth_, target_block_, cells_, points_,
      member_range_;
  std::vector<Eikonal::Source> sources_;
  std::vector<std::string> missing_;
  Launcher::Handle sheet_kernel_, fibres_kernel_, nearest_, points_kernel_;
};

}  // namespace cohort
