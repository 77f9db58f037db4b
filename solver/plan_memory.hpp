#pragma once

#include <span>
#include <vector>

#include "solver/launch.hpp"
#include "solver/scene.hpp"
#include "solver/simulation.hpp"
#include "solver/tissue.hpp"

namespace cohort {

/// Of a campaign whose geometry is sampled the members that probably have most tissue, a few: the one that is
/// large in all lengths together, and those that have the largest of a length. What a plan states for each of
/// a batch is the most that one of them, or the scene's own heart, takes.
std::vector<Member> largest_members(const Scene& scene, std::span<const Member> members);

/// Places of a batch's tissue. Large batches are much alike: the first one is built; of small ones each
/// member is counted as the largest. least: of one member.
std::int64_t places_of_batch(Launcher& launcher, const Scene& scene, const Grid& grid,
                             std::span<const Member> members, int batch, std::int64_t least);

}  // namespace cohort
