#include "solver/plan_mechanics.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "solver/circulation.hpp"
#include "solver/electromechanics.hpp"
#include "solver/heartbeat.hpp"
#include "solver/mechanics.hpp"
#include "solver/new_buffer.hpp"
#include "solver/plan_memory.hpp"
#include "solver/precision.hpp"
#include "solver/solid_points.hpp"
#include "solver/solid_walls.hpp"
#include "solver/tension_drive.hpp"

namespace cohort {

namespace {

// Of one member: of the scene's own, which `solid` has built, or of the largest.
std::size_t bytes_of_member(Solid& solid, Launcher& launcher, const Scene& scene,
                            std::span<const Member> members) {
  std::size_t most = solid.bytes();
  const std::vector<Member> largest = largest_members(scene, members);
  for (const Member& large : largest) {
    const std::vector<std::byte> packed = pack(large.values, scene.precision);
    const cl::Buffer parameters = launcher.device().allocate(packed.size(), "parameters");
    launcher.queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());
    solid.build(parameters, {&large, 1});
    if (solid.defect(0).empty()) most = std::max(most, solid.bytes());
  }
  if (members.size() > 1 && !largest.empty()) most += most / 64;  // there may be a larger one
  return most;
}

}  // namespace

void refuse_beyond(std::size_t needed, std::size_t limit, const std::string& what) {
  if (needed <= limit) return;
  throw std::runtime_error("too little device memory: " + what + " needs " + std::to_string(needed) +
                           " bytes, and there are " + std::to_string(limit) + " bytes");
}

std::size_t memory_limit(const Device& device, const PlanOptions& options) {
  const std::size_t memory = device.info().memory_bytes;
  return options.memory_limit_bytes > 0 ? std::min(options.memory_limit_bytes, memory) : memory;
}

void warn_of_solid(const Scene& scene, const Solid& solid) {
  // Not refused: loads in balance with themselves move nothing, and free tissue may be what is wanted.
  if (const int free = solid.free_motions(0); free > 0)
    spdlog::warn(
        "mechanics.boundary: no clamp and no spring resists {} of the six rigid motions of the tissue: what "
        "does not balance its loads moves it away",
        free);
  if (const int duration = scene.parameters.find("mechanics." + scene.mechanics->tension + ".duration_ms");
      scene.circulation && duration >= 0 &&
      scene.parameters.values()[static_cast<std::size_t>(duration)] >= beat_ms(scene))
    spdlog::warn(
        "mechanics.{}.duration_ms: {} ms is no shorter than a beat of {} ms: walls hardly rest, and chambers "
        "hardly "
        "fill",
        scene.mechanics->tension, scene.parameters.values()[static_cast<std::size_t>(duration)],
        beat_ms(scene));
  const auto& cavities = scene.mechanics->cavities;
  for (std::size_t q = 0; q < cavities.size(); ++q) {
    constexpr double enough = 1.5;  // the default heart at 2 mm has 1.9 and differs from 1 mm by 1 %
    const double cells = thin_wall_cells(solid.mesh(), solid.grid(), cavities.size(), 0, q);
    const bool atrium = cavities[q].name == "la" || cavities[q].name == "ra";
    if (cells < enough)
      spdlog::warn(
          "mechanics.cavities.{}: a quarter of the wall is thinner than {:.1f} cells ({:.1f} mm at {} mm): "
          "{}; make mechanics.dx_mm or grid.dx_mm smaller",
          cavities[q].name, cells, cells * solid.grid().dx_mm, solid.grid().dx_mm,
          atrium ? "at 0.65 cells the default left atrium gains a fifth too little volume under 9 mmHg, at "
                   "1.3 cells 7 %"
          : cavities[q].name == "rv"
              ? "at 1.0 cells the default right ventricle's smallest volume is 7 % too large"
              : "it is too stiff across");
  }
}

