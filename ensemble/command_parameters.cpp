#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "ensemble/commands.hpp"
#include "ensemble/config.hpp"
#include "ensemble/key_reference.hpp"
#include "ensemble/table.hpp"
#include "solver/mechanics_structure.hpp"

namespace cohort {

namespace {

/// A scene with every kind of parameter that needs no name of the user's.
Campaign example() {
  Campaign campaign;
  campaign.scene.geometry = GeometryKind::heart;
  campaign.scene.ecg.emplace();
  campaign.scene.activation.emplace();
  campaign.scene.pv.emplace();
  campaign.scene.mechanics = default_heart_mechanics();
  campaign.scene.circulation.emplace();
  declare_parameters(campaign.scene);
  return campaign;
}

std::string prior(const Distribution& distribution) {
  switch (distribution.kind) {
    case Distribution::Kind::uniform:
      return fmt::format("uniform [{}, {}]", distribution.a, distribution.b);
    case Distribution::Kind::log_uniform:
      return fmt::format("log_uniform [{}, {}]", distribution.a, distribution.b);
    case Distribution::Kind::normal:
      return fmt::format("normal [{}, {}]", distribution.a, distribution.b);
    case Distribution::Kind::choice:
      return fmt::format("choice [{}]", fmt::join(distribution.choices, ", "));
  }
  return {};
}

std::string value_of(const Parameter& parameter, const Campaign& campaign) {
  const auto sampled =
      std::find_if(campaign.parameters.begin(), campaign.parameters.end(),
                   [&](const SampledParameter& candidate) { return candidate.path == parameter.path; });
  if (sampled != campaign.parameters.end()) return prior(sampled->distribution);
  if (std::isnan(parameter.value) && !parameter.inherits.empty())
    return parameter.inherits_factor == 1
               ? "inherits"
               : fmt::format("{} {}", parameter.inherits_factor, parameter.inherits);
  return fmt::format("{}", parameter.value);
}

}  // namespace

ExitCode command_parameters(const CampaignOptions& options) {
  const Campaign campaign = options.file.empty() ? example() : read_campaign(options.file, options.overrides);
  TextTable table(
      {Align::left, Align::left, Align::right, Align::left, Align::left, Align::left, Align::left});
  table.add(
      {"path", "unit", options.file.empty() ? "default" : "value", "range", "sampled", "meaning", "source"});
  for (const Parameter& parameter : campaign.scene.parameters.all())
    table.add({parameter.path, parameter.unit, value_of(parameter, campaign),
               fmt::format("[{}, {}]", parameter.lower, parameter.upper),
               parameter.structural ? "never" : "may be", parameter.meaning, parameter.source});
  std::fputs(table.text().c_str(), stdout);
  return ExitCode::done;
}

ExitCode command_keys() {
  std::fputs(key_reference().c_str(), stdout);
  return ExitCode::done;
}

}  // namespace cohort
