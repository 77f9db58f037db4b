#include "ensemble/sampler.hpp"

#include <stdexcept>

namespace cohort {

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
      break;
  }
  throw std::invalid_argument("a CSV file of points has no sampler");
}

}  // namespace cohort