// A scene without tissue.
Plan plan_circulation(Device& device, const Scene& scene, std::span<const Member> members,
                      const PlanOptions& options) {
  Plan plan{};
  // A work-item is a member: some for each core, or enough to hide a GPU's latency.
  constexpr int on_gpu = 4096, on_cpu = 64;
  plan.members_per_device = options.members_per_device > 0 ? options.members_per_device
                            : device.info().gpu            ? on_gpu
                                                           : on_cpu;
  if (!members.empty())
    plan.members_per_device = std::min(plan.members_per_device, static_cast<int>(members.size()));
  plan.bytes = Heartbeat::bytes(scene, plan.members_per_device) + 4 * Device::least_bytes;
  for (const char* name : {"geometry", "eikonal", "templates", "monodomain", "diffusion", "bidomain", "torso",
                           "recorder", "activation times", "mechanics"})
    plan.modules.push_back({name, false, "there is no tissue", 0});
  plan.modules.push_back(
      {"circulation", true,
       scene.pv ? "outputs.pv: all chambers are elastances" : "all chambers are elastances", plan.bytes});
  plan.modules.push_back({"fluid", false, "no flow output is asked for", 0});
  const std::size_t limit = options.memory_limit_bytes > 0
                                ? std::min(options.memory_limit_bytes, device.info().memory_bytes)
                                : device.info().memory_bytes;
  refuse_beyond(plan.bytes, limit, "a batch of " + std::to_string(plan.members_per_device) + " members");
  const double length_ms =
      scene.beats ? most_beats(scene) * beat_ms(scene) : scene.parameters.value("time.end_ms");
  plan.dt_ms = scene.parameters.value("circulation.dt_ms") * scene.parameters.value("time.step_factor");
  plan.steps = static_cast<int>(std::ceil(length_ms / plan.dt_ms));
  return plan;
}

Plan plan_solid(Device& device, const Scene& scene, std::span<const Member> members, const Member& base,
                const PlanOptions& options) {
  Plan plan{};
  plan.activation_reason = "nothing is excited";
  const Grid grid = make_grid(scene, members);
  plan.cells = grid.cells;
  plan.origin_mm = grid.origin_mm;
  plan.members_per_device = options.members_per_device > 0 ? options.members_per_device : 1;
  if (!members.empty())
    plan.members_per_device = std::min(plan.members_per_device, static_cast<int>(members.size()));
  for (const char* name : {"geometry", "eikonal", "templates", "monodomain", "diffusion", "bidomain", "torso",
                           "recorder", "activation times"})
    plan.modules.push_back({name, false, "nothing is excited", 0});
  Launcher launcher(device, scene.precision);
  const SolidPlan solid = add_mechanics(launcher, scene, members, base, plan.members_per_device, plan);
  refuse_beyond(plan.bytes, memory_limit(device, options),
                "a batch of " + std::to_string(plan.members_per_device) + " members");
  plan.tissue_cells = solid.cells;
  plan.dt_ms = solid.dt_ms;
  plan.steps = solid.steps;
  return plan;
}

// A tension that the cells drive needs cells that a wave excites, and time.
static void check_drive(const Scene& scene, const MechanicsText& text) {
  if (scene.stretch_activated && !excites(scene))
    throw std::invalid_argument(
        "electrophysiology.stretch_activated: nothing excites the tissue: there are neither stimuli nor a "
        "conduction system");
  if (scene.stretch_activated && scene.mechanics->quasi_static)
    throw std::invalid_argument(
        "electrophysiology.stretch_activated: cells and tissue go through time together, which "
        "mechanics.quasi_static: true does not have");
  if (!TensionDrive::wanted(scene)) return;
  const std::string driven = "mechanics.tension: " + scene.mechanics->tension + " follows the cells' " +
                             (text.tension.drive == MaterialFile::Drive::calcium ? "calcium" : "potential");
  if (!excites(scene))
    throw std::invalid_argument(
        driven +
        ", and nothing excites them: neither stimuli nor a conduction system; twitch and constant need none");
  if (scene.mechanics->quasi_static)
    throw std::invalid_argument(driven + " in time, which mechanics.quasi_static: true does not have");
  const double beats = scene.parameters.value("mechanics.drive_beats");
  if (beats != std::floor(beats)) throw std::invalid_argument("mechanics.drive_beats is no whole number");
}

