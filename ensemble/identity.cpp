#include "ensemble/identity.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <cmath>

#include "ensemble/choose_checks.hpp"
#include "solver/labels.hpp"

// Enumerators are written as words, so that a new one in their midst leaves the identity of stores as it is.
namespace cohort {

namespace {

template <typename Enum, size_t N>
const char* word(Enum value, const char* const (&words)[N]) {
  return words[static_cast<size_t>(value)];
}

std::string number(double value) {
  return std::isnan(value) ? "inherited" : fmt::format("{:.17g}", value);
}

std::string list(const std::vector<double>& values) {
  std::vector<std::string> numbers;
  for (const double value : values) numbers.push_back(number(value));
  return fmt::format("[{}]", fmt::join(numbers, " "));
}

std::string geometry(const Scene& scene) {
  std::string text =
      fmt::format("geometry {}\n", word(scene.geometry, {"none", "box", "shapes", "heart", "labels"}));
  for (const Shape& shape : scene.shapes)
    text += fmt::format("shape {} {} [{}]\n", shape.name,
                        word(shape.kind, {"box", "ellipsoid", "cylinder", "cone", "capsule", "half_space",
                                          "union", "intersection", "subtract", "smooth_union", "shell"}),
                        fmt::join(shape.operands, " "));
  if (scene.labels) {
    const LabelHeart& heart = *scene.labels;
    text += fmt::format("labels sha256 {} convention \"{}\" frame {}\n", heart.sha256, heart.convention,
                        word(heart.frame, {"image", "heart"}));
    for (const auto& [value, meaning] : heart.table) text += fmt::format("label {} {}\n", value, meaning);
  }
  for (const Region& region : scene.regions)
    text += fmt::format("region {} shape \"{}\" {} fibres {}\n", region.name, region.shape,
                        region.excitable ? "excitable"
                        : region.bath    ? "bath"
                                         : "insulating",
                        word(region.fibres, {"none", "constant", "transmural"}));
  return text;
}

std::string physics(const Scene& scene) {
  std::string text = fmt::format("cell_model {}\nprecision {}\n", scene.cell_model,
                                 word(scene.precision, {"single", "double"}));
  text += fmt::format("activation by {}\n", method_name(scene.activation_method));
  for (const auto& [region, model] : scene.region_cell_models)
    text += fmt::format("cell_model {} in {}\n", model, region);
  if (!scene.heterogeneity.parameters.empty())
    text += fmt::format("heterogeneity [{}] in [{}]\n", fmt::join(scene.heterogeneity.parameters, " "),
                        fmt::join(scene.heterogeneity.regions, " "));
  if (scene.conduction_system) {
    text += fmt::format("conduction system {}\n", word(scene.conduction_system->kind, {"delay", "path"}));
    for (const ConductionSystem::EarlySite& site : scene.conduction_system->early_sites)
      text += fmt::format("early site {} {}\n", site.name,
                          word(site.surface, {"lv", "rv_septum", "rv_free_wall"}));
  }
  if (scene.splitting == Splitting::godunov) text += "splitting godunov\n";
  if (scene.stretch_activated) text += "stretch-activated current\n";
  for (const Stimulus& stimulus : scene.stimuli)
    text += fmt::format("stimulus {} {} \"{}\"\n", stimulus.name,
                        word(stimulus.kind, {"box", "sphere", "site"}), stimulus.site);
  return text;
}

std::string loads(const Scene& scene) {
  std::string text;
  if (scene.mechanics) {
    const Mechanics& mechanics = *scene.mechanics;
    text += fmt::format("mechanics law {} tension \"{}\"{}\n", mechanics.law, mechanics.tension,
                        mechanics.quasi_static ? " quasi-static" : "");
    for (const Mechanics::Cavity& cavity : mechanics.cavities)
      text += fmt::format("cavity {} \"{}\"{}\n", cavity.name, cavity.shape,
                          word(cavity.pressure, {"", " bestel"}));
    for (const Mechanics::Boundary& condition : mechanics.boundary)
      text += fmt::format("boundary {} of {} {}\n", condition.name, condition.surface,
                          word(condition.kind, {"clamp", "clamp normal", "spring", "spring normal"}));
  }
  if (scene.circulation)
    text += fmt::format("circulation {}\n", word(scene.circulation->kind, {"closed_loop", "windkessel"}));
  if (scene.beats) text += "beats\n";
  return text;
}

/// The torso stands with the ECG, the only output that needs one.
std::string outputs(const Scene& scene) {
  std::string text;
  if (scene.ecg)
    text += fmt::format("ecg torso {}{}\n", word(scene.torso, {"box", "ellipsoid", "cylinder", "unbounded"}),
                        word(scene.ecg->method, {"", " forward"}));
  if (scene.activation)
    text += fmt::format("activation [{}]{}\n", fmt::join(scene.activation->probes, " "),
                        scene.activation->beats ? " beats" : "");
  if (scene.pv) text += "pv\n";
  if (scene.displacement)
    text += fmt::format("displacement [{}]\n", fmt::join(scene.displacement->points, " "));
  return text;
}

std::string sampled(const SampledParameter& parameter) {
  const Distribution& d = parameter.distribution;
  return fmt::format("sampled {} {} {} {}\n", parameter.path,
                     word(d.kind, {"uniform", "log_uniform", "normal", "choice"}),
                     list({d.a, d.b, d.lower, d.upper}), list(d.choices));
}

}  // namespace

std::string structure_text(const Scene& scene) {
  return geometry(scene) + physics(scene) + loads(scene);
}

std::string canonical_text(const Campaign& campaign) {
  const Scene& scene = campaign.scene;
  std::string text = structure_text(scene) + outputs(scene);
  for (const Parameter& parameter : scene.parameters.all())
    text += fmt::format("{}={}\n", parameter.path, number(parameter.value));
  for (const SampledParameter& parameter : campaign.parameters) text += sampled(parameter);
  text +=
      fmt::format("method {} members {} seed {}\n",
                  word(campaign.method, {"sobol", "latin_hypercube", "grid", "monte_carlo", "csv", "table"}),
                  campaign.members, campaign.seed);
  if (const auto checks = check_count(campaign); checks > 0) text += fmt::format("checks {}\n", checks);
  if (!campaign.points_sha256.empty()) text += fmt::format("points {}\n", campaign.points_sha256);
  return text;
}

}  // namespace cohort
