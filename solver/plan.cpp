#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "solver/bidomain.hpp"
#include "solver/circulation.hpp"
#include "solver/eikonal_activation.hpp"
#include "solver/electromechanics.hpp"
#include "solver/forward_ecg.hpp"
#include "solver/heartbeat.hpp"
#include "solver/heterogeneity.hpp"
#include "solver/lead_weights.hpp"
#include "solver/mechanics.hpp"
#include "solver/monodomain.hpp"
#include "solver/plan_mechanics.hpp"
#include "solver/plan_memory.hpp"
#include "solver/plan_warnings.hpp"
#include "solver/probes.hpp"
#include "solver/pv_output.hpp"
#include "solver/reaction_eikonal.hpp"
#include "solver/recorder.hpp"
#include "solver/simulation.hpp"
#include "solver/stimulus.hpp"
#include "solver/template_ecg.hpp"
#include "solver/time_steps.hpp"

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

// Why the scene has no ECG without a time loop; empty where it can. A velocity that is sampled need not stand
// in the scene.
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

// Fronts of the scene's own values, and what activates the tissue where the scene leaves it open.
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

/// An S2 that every member has and none can get.
void check_second_stimuli(const Scene& scene, std::span<const Member> members, const Member& base) {
  if (scene.activation_method != ActivationMethod::reaction_eikonal) return;
  const std::span<const Member> all = members.empty() ? std::span(&base, 1) : members;
  for (const Stimulus& stimulus : scene.stimuli) {
    const std::string path = "stimuli." + stimulus.name + ".s2_interval_ms";
    const auto place = static_cast<size_t>(scene.parameters.index(path));
    const auto has = [&](const Member& member) { return member.values[place] > 0; };
    if (std::all_of(all.begin(), all.end(), has))
      throw std::invalid_argument(
          path +
          ": reaction_eikonal repeats one beat; electrophysiology.activation: monodomain "
          "paces freely, without a conduction system");
  }
}

// A defect of every member is a mistake of the scene; members of which only some have it are rejected.
void check_members(const Scene& scene, std::span<const Member> members, const Member& base,
                   std::string (*defect_of)(const Scene&, std::span<const double>)) {
  const std::span<const Member> all = members.empty() ? std::span(&base, 1) : members;
  std::size_t defective = 0;
  std::string why;
  for (const Member& member : all)
    if (const std::string defect = defect_of(scene, member.values); !defect.empty()) {
      if (defective == 0) why = defect;
      ++defective;
    }
  if (defective == all.size()) throw std::invalid_argument(why);
  if (defective > 0)
    spdlog::warn("{}, in {} of {} members: they will be rejected", why, defective, all.size());
}

// Places of the largest member's tissue, and no fewer than `least`.
std::int64_t largest_tissue(Launcher& launcher, const Scene& scene, const Grid& grid,
                            std::span<const Member> members, std::int64_t least) {
  std::int64_t most = least;
  for (const Member& large : largest_members(scene, members)) {
    const std::vector<std::byte> packed = pack(large.values, scene.precision);
    const cl::Buffer parameters = launcher.device().allocate(packed.size(), "parameters");
    launcher.queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());
    Tissue tissue(launcher, scene, grid, 1);
    tissue.build(parameters, 1);
    most = std::max(most, static_cast<std::int64_t>(tissue.stride));
  }
  return most;
}

void check_circulation(const Scene& scene, std::span<const Member> members, const Member& base) {
  if (!scene.circulation) return;
  if (scene.beats) {
    const double most = scene.parameters.value("time.beats.at_most");
    if (most != std::floor(most)) throw std::invalid_argument("time.beats.at_most is no whole number");
  }
  check_members(scene, members, base, circulation_defect);
}

}  // namespace