SolidPlan add_mechanics(Launcher& launcher, const Scene& scene, std::span<const Member> members,
                        const Member& base, int batch, Plan& plan) {
  SolidPlan result;
  const auto module = [&](std::string name, bool runs, std::string reason, std::size_t bytes) {
    plan.modules.push_back({std::move(name), runs, std::move(reason), runs ? bytes : 0});
    plan.bytes += runs ? bytes : 0;
  };
  if (scene.mechanics) {
    const MechanicsText text = mechanics_text(scene);
    if (scene.circulation && scene.mechanics->cavities.empty())
      throw std::invalid_argument(
          "mechanics.cavities: beside a circulation some chamber is tissue; name it, or leave mechanics out");
    check_drive(scene, text);
    Device& device = launcher.device();
    const Grid grid = solid_grid(scene, plan);
    plan.viscous = viscous(scene, base.values) ||
                   std::any_of(members.begin(), members.end(),
                               [&](const Member& member) { return viscous(scene, member.values); });
    const bool coupled = Electromechanics::wanted(scene, plan.activation);
    std::optional<TensionDrive> drive;
    if (plan.activation == ActivationMethod::eikonal && TensionDrive::wanted(scene))
      drive.emplace(
          launcher, scene,
          scene_definitions(scene, {plan.cells, plan.origin_mm, scene.parameters.value("grid.dx_mm")}), 1);
    Solid solid(launcher, scene, scene_definitions(scene, grid), grid, 1, plan.viscous,
                drive     ? drive->options()
                : coupled ? Electromechanics::options(scene)
                          : std::vector<std::string>());
    const std::vector<std::byte> packed = pack(base.values, scene.precision);
    const cl::Buffer parameters = device.allocate(packed.size(), "parameters");
    launcher.queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());
    solid.build(parameters, {&base, 1});
    if (!solid.defect(0).empty()) throw std::invalid_argument(solid.defect(0));
    if (scene.displacement)
      if (const std::string why = SolidPoints(launcher, scene, solid).defect(solid, 0); !why.empty())
        throw std::invalid_argument(why);
    const SolidMesh& mesh = solid.mesh();
    warn_of_solid(scene, solid);
    result.cells = static_cast<std::size_t>(mesh.tissue_cells[0]);
    result.dt_ms = solid.first_step_ms(parameters) * scene.parameters.value("mechanics.step_factor");
    const double length_ms = scene.circulation               ? most_beats(scene) * beat_ms(scene)
                             : scene.mechanics->quasi_static ? 0
                                                             : scene.parameters.value("time.end_ms");
    // Steps shorten as walls thin and muscle stiffens: a beat of the default heart takes 1.3 times as many as
    // at rest.
    constexpr double shorter = 1.3, steps_to_rest = 1000;
    result.steps = static_cast<int>(length_ms > 0 ? shorter * length_ms / result.dt_ms : steps_to_rest);
    module("mechanics", true,
           scene.pv ? "outputs.pv: " + std::to_string(result.cells) + " cells deform" : "tissue deforms",
           static_cast<std::size_t>(batch) * bytes_of_member(solid, launcher, scene, members) +
               (scene.displacement ? SolidPoints::bytes(scene, batch) : 0) +
               (scene.circulation ? 0 : Heartbeat::bytes(scene, batch)));
    module("tension drive", drive.has_value(),
           drive ? "mechanics.tension: " + scene.mechanics->tension + " by single cells behind arrival times"
           : coupled && TensionDrive::wanted(scene) ? "the cells themselves drive the tension"
                                                    : "activation times alone drive the tension",
           drive ? TensionDrive::bytes(scene, batch) : 0);
    std::string together = "activation times are enough";
    if (coupled && TensionDrive::wanted(scene))
      together = "mechanics.tension: " + scene.mechanics->tension + " follows the cells in windows of 1 ms";
    if (coupled && scene.stretch_activated)
      together = (TensionDrive::wanted(scene) ? together + "; " : std::string()) +
                 "electrophysiology.stretch_activated: stretch acts on the cells every 1 ms";
    const std::size_t for_coupling =
        Electromechanics::bytes(scene, static_cast<std::size_t>(mesh.cells), plan.segments * Tissue::lanes);
    module("electromechanics", coupled, together,
           // In the place of what building the tissue has given back.
           static_cast<std::size_t>(batch) * (for_coupling - std::min(for_coupling, solid.scratch_bytes())));
  } else {
    module("mechanics", false, "no pressure-volume output is asked for", 0);
  }
  const bool tissue = scene.mechanics && !scene.mechanics->cavities.empty();
  module("circulation", scene.circulation.has_value(),
         !scene.circulation ? "no circulation is asked for"
         : tissue           ? "joins cavities of tissue and chambers"
                            : "all chambers are elastances",
         scene.circulation ? Heartbeat::bytes(scene, batch) : 0);
  module("fluid", false, "no flow output is asked for", 0);
  return result;
}

}  // namespace cohort
