#pragma once

#include <string>

#include "ensemble/campaign.hpp"

namespace cohort {

/// What determines the results of a campaign, as text in one fixed form, a line for each fact: structure,
/// parameters, what is sampled and how. Files that mean the same have the same text, whatever their comments,
/// order of keys or spelling of numbers. Limits (time, memory, retries, members in a launch) and the store
/// are left out: a campaign may be finished under others.
std::string canonical_text(const Campaign& campaign);

/// The lines of it that tell the structure of a scene without its outputs.
std::string structure_text(const Scene& scene);

}  // namespace cohort
