#include "solver/plan_warnings.hpp"

#include <spdlog/spdlog.h>

#include <map>
#include <string>

#include "solver/labels.hpp"
#include "solver/probes.hpp"
#include "solver/stimulus.hpp"

namespace cohort {

void warn_of_protocol(const Scene& scene, std::span<const Member> members, const Member& base) {
  const std::span<const Member> all = members.empty() ? std::span(&base, 1) : members;
  std::map<std::string, std::size_t> warnings;
  for (const Member& member : all)
    for (const std::string& warning : stimulus_warnings(scene, member.values)) ++warnings[warning];
  for (const auto& [warning, count] : warnings) {
    if (count == all.size())
      spdlog::warn("{}", warning);
    else
      spdlog::warn("{}, in {} of {} members", warning, count, all.size());
  }
}

void warn_of_labels(const Scene& scene) {
  if (!scene.labels || scene.labels->convention != "cohort" || !scene.labels->sites.empty()) return;
  if (scene.labels->has("ra"))
    spdlog::warn(
        "the label map names no sites (the extension of its header, in which exports keep sinoatrial_node "
        "and "
        "av_node, is gone): they are found from the labels, and the heart's times shift by some ms");
}

void warn_of_probes(const Scene& scene, const Tissue& tissue, const Member& base) {
  for (const std::string& probe : probes_outside(scene, tissue, 0, base.values))
    spdlog::warn("probe \"{}\" lies outside the tissue of the scene's own values: what it reads is undefined",
                 probe);
}

void warn_of_stimuli(const Scene& scene, const Monodomain& monodomain) {
  unsigned reached = 0;
  for (const std::uint8_t stimuli : monodomain.stimulated_by()) reached |= stimuli;
  for (size_t k = 0; k < scene.stimuli.size(); ++k)
    if (!(reached >> k & 1))
      spdlog::warn(
          "stimulus \"{}\" lies outside the tissue of the scene's own values: members like it are rejected",
          scene.stimuli[k].name);
}

}  // namespace cohort
