#include <spdlog/fmt/fmt.h>

#include <filesystem>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "ensemble/config.hpp"
#include "ensemble/config_sections.hpp"
#include "ensemble/csv_points.hpp"
#include "ensemble/read_values.hpp"
#include "ensemble/sampler.hpp"
#include "ensemble/sha256.hpp"

namespace cohort {

namespace {

void read_positive(Node& map, const std::string& key, const std::string& unit, double& value,
                   Mistakes& mistakes) {
  Node* node = take(map, key);
  if (!node) return;
  const auto number = read_number(*node, node->path, unit, mistakes);
  if (!number) return;
  if (!(*number > 0)) {
    mistakes.add(node->place,
                 fmt::format("{} is {}; it must be positive", node->path, with_unit(*number, unit)));
    return;
  }
  value = *number;
}

void read_count(Node& map, const std::string& key, std::int64_t least, int& value, Mistakes& mistakes) {
  Node* node = take(map, key);
  if (!node) return;
  const auto number = read_whole(*node, node->path, least, mistakes);
  if (!number) return;
  if (*number > std::numeric_limits<int>::max()) {
    mistakes.add(node->place,
                 fmt::format("{} is {}; that is more than any device takes", node->path, *number));
    return;
  }
  value = static_cast<int>(*number);
}

void read_fraction(Node& map, const std::string& key, double& value, Mistakes& mistakes) {
  Node* node = take(map, key);
  if (!node) return;
  const auto number = read_number(*node, node->path, "1", mistakes);
  if (!number) return;
  if (!(*number >= 0 && *number <= 1))
    mistakes.add(node->place, fmt::format("{} is {}; it must lie in [0, 1]", node->path, *number));
  else
    value = *number;
}

void read_members(Node& node, Campaign& campaign, Mistakes& mistakes) {
  const auto count = read_whole(node, node.path, 1, mistakes);
  if (count.value_or(0) > most_members)
    mistakes.add(
        node.place,
        fmt::format("{} is {}; at most {} (the host holds every member's parameters in memory); split "
                    "the campaign",
                    node.path, *count, most_members));
  else
    campaign.members = count.value_or(1);
}

/// The CSV of points: its header names what is sampled, its rows are the members. Returns its checksum as a
/// line.
std::string read_points(Node* points, Node* members, const Place& place, const std::string& file,
                        Campaign& campaign, Mistakes& mistakes) {
  if (!campaign.parameters.empty())
    mistakes.add(
        place, "parameters and method csv exclude each other: the header of the file names what is sampled");
  if (!points) {
    mistakes.add(place, "\"points\" is missing in campaign; method csv reads them from a file");
    return {};
  }
  const auto name = read_text(*points, points->path, mistakes);
  if (!name) return {};
  campaign.points_file = (std::filesystem::path(file).parent_path() / *name).string();
  try {
    const CsvPoints table = read_csv_points(campaign.points_file, campaign.scene.parameters);
    campaign.points_paths = table.paths;
    campaign.points_sha256 = sha256(read_campaign_file(campaign.points_file));
    const auto rows = static_cast<std::int64_t>(table.rows);
    if (rows == 0) mistakes.add(points->place, fmt::format("{} has no rows", campaign.points_file));
    if (!members)
      campaign.members = rows;
    else if (campaign.members > rows)
      mistakes.add(members->place, fmt::format("campaign.members is {}; {} has {} rows", campaign.members,
                                               campaign.points_file, rows));
    return fmt::format("# points {} sha256 {}\n", *name, campaign.points_sha256);
  } catch (const std::invalid_argument& error) {
    std::istringstream lines(error.what());
    for (std::string line; std::getline(lines, line);) mistakes.add(points->place, line);
  }
  return {};
}

}  // namespace

std::string read_campaign_section(Node* map, const std::string& file, bool complete, Campaign& campaign,
                                  Mistakes& mistakes) {
  Node empty;
  empty.kind = Node::Kind::map;
  empty.place = {file, 1, 1};
  empty.name = "campaign";
  Node& section = map ? *map : empty;

  if (Node* method = take(section, "method"))
    campaign.method =
        static_cast<Method>(read_choice(*method, method->path,
                                        {"sobol", "latin_hypercube", "grid", "monte_carlo", "csv"}, mistakes)
                                .value_or(0));
  Node* members = take(section, "members");
  if (members)
    read_members(*members, campaign, mistakes);
  else if (!campaign.parameters.empty() && campaign.method != Method::csv)
    mistakes.add(section.place, "\"members\" is missing in campaign; parameters are sampled, say how often");
  if (Node* seed = take(section, "seed"))
    campaign.seed = static_cast<std::uint64_t>(read_whole(*seed, seed->path, 0, mistakes).value_or(0));
  read_positive(section, "timeout_s", "s", campaign.timeout_s, mistakes);
  read_positive(section, "memory_limit_GB", "GB", campaign.memory_limit_GB, mistakes);
  read_fraction(section, "check_fraction", campaign.check_fraction, mistakes);
  read_count(section, "retries", 0, campaign.retries, mistakes);
  read_count(section, "members_per_device", 1, campaign.members_per_device, mistakes);

  Node* points = take(section, "points");
  check_keys(section, {}, mistakes);
  if (campaign.method == Method::csv && !complete) return {};
  if (campaign.method == Method::csv)
    return read_points(points, members, section.place, file, campaign, mistakes);
  if (points) mistakes.add(points->place, "campaign.points belongs to method csv; set \"method: csv\"");
  try {
    if (members && mistakes.empty()) make_sampler(campaign);
  } catch (const std::invalid_argument& error) {
    mistakes.add(members->place, fmt::format("campaign.members: {}", error.what()));
  }
  return {};
}

}  // namespace cohort
