#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "ensemble/campaign.hpp"

namespace cohort {

/// A design of N points in the unit cube [0,1]^d. A point depends on seed, member and (where the method needs
/// strata) N alone, never on which points were asked for before.
class Sampler {
 public:
  virtual ~Sampler() = default;
  /// Point of `member` (0 <= member < N), length d.
  virtual std::vector<double> point(std::int64_t member) const = 0;
};

/// Independent uniform points.
std::unique_ptr<Sampler> monte_carlo(std::uint64_t seed, int dimensions);

/// One point in each of the N strata of every axis, in random order, at a random place in its stratum.
/// M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21 (1979) 239-245.
std::unique_ptr<Sampler> latin_hypercube(std::uint64_t seed, int dimensions, std::int64_t members);

/// Full factorial design with the same number of levels on every axis, ends included; the last axis runs
/// fastest. Throws std::invalid_argument naming the nearest counts that fit when `members` is not a d-th
/// power.
std::unique_ptr<Sampler> grid(int dimensions, std::int64_t members);

/// Sobol' sequence in Gray code order with the direction numbers of S. Joe, F. Y. Kuo, SIAM J. Sci. Comput.
/// 30 (2008) 2635-2654 (new-joe-kuo-6.21201). Scrambled: a random linear matrix scramble with a digital shift
/// (J. Matousek, J. Complexity 14 (1998) 527-556), which keeps the net. Throws std::invalid_argument beyond
/// sobol_dimensions.
std::unique_ptr<Sampler> sobol(std::uint64_t seed, int dimensions, bool scrambled = true);
inline constexpr int sobol_dimensions = 1024;

/// As above, where an axis with levels[axis] > 0 has exactly those and only the axes of 0 share a number.
std::unique_ptr<Sampler> grid(std::vector<std::int64_t> levels, std::int64_t members);

/// The sampler of a campaign: in a grid, a parameter with choices has a level for each of them. Throws as
/// below.
std::unique_ptr<Sampler> make_sampler(const Campaign& campaign);

/// The sampler of a method. Throws std::invalid_argument as above, and for Method::csv and table, whose
/// points are physical.
std::unique_ptr<Sampler> make_sampler(Method method, std::uint64_t seed, int dimensions,
                                      std::int64_t members);

}  // namespace cohort
