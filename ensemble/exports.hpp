#pragma once

#include <filesystem>

#include "ensemble/campaign.hpp"
#include "solver/simulation.hpp"

namespace cohort {

/// One member of a campaign and where to simulate it alone.
struct ExportedMember {
  const Campaign& campaign;
  const Member& member;
  Device& device;
  const Plan& plan;  ///< for this member
};

/// Simulates the member and writes its fields for ParaView into `folder`. tissue.vti: activation, region,
/// fraction, fibres; potential.pvd and potential_*.vti: the potential every `every_ms` (0: none), a multiple
/// of the sampling interval. The scene must ask for activation times. Throws std::runtime_error where the
/// member fails or files cannot be written, std::invalid_argument for the interval.
void export_vtk(const ExportedMember& exported, const std::filesystem::path& folder, double every_ms);

}  // namespace cohort
