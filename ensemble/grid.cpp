#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "ensemble/sampler.hpp"

namespace cohort {
namespace {

/// A design of `fixed` points times the same number of levels on each of `free` axes.
struct Levels {
  std::int64_t fixed = 1;
  int free = 0;

  std::int64_t members(std::int64_t levels) const {
    std::int64_t product = fixed;
    for (int axis = 0; axis < free; ++axis)
      if (__builtin_mul_overflow(product, levels, &product)) return std::numeric_limits<std::int64_t>::max();
    return product;
  }
};

Levels count(const std::vector<std::int64_t>& levels) {
  Levels result;
  for (const std::int64_t given : levels) {
    if (given == 0)
      ++result.free;
    else if (__builtin_mul_overflow(result.fixed, given, &result.fixed))
      throw std::invalid_argument("a grid of these choices has more points than can be counted");
  }
  return result;
}

/// Largest number of levels of the free axes whose grid has at most `members` points; 0: none has.
std::int64_t levels_within(const Levels& levels, std::int64_t members) {
  if (levels.free == 0) return levels.fixed <= members ? 1 : 0;
  const double root =
      std::pow(static_cast<double>(members) / static_cast<double>(levels.fixed), 1.0 / levels.free);
  const auto near = std::llround(root);
  return levels.members(near) > members ? near - 1 : near;
}

[[noreturn]] void refuse(const Levels& levels, size_t dimensions, std::int64_t within, std::int64_t members) {
  std::string rule = "the same number of levels for each";
  if (levels.fixed > 1) {
    rule = "a level for each choice (" + std::to_string(levels.fixed) + " combinations)";
    if (levels.free > 0) rule += " and the same number of levels for each other parameter";
  }
  std::string fitting = std::to_string(levels.members(std::max<std::int64_t>(within, 1)));
  if (within > 0 && levels.free > 0) fitting += " or " + std::to_string(levels.members(within + 1));
  throw std::invalid_argument("a grid of " + std::to_string(dimensions) +
                              (dimensions == 1 ? " parameter has " : " parameters has ") + rule + ": " +
                              std::to_string(members) + " members do not fit; did you mean " + fitting + "?");
}

class Grid final : public Sampler {
 public:
  explicit Grid(std::vector<std::int64_t> levels) : levels_(std::move(levels)) {}

  std::vector<double> point(std::int64_t member) const override {
    std::vector<double> u(levels_.size());
    for (auto axis = u.size(); axis-- > 0;) {
      const auto levels = levels_[axis];
      u[axis] = levels == 1 ? 0.5 : static_cast<double>(member % levels) / static_cast<double>(levels - 1);
      member /= levels;
    }
    return u;
  }

 private:
  std::vector<std::int64_t> levels_;
};

}  // namespace

std::unique_ptr<Sampler> grid(std::vector<std::int64_t> levels, std::int64_t members) {
  if (levels.empty()) return std::make_unique<Grid>(levels);
  const Levels counts = count(levels);
  const std::int64_t within = levels_within(counts, members);
  if (within < 1 || counts.members(within) != members) refuse(counts, levels.size(), within, members);
  std::replace(levels.begin(), levels.end(), std::int64_t{0}, within);
  return std::make_unique<Grid>(std::move(levels));
}

std::unique_ptr<Sampler> grid(int dimensions, std::int64_t members) {
  return grid(std::vector<std::int64_t>(static_cast<std::size_t>(dimensions), 0), members);
}

}  // namespace cohort
