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
#include "solver/plan_activation.hpp"
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

void check_circulation(const Scene& scene, std::span<const Member> members, const Member& base) {
  if (!scene.circulation) return;
  if (scene.beats) {
    const double most = scene.parameters.value("time.beats.at_most");
    if (most != std::floor(most)) throw std::invalid_argument("time.beats.at_most is no whole number");
  }
  check_members(scene, members, base, circulation_defect);
}

/// Options with fewer members, where a batch that was chosen by size is too large for the memory: a share of
/// what fits in proportion, as some of the memory is the batch's whatever its size.
std::optional<PlanOptions> fewer_members(const Plan& plan, std::size_t limit, const PlanOptions& options) {
  if (plan.bytes <= limit || plan.members_per_device <= 1 || options.members_per_device > 0) return {};
  PlanOptions fewer = options;
  constexpr double of_proportion = 0.9, most = 0.8;
  const double share =
      std::min(of_proportion * static_cast<double>(limit) / static_cast<double>(plan.bytes), most);
  fewer.most_members = std::max(static_cast<int>(share * plan.members_per_device), 1);
  return fewer;
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

  // A GPU is full with about two million cells, or twice as many, of the mechanics' grid, where tissue
  // deforms and small launches are many; a CPU works through one heart at a time.
  const double cells_that_fill_a_gpu = scene.mechanics ? 4e6 : 2e6;
  constexpr int most_members = 64;
  // Each member's elliptic solve fills a device by itself.
  plan.members_per_device = options.members_per_device;
  if (plan.members_per_device <= 0 && (bidomain || forward)) plan.members_per_device = 1;
  if (plan.members_per_device <= 0) {
    double cells = static_cast<double>(std::max<std::size_t>(plan.segments * Tissue::lanes, 1));
    if (scene.mechanics) cells *= std::pow(grid.dx_mm / solid_dx_mm(scene), 3);
    const double fitting = std::min(cells_that_fill_a_gpu / cells, double{most_members});
    plan.members_per_device = device.info().gpu ? std::max(static_cast<int>(fitting), 1) : 1;
    if (options.most_members > 0)
      plan.members_per_device = std::min(plan.members_per_device, options.most_members);
  }
  if (!members.empty())
    plan.members_per_device = std::min(plan.members_per_device, static_cast<int>(members.size()));
  const int batch = plan.members_per_device;

  const std::int64_t places = places_of_batch(launcher, scene, grid, members, batch, tissue.stride);
  const std::int64_t room = places + places / 16;  // fields keep some for the next batches
  std::int64_t conductor_room = 0;                 // of tissue and bath
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
  if (const auto fewer = fewer_members(plan, limit, options))
    return make_plan(device, scene, members, *fewer);
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
    spdlog::warn("steps of {:.4g} ms are {} what the cell model's fastest rate bears ({:.4g} ms)",
                 steps.dt_ms, steps.dt_ms > bound ? "beyond" : "more than half of", bound);
  if (steps.substeps > 1) {  // the potential that a step started from
    const std::size_t bytes = static_cast<std::size_t>(room) * real;
    for (PlannedModule& planned : plan.modules)
      if (planned.name == "monodomain") planned.bytes += bytes;
    plan.bytes += bytes;
    if (const auto fewer = fewer_members(plan, limit, options))
      return make_plan(device, scene, members, *fewer);
    refuse_beyond(plan.bytes, limit, whole_batch);
  }
  plan.dt_ms = steps.dt_ms;
  plan.steps = static_cast<int>(std::lround(recorded_ms(scene) / steps.dt_ms));
  return plan;
}

}  // namespace cohort
