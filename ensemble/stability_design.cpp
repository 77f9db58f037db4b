#include "ensemble/stability_design.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <set>

#include "ensemble/identity.hpp"
#include "ensemble/random.hpp"
#include "ensemble/sampler.hpp"
#include "ensemble/sha256.hpp"

namespace cohort {

namespace {

using Corner = std::vector<bool>;  // of each range, whether its upper end

/// All corners where they are no more than `most`, else as many, in pairs of opposites.
std::vector<Corner> corners(std::size_t dimensions, std::int64_t most, std::uint64_t seed) {
  std::vector<Corner> result;
  if (dimensions == 0 || most == 0) return result;
  constexpr std::size_t countable = 32;
  const std::int64_t all = dimensions < countable ? std::int64_t{1} << dimensions : 0;
  if (all > 0 && all <= most) {
    for (std::int64_t bits = 0; bits < all; ++bits) {
      Corner corner;
      for (std::size_t axis = 0; axis < dimensions; ++axis) corner.push_back(bits >> axis & 1);
      result.push_back(corner);
    }
    return result;
  }
  std::set<Corner> known;
  for (std::uint64_t draw = 0; static_cast<std::int64_t>(result.size()) < most; ++draw) {
    Corner corner;
    for (std::size_t axis = 0; axis < dimensions; ++axis)
      corner.push_back(random_bits(seed, Stream::corners, static_cast<std::uint32_t>(axis), draw) >> 63);
    if (!known.insert(corner).second) continue;
    result.push_back(corner);
    corner.flip();
    known.insert(corner);
    if (static_cast<std::int64_t>(result.size()) < most) result.push_back(corner);
  }
  return result;
}

class Designer {
 public:
  Designer(const StabilityCase& one, std::uint64_t seed) : one_(one), seed_(seed) {
    for (const StabilityRange& range : one.ranges) add_path(range.path);
    for (const StabilityExtreme& extreme : one.extremes)
      for (const auto& [path, value] : extreme.values) add_path(path);
  }

  StabilityDesign design() {
    add("defaults", defaults());
    for (const Corner& corner : corners(one_.ranges.size(), one_.corners, seed_)) {
      std::vector<double> point(one_.ranges.size());
      for (std::size_t axis = 0; axis < point.size(); ++axis) point[axis] = corner[axis] ? 1 : 0;
      add("corners", at(point));
    }
    std::int64_t next = 0;
    for (; next < one_.interior && !one_.ranges.empty(); ++next) add("interior", at(sobol_point(next)));
    for (const StabilityExtreme& extreme : one_.extremes) {
      add(extreme.name, with(extreme, defaults()));
      for (std::int64_t k = 0; k < one_.with_inside && !one_.ranges.empty(); ++k)
        add(extreme.name, with(extreme, at(sobol_point(next++))));
    }
    return std::move(design_);
  }

 private:
  using Values = std::vector<double>;

  void add_path(const std::string& path) {
    if (std::find(design_.paths.begin(), design_.paths.end(), path) == design_.paths.end())
      design_.paths.push_back(path);
  }
  const ParameterTable& table() const { return one_.campaign.scene.parameters; }
  std::size_t index(const std::string& path) const { return static_cast<std::size_t>(table().index(path)); }

  Values defaults() const { return table().values(); }

  /// Place in the unit cube of the ranges.
  Values at(const std::vector<double>& point) const {
    Values values = defaults();
    for (std::size_t axis = 0; axis < point.size(); ++axis) {
      const StabilityRange& range = one_.ranges[axis];
      values[index(range.path)] = (1 - point[axis]) * range.low + point[axis] * range.high;
    }
    return values;
  }

  std::vector<double> sobol_point(std::int64_t number) const {
    return sobol(seed_, static_cast<int>(one_.ranges.size()))->point(number);
  }

  Values with(const StabilityExtreme& extreme, Values values) const {
    for (const auto& [path, value] : extreme.values) values[index(path)] = value;
    return values;
  }

  /// Within every range, and what has none where the scene has it.
  bool inside(const Values& values) const {
    Values own = defaults();
    table().resolve(own);
    for (const std::string& path : design_.paths) {
      const auto range = std::find_if(one_.ranges.begin(), one_.ranges.end(),
                                      [&](const StabilityRange& r) { return r.path == path; });
      const double value = values[index(path)];
      if (range != one_.ranges.end() ? !(value >= range->low && value <= range->high)
                                     : !inherits(values, path) && value != own[index(path)])
        return false;
    }
    return one_.inside;
  }

  /// Whether a value follows that of another parameter, which has a range of its own or none.
  bool inherits(const Values& resolved, const std::string& path) const {
    const Parameter& parameter = table()[table().index(path)];
    return !parameter.inherits.empty() && table().find(parameter.inherits) >= 0 &&
           resolved[index(path)] == parameter.inherits_factor * resolved[index(parameter.inherits)];
  }

  void add(const std::string& group, Values values) {
    table().resolve(values);
    for (const std::string& path : design_.paths) design_.values.push_back(values[index(path)]);
    design_.groups.push_back(group);
    design_.inside.push_back(inside(values) ? 1 : 0);
  }

  const StabilityCase& one_;
  const std::uint64_t seed_;
  StabilityDesign design_;
};

}  // namespace

StabilityDesign stability_design(const StabilityCase& one, std::uint64_t seed) {
  return Designer(one, seed).design();
}

void use_design(StabilityDesign design, std::uint64_t seed, Campaign& campaign) {
  std::string text = fmt::format("{}\n", fmt::join(design.paths, ","));
  const std::size_t width = design.paths.size();
  for (std::size_t i = 0; i < design.groups.size(); ++i) {
    text += fmt::format("{} {}", design.groups[i], design.inside[i]);
    for (std::size_t p = 0; p < width; ++p) text += fmt::format(",{:.17g}", design.values[i * width + p]);
    text += '\n';
  }
  campaign.method = Method::table;
  campaign.parameters.clear();
  campaign.points_file.clear();
  campaign.seed = seed;
  campaign.members = static_cast<std::int64_t>(design.groups.size());
  campaign.check_fraction = 0;  // the study asks how members end, not how exact they are
  campaign.points_paths = std::move(design.paths);
  campaign.points = std::move(design.values);
  campaign.points_sha256 = sha256(text);
  campaign.study = {std::move(design.groups), std::move(design.inside)};
  campaign.text += fmt::format("# points of a study of stability, sha256 {}\n", campaign.points_sha256);
  campaign.sha256 = sha256(canonical_text(campaign));
}

}  // namespace cohort
