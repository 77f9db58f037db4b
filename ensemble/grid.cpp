#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "ensemble/sampler.hpp"

namespace cohort {
namespace {

std::int64_t power(std::int64_t levels, int dimensions) {
  std::int64_t product = 1;
  for (int axis = 0; axis < dimensions; ++axis)
    if (__builtin_mul_overflow(product, levels, &product)) return std::numeric_limits<std::int64_t>::max();
  return product;
}

class Grid final : public Sampler {
 public:
  Grid(int dimensions, std::int64_t levels) : dimensions_(dimensions), levels_(levels) {}

  std::vector<double> point(std::int64_t member) const override {
    std::vector<double> u(static_cast<std::size_t>(dimensions_));
    for (auto axis = u.rbegin(); axis != u.rend(); ++axis) {
      *axis = levels_ == 1 ? 0.5 : static_cast<double>(member % levels_) / static_cast<double>(levels_ - 1);
      member /= levels_;
    }
    return u;
  }

 private:
  int dimensions_;
  std::int64_t levels_;
};

}  // namespace

std::unique_ptr<Sampler> grid(int dimensions, std::int64_t members) {
  if (dimensions == 0) return std::make_unique<Grid>(0, 1);
  const auto levels = std::llround(std::pow(static_cast<double>(members), 1.0 / dimensions));
  if (power(levels, dimensions) != members) {
    const auto below = power(levels, dimensions) > members ? levels - 1 : levels;
    throw std::invalid_argument(
        "a grid of " + std::to_string(dimensions) +
        " parameters has the same number of levels for each: " + std::to_string(members) +
        " members do not fit; did you mean " + std::to_string(power(below, dimensions)) + " or " +
        std::to_string(power(below + 1, dimensions)) + "?");
  }
  return std::make_unique<Grid>(dimensions, levels);
}

}  // namespace cohort
