#include "ensemble/members.hpp"

#include <limits>
#include <stdexcept>

#include "ensemble/csv_points.hpp"
#include "ensemble/sampler.hpp"

namespace cohort {
namespace {

Samples sample_csv(const Campaign& campaign) {
  auto points = read_csv_points(campaign.points_file, campaign.scene.parameters);
  const auto rows = static_cast<std::size_t>(campaign.members);
  if (points.rows < rows)
    throw std::invalid_argument(campaign.points_file + ": " + std::to_string(points.rows) + " rows for " +
                                std::to_string(rows) + " members");
  points.values.resize(rows * points.paths.size());
  return {points.paths, std::vector<double>(points.values.size(), std::numeric_limits<double>::quiet_NaN()),
          points.values};
}

Samples sample_table(const Campaign& campaign) {
  const auto rows = static_cast<std::size_t>(campaign.members);
  if (campaign.points.size() != rows * campaign.points_paths.size())
    throw std::logic_error("a table of points of another size than its members");
  return {campaign.points_paths,
          std::vector<double>(campaign.points.size(), std::numeric_limits<double>::quiet_NaN()),
          campaign.points};
}

}  // namespace

Samples sample(const Campaign& campaign) {
  if (campaign.method == Method::csv) return sample_csv(campaign);
  if (campaign.method == Method::table) return sample_table(campaign);
  const auto sampler = make_sampler(campaign);
  Samples samples;
  for (const auto& parameter : campaign.parameters) samples.paths.push_back(parameter.path);
  for (std::int64_t member = 0; member < campaign.members; ++member) {
    const auto point = sampler->point(member);
    samples.unit.insert(samples.unit.end(), point.begin(), point.end());
    for (std::size_t i = 0; i < point.size(); ++i)
      samples.physical.push_back(campaign.parameters[i].distribution.value(point[i]));
  }
  return samples;
}

Samples rows_of(const Samples& samples, std::span<const std::int64_t> members) {
  const std::size_t width = samples.paths.size();
  Samples rows{samples.paths, {}, {}};
  for (const auto member : members)
    for (std::size_t i = 0; i < width; ++i) {
      const auto at = static_cast<std::size_t>(member) * width + i;
      rows.unit.push_back(samples.unit[at]);
      rows.physical.push_back(samples.physical[at]);
    }
  return rows;
}

std::vector<Member> members(const Campaign& campaign, const Samples& samples) {
  const auto& table = campaign.scene.parameters;
  std::vector<std::size_t> columns;
  for (const auto& path : samples.paths) columns.push_back(static_cast<std::size_t>(table.index(path)));
  std::vector<Member> result;
  auto physical = samples.physical.begin();
  for (std::int64_t id = 0; id < campaign.members; ++id) {
    auto values = table.values();
    for (const auto column : columns) values[column] = *physical++;
    table.resolve(values);
    result.push_back({id, std::move(values)});
  }
  return result;
}

std::vector<Member> members(const Campaign& campaign) {
  return members(campaign, sample(campaign));
}

}  // namespace cohort
