#pragma once

#include <cstdint>
#include <vector>

#include "ensemble/members.hpp"

namespace cohort {

/// How many members of a campaign are run again at half the spacing and the step: check_fraction of them, a
/// half rounded up; at least three where there are three members, none with fraction 0.
std::int64_t check_count(const Campaign& campaign);

/// (N, P) the members' places in the unit cube. What a CSV file gives is scaled by its range in the file; 0
/// where it is the same for all.
std::vector<double> unit_points(const Samples& samples, std::int64_t members);

/// `count` members spread over the parameter space, in ascending order: the one nearest to the middle first,
/// then each time the one farthest from those there are (T. F. Gonzalez, Theor. Comput. Sci. 38 (1985)
/// 293-306), the lowest number where several are as far. Large campaigns are cut into runs of members that
/// are chosen from one by one, so that the time grows with their size and not its square. A function of its
/// arguments alone: every process finds the same members.
std::vector<std::int64_t> choose_checks(const Samples& samples, std::int64_t members, std::int64_t count);

}  // namespace cohort
