#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "ensemble/campaign.hpp"
#include "solver/simulation.hpp"

namespace cohort {

/// The points of a campaign: what differs between its N members.
struct Samples {
  std::vector<std::string> paths;  ///< (P) sampled parameters
  std::vector<double> unit;        ///< (N, P) in [0,1], row-major; NaN where physical values are given
  std::vector<double> physical;    ///< (N, P)
};

/// Draws the points of all members. Throws std::invalid_argument where the method cannot give them (see
/// sampler.hpp and csv_points.hpp; a CSV file with fewer rows than members).
Samples sample(const Campaign& campaign);

/// The rows of single members, in their order.
Samples rows_of(const Samples& samples, std::span<const std::int64_t> members);

/// All members: the scene's values with the sampled ones in their place, table order, resolved.
std::vector<Member> members(const Campaign& campaign, const Samples& samples);
std::vector<Member> members(const Campaign& campaign);

}  // namespace cohort
