#pragma once

#include <string>

#include "solver/device.hpp"
#include "solver/labels.hpp"
#include "solver/scene.hpp"
#include "solver/simulation.hpp"

namespace cohort {

/// One member's heart as a map of labels in convention `cohort`: heart regions 1 to 9, blood 11 to 16, other
/// regions from 101; the image's millimetres are the heart's frame. The comment names the labels, other
/// regions' kinds and the stimulus sites. Faces of voxels lie on multiples of the scene's dx; a label map is
/// written as it was sampled, with the walls grown, and `spacing_mm` is the nearest to the one asked for that
/// divides dx. 0: 0.5 mm or what is next to it from below, but 2 to 4
/// labels to an edge of a cell.
LabelImage label_image(Device& device, const Scene& scene, const Member& member, double spacing_mm);

}  // namespace cohort
