#pragma once

#include <span>
#include <vector>

#include "solver/scene.hpp"
#include "solver/simulation.hpp"

namespace cohort {

/// Of a campaign whose geometry is sampled the members that probably have most tissue, a few: the one that is
/// large in all lengths together, and those that have the largest of a length. What a plan states for each of
/// a batch is the most that one of them, or the scene's own heart, takes.
std::vector<Member> largest_members(const Scene& scene, std::span<const Member> members);

}  // namespace cohort
