#pragma once

#include <string>
#include <vector>

#include "solver/scene.hpp"

namespace cohort {

/// Mechanics of the schematic heart where a scene does not say otherwise: ventricles that hold the
/// circulation's blood, passive tissue of Guccione et al., a twitch after activation, a base that stays in
/// its plane on a ring of springs, an epicardium on the springs of the pericardium. windkessel: only the left
/// cavity.
Mechanics default_heart_mechanics(bool windkessel = false);

/// Surfaces that a boundary condition can name: those of the heart's tissue, or every shape's.
std::vector<std::string> boundary_surfaces(const Scene& scene);

}  // namespace cohort
