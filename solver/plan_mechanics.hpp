#pragma once

#include <span>
#include <string>

#include "solver/launch.hpp"
#include "solver/simulation.hpp"

// What make_plan says of deforming tissue and circulation.
namespace cohort {

class Solid;

/// Throws std::runtime_error naming the bytes where `needed` is more than `limit`.
void refuse_beyond(std::size_t needed, std::size_t limit, const std::string& what);
/// What a plan may take of a device's memory.
std::size_t memory_limit(const Device& device, const PlanOptions& options);

/// A scene without tissue.
Plan plan_circulation(Device& device, const Scene& scene, std::span<const Member> members,
                      const PlanOptions& options);

/// A scene whose tissue deforms but is not excited. base: of the scene's own values, resolved.
Plan plan_solid(Device& device, const Scene& scene, std::span<const Member> members, const Member& base,
                const PlanOptions& options);

/// What runs and yet is odd about the tissue of the scene's own values: nothing holds it, thin walls.
void warn_of_solid(const Scene& scene, const Solid& solid);

/// Expected of the mechanics, at rest.
struct SolidPlan {
  std::size_t cells = 0;
  int steps = 0;
  double dt_ms = 0;
};

/// Appends mechanics, circulation and fluid to the modules of `plan`, whose grid is set. Builds the tissue of
/// the scene's own values; throws std::invalid_argument where it cannot deform (a cavity that is not closed,
/// a clamp that holds nothing).
SolidPlan add_mechanics(Launcher& launcher, const Scene& scene, std::span<const Member> members,
                        const Member& base, int batch, Plan& plan);

}  // namespace cohort
