#include "ensemble/sampler.hpp"

#include <stdexcept>
#include <utility>

namespace cohort {

std::unique_ptr<Sampler> make_sampler(const Campaign& campaign) {
  if (campaign.method != Method::grid)
    return make_sampler(campaign.method, campaign.seed, static_cast<int>(campaign.parameters.size()),
                        campaign.members);
  std::vector<std::int64_t> levels;
  for (const SampledParameter& parameter : campaign.parameters)
    levels.push_back(static_cast<std::int64_t>(parameter.distribution.choices.size()));
  return grid(std::move(levels), campaign.members);
}

std::unique_ptr<Sampler> make_sampler(Method method, std::uint64_t seed, int dimensions,
                                      std::int64_t members) {
  switch (method) {
    case Method::sobol:
      return sobol(seed, dimensions);
    case Method::latin_hypercube:
      return latin_hypercube(seed, dimensions, members);
    case Method::grid:
      return grid(dimensions, members);
    case Method::monte_carlo:
      return monte_carlo(seed, dimensions);
    case Method::csv:
    case Method::table:
      break;
  }
  throw std::invalid_argument("points that are given have no sampler");
}

}  // namespace cohort
