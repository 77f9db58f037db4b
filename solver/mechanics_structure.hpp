#pragma once

#include <optional>
#include <string>
#include <vector>

#include "solver/scene.hpp"

namespace cohort {

/// Which of a heart's walls deform: those of the cavities that are named. Both ventricles with either, or
/// where none is named; each atrium with its own.
struct DeformingWalls {
  bool ventricles, la, ra;
  bool atria() const { return la || ra; }
};
DeformingWalls deforming_walls(const Mechanics& mechanics);
/// Whether a region has cells that deform: of the schematic heart those of the walls around its cavities.
bool deforms(const Scene& scene, const std::string& region);

/// Mechanics of the schematic heart where a scene does not say otherwise: ventricles that hold the
/// circulation's blood, passive tissue of Guccione et al., a twitch after activation, the supports below.
/// windkessel: only the left cavity.
Mechanics default_heart_mechanics(bool windkessel = false);

/// Supports of the walls that deform: of the ventricles a base that stays in its plane on a ring of springs
/// and an epicardium on the springs of the pericardium; of the atria the same, and springs where they lie
/// against the great vessels.
std::vector<Mechanics::Boundary> default_heart_boundary(const Mechanics& mechanics);

/// What the atrial regions of a heart (la, ra, bachmann) have of their own where their walls deform, by the
/// name of the number ("C_kPa", "peak_kPa", ...). None: as the rest.
std::optional<double> atrial_default(const Scene& scene, const std::string& region, const std::string& name);

/// Surfaces that a boundary condition can name: those of the heart's tissue, or every shape's.
std::vector<std::string> boundary_surfaces(const Scene& scene);

}  // namespace cohort
