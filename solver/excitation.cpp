#include "solver/excitation.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <stdexcept>

#include "solver/electromechanics.hpp"
#include "solver/heterogeneity.hpp"
#include "solver/mechanics.hpp"

namespace cohort {

Excitation::Excitation(Launcher& launcher_, const Scene& scene_, const Plan& plan)
    : scene(scene_),
      launcher(launcher_),
      grid{plan.cells, plan.origin_mm, scene_.parameters.value("grid.dx_mm")},
      definitions(scene_definitions(scene_, grid)),
      tissue(launcher, scene_, grid, plan.members_per_device),
      diffusion(launcher, scene_, definitions),
      monodomain(launcher, scene_, definitions, plan.members_per_device),
      recorder(launcher, scene_, definitions, plan.members_per_device, Recorder::samples_per_fetch),
      writer(scene_, recorder.quantities()),
      coupled(Electromechanics::wanted(scene_, plan.activation)) {
  if (plan.activation == ActivationMethod::eikonal) {
    eikonal.emplace(launcher, scene, definitions, plan.members_per_device);
    if (scene.ecg) templates.emplace(launcher, scene, definitions, plan.members_per_device);
  }
  if (plan.activation == ActivationMethod::reaction_eikonal)
    reaction_eikonal.emplace(launcher, scene, definitions, plan.members_per_device);
  if (activation_fields(scene) > 1)
    probes.emplace(launcher, scene, definitions, plan.members_per_device, samples_of(scene) + 1);
  if (scene.activation_method == ActivationMethod::bidomain)
    bidomain.emplace(launcher, scene, definitions, grid, plan.members_per_device);
  if (scene.ecg && scene.ecg->method == EcgRequest::Method::forward)
    forward.emplace(launcher, scene, definitions);
  else if (scene.ecg)
    lead_weights.emplace(launcher, scene, definitions, plan.members_per_device);
  parameters =
      launcher.device().allocate(static_cast<std::size_t>(plan.members_per_device * scene.parameters.size()) *
                                     real_bytes(scene.precision),
                                 "parameters");
}

void Excitation::prepare(std::span<const Member> members) {
  std::vector<double> values;
  for (const Member& member : members)
    values.insert(values.end(), member.values.begin(), member.values.end());
  const std::vector<std::byte> packed = pack(values, scene.precision);
  launcher.queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());
  tissue.build(parameters, static_cast<int>(members.size()));
  tissue.build_fibres(parameters);
  if (scene.conduction_system || !scene.heterogeneity.parameters.empty())
    tissue.build_coordinates(parameters);
  if (eikonal)
    eikonal->assemble(tissue, parameters, members);
  else
    monodomain.assemble(tissue, diffusion, parameters, members);
  if (bidomain) bidomain->assemble(tissue, diffusion, monodomain, parameters, members);
  if (reaction_eikonal) reaction_eikonal->assemble(tissue, monodomain, parameters, members);
  if (lead_weights) lead_weights->assemble(tissue, diffusion, parameters, members);
  if (lead_weights) weights_left = recorder.weights_left(tissue, lead_weights->weights());
  if (forward) forward->assemble(tissue, diffusion, parameters, members);
}

// Of the weights' magnitudes; rounding leaves 1e-8 (solver/README.md, checks).
constexpr double weights_tolerance = 1e-4;

// Every so many segments of tissue are asked whether they lie in the torso: enough to find a misplaced heart.
constexpr std::size_t segments_to_a_probe = 8;

bool Excitation::in_torso(std::size_t m, const Member& member) {
  if (!scene.ecg) return true;
  const Pose pose = heart_pose(scene.parameters, member.values);
  std::vector<Point> places;
  const auto begin =
      static_cast<std::size_t>(Tissue::first_cell_place + tissue.first_block[m] * Tissue::block_cells);
  const auto end =
      static_cast<std::size_t>(Tissue::first_cell_place + tissue.first_block[m + 1] * Tissue::block_cells);
  for (std::size_t i = begin; i < end; i += Tissue::lanes * segments_to_a_probe) {
    std::size_t cell = i;
    while (cell < i + Tissue::lanes && tissue.regions[cell] == 255) ++cell;
    if (cell == i + Tissue::lanes) continue;
    const std::array<double, 3> centre = tissue.centre(cell);
    places.push_back(pose({centre[0], centre[1], centre[2]}));
  }
  const Torso& torso = lead_weights ? lead_weights->torso() : forward->torso(m);
  return torso.holds(places, member.values);
}

