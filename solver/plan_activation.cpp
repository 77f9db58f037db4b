#include "solver/plan_activation.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>
#include <stdexcept>

#include "solver/eikonal_activation.hpp"
#include "solver/heterogeneity.hpp"
#include "solver/reaction_eikonal.hpp"
#include "solver/stimulus.hpp"
#include "solver/template_ecg.hpp"

namespace cohort {

namespace {

// Whether the stimuli start one front, or one that comes again and again.
bool one_front(const Scene& scene, std::span<const double> values) {
  constexpr double beat_ms = 100;  // what starts later is another beat
  const std::vector<double> block = stimulus_block(scene, values);
  for (size_t k = 0; k < block.size(); k += stimulus_numbers) {
    const bool same_train = block[k + 2] == block[2] && (block[2] <= 0 || block[k + 3] == block[3]);
    const bool s2 = block[k + 12] > 0;
    if (!same_train || s2 || std::abs(block[k] - block[0]) > beat_ms) return false;
  }
  return true;
}

// Members that eikonal cannot activate: their number, and why the first of them.
std::pair<std::size_t, std::string> without_velocity(const Scene& scene, std::span<const Member> members) {
  const RegionParameters regions = region_parameters(scene);
  std::pair<std::size_t, std::string> result;
  for (const Member& member : members) {
    std::string why = EikonalActivation::without_velocity(scene, regions, member.values);
    if (!why.empty() && result.first++ == 0) result.second = std::move(why);
  }
  return result;
}

}  // namespace

std::string projection_refusal(const Scene& scene, const Member& base, std::span<const Member> members) {
  if (scene.ecg && scene.ecg->method == EcgRequest::Method::forward)
    return "activation: eikonal keeps no potentials, which outputs.ecg.method: forward needs";
  if (scene.stretch_activated)
    return "activation: eikonal has no potential on which electrophysiology.stretch_activated could act; "
           "reaction_eikonal, monodomain and bidomain have";
  std::string why = EikonalActivation::refusal(scene);
  if (why.empty()) why = TemplateEcg::refusal(scene);
  if (!why.empty()) return why;
  const std::span<const Member> all = members.empty() ? std::span(&base, 1) : members;
  const auto [number, reason] = without_velocity(scene, all);
  const bool asked_for = scene.activation_method == ActivationMethod::eikonal;
  return number == 0 || (asked_for && number < all.size()) ? std::string() : reason;
}

void choose_activation(Device& device, const Scene& scene, const Member& base,
                       std::span<const Member> members, double dx_mm, Plan& plan) {
  plan.activation = scene.activation_method;
  plan.activation_reason = "electrophysiology.activation";
  const auto sets = [&](const char* numbers) {
    const auto defaults = region_defaults(scene, numbers);
    const auto differs = [&](const Member& member) {
      return std::any_of(defaults.begin(), defaults.end(), [&](const std::pair<int, double>& own) {
        return member.values[static_cast<size_t>(own.first)] != own.second;
      });
    };
    return differs(base) || std::any_of(members.begin(), members.end(), differs);
  };
  // A conduction system acts through arrival times; where nothing but the ECG and activation times is asked
  // for, templates give them at a small part of the cost.
  if (scene.conduction_system && scene.activation_method == ActivationMethod::automatic) {
    const std::string why = projection_refusal(scene, base, members);
    plan.activation = why.empty() ? ActivationMethod::eikonal : ActivationMethod::reaction_eikonal;
    plan.activation_reason =
        why.empty() ? "the conduction system activates, and its outputs need no time loop" : why;
  }
  if (plan.activation == ActivationMethod::eikonal) {
    if (sets("conductivity_"))
      spdlog::warn(
          "conductivity_longitudinal_mS_per_mm and conductivity_transverse_mS_per_mm have no effect: eikonal "
          "takes velocities; electrophysiology.activation: reaction_eikonal takes both");
    // A velocity that is 0 in the scene is sampled: the first member that has one stands for all.
    const RegionParameters regions = region_parameters(scene);
    const auto has = [&](const Member& member) {
      return EikonalActivation::without_velocity(scene, regions, member.values).empty();
    };
    const auto sampled = has(base) ? members.end() : std::find_if(members.begin(), members.end(), has);
    const Member& shown = sampled == members.end() ? base : *sampled;
    const std::string whose = &shown == &base ? "" : " of member " + std::to_string(shown.id);
    if (const std::size_t number = without_velocity(scene, members).first; number > 0)
      spdlog::warn("{} of {} members have no conduction velocity in some region and will be rejected", number,
                   members.size());
    for (size_t r = 0; r < scene.regions.size(); ++r) {
      if (regions.slot[r] < 0) continue;
      const auto first =
          shown.values.begin() + regions.first + regions.slot[r] * regions.stride + regions.velocity_offset;
      plan.conduction.push_back({scene.regions[r].name + whose, first[0], first[1], 0, 0});
    }
    return;
  }
  Conduction conduction(device, scene.precision);
  double fewest = 1e9;  // cells that a front is wide
  std::string narrowest;
  bool conducts = true;
  const std::vector<RegionFront> fronts = region_fronts(conduction, scene, {&base, 1});
  for (const RegionFront& front : fronts) {
    const std::string& name = scene.regions[static_cast<size_t>(front.region)].name;
    if (!(front.front.speed > 0)) conducts = false;
    const double cells = std::min(front.width_along_mm, front.width_across_mm) / dx_mm;
    if (cells < fewest) {
      fewest = cells;
      narrowest = name;
    }
  }
  // Velocities of the equation that is solved: those that are set are for arrival times alone.
  const auto take_fronts = [&] {
    const bool arrivals = plan.activation == ActivationMethod::reaction_eikonal;
    for (const RegionFront& front : fronts)
      plan.conduction.push_back(
          {scene.regions[static_cast<size_t>(front.region)].name,
           arrivals && front.given_along > 0 ? front.given_along : front.along_mm_per_ms,
           arrivals && front.given_across > 0 ? front.given_across : front.across_mm_per_ms,
           front.width_along_mm, front.width_across_mm});
  };
  if (plan.activation == ActivationMethod::reaction_eikonal &&
      projection_refusal(scene, base, members).empty())
    plan.activation_reason += "; eikonal would give these outputs without a time loop";
  // Measured on cables (tests/verification/reaction_eikonal.cpp): of a front that is one and a half cells
  // wide the speed is up to a tenth too low, of half a cell a quarter to two fifths.
  constexpr double least_cells = 1.5;
  const auto text = [](double x) {
    std::ostringstream stream;
    stream << std::setprecision(2) << x;
    return stream.str();
  };
  const auto warn_of_resolution = [&] {
    const bool follows_arrivals = plan.activation == ActivationMethod::reaction_eikonal;
    if (!follows_arrivals && conducts && !scene.stimuli.empty() && fewest < least_cells)
      spdlog::warn(
          "{} on a grid too coarse for it: the front is {} cells of {} mm wide in region \"{}\" and should "
          "be {}; "
          "it will travel too slowly or not at all",
          method_name(plan.activation), text(fewest), text(dx_mm), narrowest, text(least_cells));
  };
  if (plan.activation != ActivationMethod::automatic) {
    warn_of_resolution();
    return take_fronts();
  }
  plan.activation = ActivationMethod::monodomain;
  const bool velocity_set = sets("velocity_");
  if (scene.stimuli.empty()) {
    plan.activation_reason = "nothing stimulates the tissue: no front to follow";
  } else if (!one_front(scene, base.values)) {
    plan.activation_reason = "the stimuli pace more than one front";
  } else if (!conducts) {
    plan.activation_reason = "a cable of these cells conducts no plane front";
  } else if (velocity_set) {
    plan.activation = ActivationMethod::reaction_eikonal;
    plan.activation_reason = "velocity_longitudinal_mm_per_ms or velocity_transverse_mm_per_ms is set";
  } else if (fewest >= least_cells) {
    plan.activation_reason = "the grid resolves the front: " + text(fewest) + " cells of " + text(dx_mm) +
                             " mm at least, in region \"" + narrowest + "\"";
  } else {
    plan.activation = ActivationMethod::reaction_eikonal;
    plan.activation_reason = "the grid is too coarse for the front, which is " + text(fewest) + " cells of " +
                             text(dx_mm) + " mm wide in region \"" + narrowest + "\"";
  }
  take_fronts();
  warn_of_resolution();
  if (plan.activation == ActivationMethod::monodomain && velocity_set)
    spdlog::warn(
        "velocity_longitudinal_mm_per_ms and velocity_transverse_mm_per_ms have no effect: the monodomain "
        "equation conducts by its conductivities; electrophysiology.activation: reaction_eikonal takes them");
}

}  // namespace cohort