Plan make_plan(Device& device, const Scene& scene, std::span<const Member> members,
               const PlanOptions& options) {
  // The scene's own member: its tissue and its steps.
  Member base{0, scene.parameters.values()};
  scene.parameters.resolve(base.values);
  check_circulation(scene, members, base);
  check_members(scene, members, base, law_defect);
  if (scene.geometry == GeometryKind::none) return plan_circulation(device, scene, members, options);
  if (!excites(scene)) return plan_solid(device, scene, members, base, options);
  check_given_step(scene);
  const bool bidomain = scene.activation_method == ActivationMethod::bidomain;
  const bool forward = scene.ecg && scene.ecg->method == EcgRequest::Method::forward;
  if (forward && scene.torso == TorsoKind::unbounded)
    throw std::invalid_argument(
        "outputs.ecg.method: forward needs a torso with a skin, not an unbounded one");
  if (scene.activation_method == ActivationMethod::eikonal)
    if (const std::string why = projection_refusal(scene, base, members); !why.empty())
      throw std::invalid_argument("electrophysiology." + why);
  if (bidomain && scene.splitting == Splitting::godunov)
    throw std::invalid_argument(
        "electrophysiology.splitting: godunov is for the monodomain equation; the bidomain equations have "
        "strang");
  if (scene.conduction_system && (scene.activation_method == ActivationMethod::monodomain || bidomain))
    throw std::invalid_argument(
        "electrophysiology.conduction_system: its fast layer and delay act through arrival times, which the "
        "monodomain and bidomain equations do not have; set activation: reaction_eikonal (or eikonal), or "
        "leave the system out and pace with stimuli: {NAME: {site: sinoatrial_node}}, whose wave reaches the "
        "ventricles through region conduction_path");
  check_second_stimuli(scene, members, base);
  Plan plan{};
  const Grid grid = make_grid(scene, members);
  plan.cells = grid.cells;
  plan.origin_mm = grid.origin_mm;

  const std::size_t limit = options.memory_limit_bytes > 0
                                ? std::min(options.memory_limit_bytes, device.info().memory_bytes)
                                : device.info().memory_bytes;
  refuse_beyond(Tissue::bytes(grid, 1, 0, scene.precision), limit,
                "the grid of " + std::to_string(grid.size()) + " cells");

  const Definitions definitions = scene_definitions(scene, grid);
  Launcher launcher(device, scene.precision);
  const std::vector<std::byte> packed = pack(base.values, scene.precision);
  const cl::Buffer parameters = device.allocate(packed.size(), "parameters");
  launcher.queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());
  Tissue tissue(launcher, scene, grid, 1);
  tissue.build(parameters, 1);
  check_members(scene, members, base, layer_defect);
  check_members(scene, members, base, law_defect);
  warn_of_labels(scene);
  warn_of_protocol(scene, members, base);
  warn_of_probes(scene, tissue, base);
  plan.tissue_cells = static_cast<std::size_t>(tissue.tissue_cells[0]);
  plan.segments = static_cast<std::size_t>(tissue.stride / Tissue::lanes);
  for (size_t r = 0; r < scene.regions.size(); ++r)
    if (scene.regions[r].excitable && std::find(tissue.regions.begin(), tissue.regions.end(),
                                                static_cast<std::uint8_t>(r)) == tissue.regions.end())
      throw std::invalid_argument("region \"" + scene.regions[r].name + "\" holds no cell at grid.dx_mm " +
                                  std::to_string(grid.dx_mm));

  // A GPU is full with about two million cells, or twice as many where tissue deforms and small launches
  // are many; a CPU works through one heart at a time.
  const std::size_t cells_that_fill_a_gpu = scene.mechanics ? 4'000'000 : 2'000'000;
  constexpr int most_members = 64;
  // Each member's elliptic solve fills a device by itself.
  plan.members_per_device = options.members_per_device;
  if (plan.members_per_device <= 0 && (bidomain || forward)) plan.members_per_device = 1;
  if (plan.members_per_device <= 0) {
    const auto fitting = cells_that_fill_a_gpu / std::max<std::size_t>(plan.segments * Tissue::lanes, 1);
    plan.members_per_device = device.info().gpu ? std::clamp(static_cast<int>(fitting), 1, most_members) : 1;
  }
  if (!members.empty())
    plan.members_per_device = std::min(plan.members_per_device, static_cast<int>(members.size()));
  const int batch = plan.members_per_device;

  const std::int64_t largest_stride = largest_tissue(launcher, scene, grid, members, tissue.stride) * batch;
  const std::int64_t room = largest_stride + largest_stride / 16;  // fields keep some for the next batches
  std::int64_t conductor_room = 0;                                 // of tissue and bath
  std::optional<Tissue> conductor;
  if (bidomain) {
    conductor.emplace(launcher, scene, grid, 1, Tissue::Holds::conductors);
    conductor->build(parameters, 1);
    conductor_room = static_cast<std::int64_t>(conductor->stride) * batch;
    conductor_room += conductor_room / 16;
  }
  const auto module = [&](std::string name, bool runs, std::string reason, std::size_t bytes) {
    plan.modules.push_back({std::move(name), runs, std::move(reason), runs ? bytes : 0});
    plan.bytes += runs ? bytes : 0;
  };
  const bool heterogeneous = !scene.heterogeneity.parameters.empty();
  const bool labels = scene.geometry == GeometryKind::labels;
  const std::size_t real = real_bytes(scene.precision);
  constexpr std::size_t small_buffers = 24;  // of all modules, that are less than the least
  std::size_t geometry_bytes = Tissue::bytes(grid, batch, room, scene.precision) +
                               small_buffers * Device::least_bytes +
                               base.values.size() * static_cast<std::size_t>(batch) * real;
  if (heterogeneous || scene.conduction_system) {
    geometry_bytes += 4 * static_cast<std::size_t>(room) * real;
  }
  // Rows of fibres and coordinates from a label map, of one heart.
  if (labels) geometry_bytes += 8 * sizeof(float) * plan.segments * Tissue::lanes;
  module("geometry", true, "cells, regions, fractions and fibres of every member", geometry_bytes);
  const std::size_t before_cables = device.allocated_bytes();
  device.restart_peak();
  choose_activation(device, scene, base, members, grid.dx_mm, plan);
  const std::size_t for_cables = device.peak_bytes() - before_cables;
  if (scene.stimuli.empty() && !scene.conduction_system)
    spdlog::warn("nothing stimulates the tissue: there are neither stimuli nor a conduction system");
  if (scene.conduction_system && scene.conduction_system->kind == ConductionSystem::Kind::delay &&
      scene.conduction_system->early_sites.empty() && scene.stimuli.empty())
    spdlog::warn("the ventricles are never activated: every early site of the conduction system is off");
  const bool eikonal = plan.activation == ActivationMethod::eikonal;
  const bool triggers = plan.activation == ActivationMethod::reaction_eikonal;
  // Cables of fronts are run before the buffers of the eikonal solver are there, but in a batch after.
  std::size_t eikonal_bytes =
      eikonal ? EikonalActivation::bytes(scene, batch, room) : ReactionEikonal::bytes(scene, batch, room);
  if (triggers)
    eikonal_bytes = std::max(
        eikonal_bytes,
        eikonal_bytes + for_cables -
            (members.size() > static_cast<std::size_t>(batch) ? 0 : Eikonal::bytes(room, scene.precision)));
  module("eikonal", eikonal || triggers,
         eikonal || triggers ? plan.activation_reason
                             : method_name(plan.activation) + ": " + plan.activation_reason,
         eikonal_bytes);
  module("templates", eikonal && scene.ecg,
         !eikonal     ? "the time loop has the potential"
         : !scene.ecg ? "no ECG is asked for"
                      : "outputs.ecg: action potentials behind the arrival times, without a time loop",
         scene.ecg ? TemplateEcg::bytes(device, scene, batch, room) : 0);
  module("monodomain", !eikonal,
         eikonal    ? "no time loop"
         : triggers ? "potential of the tissue"
         : bidomain ? "cells and intracellular operator of the bidomain equations"
                    : "activation and potential of the tissue",
         Monodomain::bytes(scene, members.empty() ? std::span(&base, 1) : members, batch, room));
  module("diffusion", !eikonal || scene.ecg,
         !eikonal || scene.ecg ? "stencils of the tissue's conductivities"
                               : "neither a time loop nor an ECG needs one",
         Diffusion::scratch_bytes(std::max(room, conductor_room), scene.precision));
  module("bidomain", bidomain,
         bidomain ? "electrophysiology.activation: extracellular potential of tissue and bath"
                  : "the monodomain equation has no extracellular potential",
         bidomain ? Bidomain::bytes(device, *conductor, batch, room, conductor_room, scene.precision) : 0);
  if (forward) {
    const Torso torso(device, scene, 1);
    module("torso", true, "outputs.ecg: a solve at every sample",
           ForwardEcg::bytes(room, scene.precision) +
               static_cast<std::size_t>(batch) * torso.bytes(base.values));
  } else if (scene.ecg) {
    const Torso torso(device, scene);
    module("torso", true, "outputs.ecg: lead fields and weights",
           LeadWeights::bytes(room, scene.precision) + torso.bytes(base.values));
  } else {
    module("torso", false, "no ECG is asked for", 0);
  }
  module("recorder", !eikonal,
         eikonal     ? "no time loop to sample"
         : scene.ecg ? "samples of the leads, checks"
                     : "checks",
         Recorder::bytes(scene, batch, Recorder::samples_per_fetch, room));
  module("activation times", scene.activation.has_value(),
         scene.activation ? "outputs.activation" : "no activation times are asked for",
         activation_fields(scene) > 1 ? Probes::bytes(scene, batch, samples_of(scene) + 1) : 0);
  const SolidPlan solid = add_mechanics(launcher, scene, members, base, batch, plan);
  const std::string whole_batch =
      "a batch of " + std::to_string(batch) + (batch == 1 ? " member" : " members");
  refuse_beyond(plan.bytes, limit, whole_batch);

  if (eikonal) {
    if (scene.mechanics) {
      plan.dt_ms = solid.dt_ms;
      plan.steps = solid.steps;
    }
    return plan;
  }
  tissue.build_fibres(parameters);
  if (heterogeneous) tissue.build_coordinates(parameters);
  Diffusion diffusion(launcher, scene, definitions);
  Monodomain monodomain(launcher, scene, definitions, 1);
  monodomain.assemble(tissue, diffusion, parameters, {&base, 1});
  warn_of_stimuli(scene, monodomain);
  const TimeSteps steps =
      choose_steps(scene, monodomain.fastest_rate()[0], monodomain.diffusion_limit_ms()[0],
                   scene.parameters.value("time.step_factor"));
  const double bound = reaction_limit_ms(monodomain.fastest_rate()[0]);
  if (steps.dt_ms > 0.5 * bound)
    spdlog::warn("time.dt_ms {} is more than half of what the cell model's fastest rate bears ({} ms)",
                 steps.dt_ms, bound);
  if (steps.substeps > 1) {  // the potential that a step started from
    const std::size_t bytes = static_cast<std::size_t>(room) * real;
    for (PlannedModule& planned : plan.modules)
      if (planned.name == "monodomain") planned.bytes += bytes;
    plan.bytes += bytes;
    refuse_beyond(plan.bytes, limit, whole_batch);
  }
  plan.dt_ms = steps.dt_ms;
  plan.steps = static_cast<int>(std::lround(recorded_ms(scene) / steps.dt_ms));
  return plan;
}

}  // namespace cohort