std::string Excitation::defect(std::size_t m, const Member& member) {
  if (tissue.touches_boundary[m] || (bidomain && bidomain->conductor().touches_boundary[m]))
    return "the tissue leaves the grid";
  std::vector<bool> present(scene.regions.size(), false);
  std::uint8_t stimulated = 0;
  const auto begin =
      static_cast<std::size_t>(Tissue::first_cell_place + tissue.first_block[m] * Tissue::block_cells);
  const auto end =
      static_cast<std::size_t>(Tissue::first_cell_place + tissue.first_block[m + 1] * Tissue::block_cells);
  for (std::size_t i = begin; i < end; ++i) {
    if (tissue.regions[i] != 255) present[tissue.regions[i]] = true;
    if (!eikonal) stimulated |= monodomain.stimulated_by()[i];
  }
  for (size_t r = 0; r < present.size(); ++r)
    if (scene.regions[r].excitable && !present[r])
      return "region \"" + scene.regions[r].name + "\" holds no cell";
  for (size_t k = 0; k < scene.stimuli.size(); ++k)
    if (!(stimulated >> k & 1)) return "stimulus \"" + scene.stimuli[k].name + "\" reaches no tissue";
  if (const std::string why = layer_defect(scene, member.values); !why.empty()) return why;
  if (const std::string why = law_defect(scene, member.values); !why.empty()) return why;
  if (eikonal && !eikonal->defect(m).empty()) return eikonal->defect(m);
  if (reaction_eikonal) {
    const std::string reason = reaction_eikonal->defect(tissue, monodomain, m, member);
    if (!reason.empty()) return reason;
  }
  if (!in_torso(m, member)) return "the heart does not lie inside the torso";
  if (lead_weights) spdlog::debug("member {}: weights left {:.2g}", member.id, weights_left[m]);
  if (lead_weights && !(weights_left[m] < weights_tolerance))
    return fmt::format(
        "the lead fields are not in balance: the weights of a lead sum up to {:.2g} of their "
        "magnitudes, so that tissue at rest has an ECG",
        weights_left[m]);
  return {};
}

void Excitation::run(std::span<const Member> members, std::span<Recording> recordings,
                     Clock::time_point start, double timeout_s, const Beat& beat) {
  // Members whose steps differ run after each other, so that each one's steps are its own.
  struct Group {
    TimeSteps steps;
    std::vector<Member> members;
    std::vector<Recording*> recordings;
  };
  std::vector<Group> groups;
  const auto factor = static_cast<std::size_t>(scene.parameters.index("time.step_factor"));
  for (size_t m = 0; m < members.size(); ++m) {
    std::string reason = defect(m, members[m]);
    TimeSteps steps{};
    if (reason.empty() && !eikonal) {
      try {
        steps = choose_steps(scene, monodomain.fastest_rate()[m], monodomain.diffusion_limit_ms()[m],
                             members[m].values[factor]);
      } catch (const std::runtime_error& error) {
        reason = error.what();
      }
    }
    if (!reason.empty()) {
      reject(recordings[m], reason);
      continue;
    }
    if (const double limit = eikonal ? 0 : reaction_limit_ms(monodomain.fastest_rate()[m]);
        !eikonal && steps.dt_ms > limit) {
      end_unstable(
          recordings[m], 0,
          fmt::format("the reaction's step of {:.4g} ms is beyond the limit of {:.4g} ms of its fastest "
                      "rate, at 0 ms",
                      steps.dt_ms, limit));
      continue;
    }
    for (const std::string& probe : probes_outside(scene, tissue, m, members[m].values))
      spdlog::warn("member {}: probe \"{}\" lies outside the tissue and reads NaN", members[m].id, probe);
    if (eikonal) continue;
    auto group = std::find_if(groups.begin(), groups.end(), [&](const Group& g) { return g.steps == steps; });
    if (group == groups.end()) group = groups.insert(groups.end(), Group{steps, {}, {}});
    group->members.push_back(members[m]);
    group->recordings.push_back(&recordings[m]);
  }
  const double setup_s = seconds_since(start) / static_cast<double>(members.size());
  for (Recording& recording : recordings) recording.setup_s = setup_s;
  for (Group& group : groups) {
    if (group.members.size() != members.size()) prepare(group.members);
    if (!coupled) march(group.steps, group.members, group.recordings, timeout_s);
    if (beat) beat(group.members, group.recordings, group.steps);
  }
  if (eikonal) {
    std::vector<Recording*> all;
    for (Recording& recording : recordings) all.push_back(&recording);
    launcher.profile(batches == 1);
    project(members, all);
    launcher.profile(false);
    if (beat) beat(members, all, {});
  }
  ++batches;
}

}  // namespace cohort
