#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <optional>

#include "ensemble/config.hpp"
#include "ensemble/config_sections.hpp"
#include "ensemble/read_values.hpp"
#include "ensemble/schema.hpp"
#include "ensemble/stability_design.hpp"

// The section `stability` of a study file.
namespace cohort {

namespace {

bool admissible(double value, const Node& node, const Parameter& parameter, Mistakes& mistakes) {
  const bool good = value >= parameter.lower && value <= parameter.upper;
  if (!good)
    mistakes.add(node.place, fmt::format("{} would be {}; it must lie in {}", parameter.path,
                                         with_unit(value, parameter.unit),
                                         range(parameter.lower, parameter.upper, parameter.unit)));
  return good;
}

std::vector<StabilityRange> read_ranges(Node& map, const Scene& scene, Mistakes& mistakes) {
  std::vector<StabilityRange> ranges;
  for (Node::Entry& entry : map.entries) {
    entry.value.read = true;
    const Parameter* parameter = read_path(entry, scene, mistakes);
    if (!parameter) continue;
    const auto pair = read_numbers(entry.value, entry.key, parameter->unit, 2, mistakes);
    if (!pair) continue;
    const double low = (*pair)[0], high = (*pair)[1];
    if (!(low < high)) {
      mistakes.add(entry.value.place,
                   fmt::format("{} has the range [{}, {}]; the first must be less than the second", entry.key,
                               low, high));
      continue;
    }
    const bool lower = admissible(low, entry.value.items[0], *parameter, mistakes);
    if (lower & admissible(high, entry.value.items[1], *parameter, mistakes))
      ranges.push_back({entry.key, low, high});
  }
  return ranges;
}

std::vector<StabilityExtreme> read_extremes(Node& map, const Scene& scene, Mistakes& mistakes) {
  std::vector<StabilityExtreme> extremes;
  for (Node::Entry& entry : map.entries) {
    entry.value.read = true;
    const bool taken = entry.key == "defaults" || entry.key == "corners" || entry.key == "interior";
    if (taken || entry.key.size() > group_bytes)
      mistakes.add(entry.place,
                   fmt::format("an extreme cannot be called \"{}\": {}", entry.key,
                               taken ? "a group of members has that name"
                                     : fmt::format("at most {} letters fit the file", group_bytes)));
    if (!check_name(entry, "an extreme", mistakes) || !expect_map(entry.value, entry.key, mistakes)) continue;
    if (entry.value.entries.empty())
      mistakes.add(entry.place, fmt::format("{} sets nothing; name parameters and values", entry.key));
    StabilityExtreme extreme{entry.key, {}};
    for (Node::Entry& value : entry.value.entries) {
      const Parameter* parameter = read_path(value, scene, mistakes);
      if (!parameter) continue;
      const auto number = read_number(value.value, value.key, parameter->unit, mistakes);
      if (number && admissible(*number, value.value, *parameter, mistakes))
        extreme.values.emplace_back(value.key, *number);
    }
    extremes.push_back(std::move(extreme));
  }
  return extremes;
}

void read_count(Node& map, const std::string& key, std::int64_t& count, Mistakes& mistakes) {
  Node* node = take(map, key);
  if (!node) return;
  count = read_whole(*node, node->path, 0, mistakes).value_or(count);
  if (count > most_members)
    mistakes.add(node->place, fmt::format("{} is {}; at most {}", node->path, count, most_members));
}

/// What a base samples, as ranges.
std::vector<StabilityRange> sampled_ranges(const Campaign& campaign) {
  std::vector<StabilityRange> ranges;
  for (const SampledParameter& sampled : campaign.parameters)
    if (sampled.distribution.lower < sampled.distribution.upper)
      ranges.push_back({sampled.path, sampled.distribution.lower, sampled.distribution.upper});
  return ranges;
}

/// The study with the base and the settings of a case. `own`: whether it has a base of its own; without one
/// it stands on the study's, with all that is set there.
Study study_of_case(Node& map, const Study& study, bool& own, Mistakes& mistakes) {
  Study result = study;
  Node* base = take(map, "base");
  own = base;
  if (base) {
    result.overrides.clear();
    if (const auto name = read_text(*base, base->path, mistakes)) {
      result.base = (std::filesystem::path(study.file).parent_path() / *name).lexically_normal().string();
      try {
        result.base_text = read_campaign_file(result.base);
      } catch (const ConfigError& error) {
        mistakes.add(base->place, error.what());
      }
    }
  }
  if (Node* set = take_map(map, "set", mistakes)) {
    const std::vector<std::string> own_settings = settings(*set);
    result.overrides.insert(result.overrides.end(), own_settings.begin(), own_settings.end());
    set->read = true;
  }
  return result;
}

/// Reads what a case and the section itself have in common. `above`: the section's own, whose ranges a case
/// on the same base has as far as its scene knows them.
void read_design(Node& map, const StabilityCase* above, StabilityCase& one, Mistakes& mistakes) {
  if (Node* ranges = take_map(map, "ranges", mistakes))
    one.ranges = read_ranges(*ranges, one.campaign.scene, mistakes);
  else if (above)
    std::copy_if(above->ranges.begin(), above->ranges.end(), std::back_inserter(one.ranges),
                 [&](const StabilityRange& r) { return one.campaign.scene.parameters.find(r.path) >= 0; });
  else
    one.ranges = sampled_ranges(one.campaign);
  if (Node* extremes = take_map(map, "extremes", mistakes))
    one.extremes = read_extremes(*extremes, one.campaign.scene, mistakes);
  read_count(map, "corners", one.corners, mistakes);
  read_count(map, "interior", one.interior, mistakes);
  read_count(map, "with_inside", one.with_inside, mistakes);
  if (Node* inside = take(map, "inside"))
    one.inside = read_bool(*inside, inside->path, mistakes).value_or(true);
  if (one.ranges.empty() && one.corners + one.interior + one.with_inside > 0)
    mistakes.add(map.place, fmt::format("{} needs ranges for its corners and points inside: neither it nor "
                                        "its base has any",
                                        map.name));
}

/// `others`: gets the mistakes of the case's campaign, which stand in other files.
std::optional<StabilityCase> read_case(Node::Entry& entry, const Study& study, const StabilityCase& above,
                                       std::vector<std::string>& others, Mistakes& mistakes) {
  Node& map = entry.value;
  map.read = true;
  if (!check_name(entry, "a case", mistakes) || !expect_map(map, entry.key, mistakes)) return std::nullopt;
  bool own = false;
  const std::size_t before = mistakes.size();
  const Study base = study_of_case(map, study, own, mistakes);
  if (mistakes.size() > before) return std::nullopt;
  StabilityCase one;
  one.name = entry.key;
  try {
    one.campaign = campaign_of(base, {}, "case " + entry.key);
  } catch (const ConfigError& error) {
    others.insert(others.end(), error.mistakes().begin(), error.mistakes().end());
    return std::nullopt;
  }
  read_design(map, own ? nullptr : &above, one, mistakes);
  check_keys(map, {}, mistakes);
  return one;
}

}  // namespace

StabilityStudy read_stability(Study& study) {
  Mistakes mistakes;
  StabilityStudy result;
  Node* section = require_map(study.root, "stability", mistakes);
  check_keys(study.root, {}, mistakes);
  if (!section) throw ConfigError(mistakes.lines());
  if (Node* seed = take(*section, "seed"))
    result.seed = static_cast<std::uint64_t>(read_whole(*seed, seed->path, 0, mistakes).value_or(0));
  if (Node* share = take(*section, "inside_done")) {
    result.inside_done = read_number(*share, share->path, "1", mistakes).value_or(result.inside_done);
    if (result.inside_done < 0 || result.inside_done > 1)
      mistakes.add(share->place,
                   fmt::format("{} is {}; a share lies in [0, 1]", share->path, result.inside_done));
  }
  StabilityCase main;
  main.campaign = campaign_of(study, {}, study.file);
  read_design(*section, nullptr, main, mistakes);
  std::vector<StabilityCase> cases;
  std::vector<std::string> elsewhere;
  if (Node* map = take_map(*section, "cases", mistakes))
    for (Node::Entry& entry : map->entries)
      if (auto one = read_case(entry, study, main, elsewhere, mistakes)) cases.push_back(std::move(*one));
  check_keys(*section, {}, mistakes);
  if (!mistakes.empty() || !elsewhere.empty()) {
    std::vector<std::string> lines = mistakes.lines();
    lines.insert(lines.end(), elsewhere.begin(), elsewhere.end());
    throw ConfigError(std::move(lines));
  }
  result.cases.push_back(std::move(main));
  std::move(cases.begin(), cases.end(), std::back_inserter(result.cases));
  return result;
}

}  // namespace cohort
