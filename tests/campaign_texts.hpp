#pragma once

#include <string>

#include "ensemble/config.hpp"

// Campaigns of a few lines, for tests of what reads them.
namespace cohort::test {

inline const char* const slab = R"(
scene:
  geometry: {box: {size_mm: [20, 7, 3]}}
  grid: {dx_mm: 0.5}
  time: {end_ms: 1e2}
  precision: double
  stimuli:
    corner: {shape: box, lower_mm: [0, 0, 0], upper_mm: [+1.5, 1.5, 1.5], start_ms: 5, duration_ms: 2}
outputs:
  activation: {probes: {near_mm: [1, 1, 1], far_mm: [20, 7, 3]}}
)";

inline const char* const heart = R"(
scene:
  geometry: {heart: {lv_radius_mm: 26}}
  grid: {dx_mm: 4}
outputs: {ecg: {leads: 12, rate_hz: 500}}
parameters:
  geometry.heart.lv_wall_mm: {normal: [10, 1], bounds: [7, 14]}
  geometry.heart.lv_radius_mm: {uniform: [20, 30]}
campaign: {members: 9, method: grid, seed: 7, timeout_s: 600, retries: 1, members_per_device: 3}
store: results/heart.h5
)";

inline double value(const Campaign& campaign, const std::string& path) {
  return campaign.scene.parameters[campaign.scene.parameters.index(path)].value;
}

}  // namespace cohort::test
