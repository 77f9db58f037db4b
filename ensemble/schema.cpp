#include "ensemble/schema.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <tuple>
#include <utility>

#include "ensemble/choose_checks.hpp"

namespace cohort {
namespace {

std::string prior(const Distribution& d) {
  switch (d.kind) {
    case Distribution::Kind::uniform:
      return fmt::format("uniform [{}, {}]", d.a, d.b);
    case Distribution::Kind::log_uniform:
      return fmt::format("log-uniform [{}, {}]", d.a, d.b);
    case Distribution::Kind::normal:
      return fmt::format("normal {} +- {} in [{}, {}]", d.a, d.b, d.lower, d.upper);
    case Distribution::Kind::choice:
      return fmt::format("choice {{{}}}", fmt::join(d.choices, ", "));
  }
  return "";
}

ParameterColumn column(const SampledParameter& sampled, const Parameter& parameter) {
  const auto& d = sampled.distribution;
  ParameterColumn result{parameter.path, parameter.unit, d.a, d.b, "linear", prior(d)};
  if (d.kind == Distribution::Kind::log_uniform) result.scale = "log";
  if (d.kind == Distribution::Kind::normal)
    std::tie(result.lower, result.upper) = std::pair(d.lower, d.upper);
  if (d.kind == Distribution::Kind::choice) {
    const auto [low, high] = std::minmax_element(d.choices.begin(), d.choices.end());
    std::tie(result.lower, result.upper) = std::pair(*low, *high);
  }
  return result;
}

}  // namespace

Schema make_schema(const Campaign& campaign, Samples samples, Layout layout, std::string program_version) {
  Schema schema;
  schema.campaign = campaign.text;
  schema.sha256 = campaign.sha256;
  schema.program_version = std::move(program_version);
  schema.seed = campaign.seed;
  schema.members = campaign.members;
  const auto& table = campaign.scene.parameters;
  if (campaign.method == Method::csv || campaign.method == Method::table) {
    const char* prior_name = campaign.method == Method::csv ? "csv" : "table";
    for (const auto& path : samples.paths) {
      const auto& parameter = table[table.index(path)];
      schema.parameters.push_back(
          {path, parameter.unit, parameter.lower, parameter.upper, "linear", prior_name});
    }
  } else {
    for (const auto& sampled : campaign.parameters)
      schema.parameters.push_back(column(sampled, table[table.index(sampled.path)]));
  }
  schema.error_order = error_order(campaign.scene);
  // Without a feature there is nothing to compare.
  if (!layout.features.empty())
    schema.checked = choose_checks(samples, campaign.members, check_count(campaign));
  schema.samples = std::move(samples);
  schema.layout = std::move(layout);
  schema.study = campaign.study;
  return schema;
}

double error_order(const Scene& scene) {
  return scene.geometry == GeometryKind::none ? 2 : 1;
}

Schema checks_schema(const Schema& schema) {
  Schema checks;
  checks.group = checks_group;
  checks.campaign = schema.campaign;
  checks.sha256 = schema.sha256;
  checks.program_version = schema.program_version;
  checks.seed = schema.seed;
  checks.members = std::ssize(schema.checked);
  checks.parameters = schema.parameters;
  checks.samples = rows_of(schema.samples, schema.checked);
  checks.layout.features = schema.layout.features;
  checks.layout.feature_units = schema.layout.feature_units;
  checks.member_of_check = schema.checked;
  checks.performance_slots = checks.kernels_per_slot = 0;
  return checks;
}

}  // namespace cohort
