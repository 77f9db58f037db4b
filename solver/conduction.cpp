#include "solver/conduction.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "solver/monodomain.hpp"

namespace cohort {

namespace {

constexpr int cable_cells = 256;
constexpr double stimulated_mm = 4.8;                  // for 1 mm2/ms: wide enough for a front of its own
constexpr double first_share = 0.5, last_share = 0.8;  // of the cable: where the speed is measured
constexpr double coarsest_spacing = 0.3;               // mm / sqrt(mm2/ms): sqrt of ms
constexpr int most_halvings = 4;
constexpr double step_of_spacing = 0.35;  // dt / spacing^2; an explicit step is stable up to 1/2
constexpr double slowest = 0.05;          // mm/ms for 1 mm2/ms; slower is no conduction
constexpr double longest_step_ms = 0.05;
constexpr double stalled_ms = 60;  // without a cell activated: no front, or none any more
constexpr double longest_look_ms = 2;
// From look to look a front moves some cells at most; fronts of 8 mm/ms for 1 mm2/ms are four times as fast
// as any of the heart.
constexpr double cells_to_a_look = 20, fastest = 8;
constexpr double uniform_step_ms = 0.01, uniform_end_ms = 50;

// A straight cable along x of cells of 1 mm, stimulated at its lower end.
Scene cable_scene(const std::string& cell_model, Precision precision) {
  Scene scene;
  scene.geometry = GeometryKind::box;
  scene.cell_model = cell_model;
  scene.precision = precision;
  scene.activation.emplace();
  scene.stimuli = {{"end", Stimulus::Kind::box, ""}};
  declare_parameters(scene);
  const auto set = [&](const std::string& path, double value) {
    scene.parameters[scene.parameters.index(path)].value = value;
  };
  set("grid.dx_mm", 1);
  set("geometry.box.size_mm.x", cable_cells);
  set("geometry.box.size_mm.y", 1);
  set("geometry.box.size_mm.z", 1);
  set("electrophysiology.surface_to_volume_per_mm", 1);
  set("electrophysiology.capacitance_uF_per_mm2", 1);
  set("stimuli.end.upper_mm.y", 1);
  set("stimuli.end.upper_mm.z", 1);
  return scene;
}

}  // namespace

// The cables as members of one batch, all with cells of `spacing`; in the scene a cell is 1 mm and the
// diffusivity 1 / spacing^2.
std::vector<Front> Conduction::run(const std::vector<Cable>& cables, double spacing, bool uniform) {
  const std::string& model = cables.front().cell_model;
  Scene scene = cable_scene(model, precision_);
  std::vector<Member> members;
  std::vector<double> numbers;
  const int stimulated_cells = std::min(static_cast<int>(std::lround(stimulated_mm / spacing)),
                                        static_cast<int>(first_share * cable_cells) - 1);
  for (const Cable& cable : cables) {
    std::vector<double> values = scene.parameters.values();
    const auto set = [&](const std::string& path, double value) {
      values[static_cast<size_t>(scene.parameters.index(path))] = value;
    };
    for (const char* name : {"longitudinal", "transverse"})
      set("electrophysiology.conductivity_" + std::string(name) + "_mS_per_mm", 1 / (spacing * spacing));
    set("electrophysiology.activation_threshold_mV", cable.threshold_mV);
    const auto first = static_cast<size_t>(scene.parameters.index("electrophysiology." + model + "." +
                                                                  read_cell_model(model).parameters[0].path));
    std::copy(cable.cell.begin(), cable.cell.end(), values.begin() + static_cast<std::ptrdiff_t>(first));
    set("stimuli.end.upper_mm.x", uniform ? cable_cells : stimulated_cells);
    set("stimuli.end.duration_ms", cable.duration_ms);
    set("stimuli.end.amplitude_mV_per_ms", cable.amplitude_mV_per_ms);
    scene.parameters.resolve(values);
    numbers.insert(numbers.end(), values.begin(), values.end());
    members.push_back({static_cast<std::int64_t>(members.size()), std::move(values)});
  }
  const Grid grid = make_grid(scene, members);
  const Definitions definitions = scene_definitions(scene, grid);
  Launcher launcher(device_, precision_);
  const int count = static_cast<int>(members.size());
  // Kernels are compiled for the capacity of a batch: few capacities, few compilations.
  constexpr unsigned least_capacity = 8;
  const int capacity =
      static_cast<int>(std::bit_ceil(std::max(static_cast<unsigned>(count), least_capacity)));
  Tissue tissue(launcher, scene, grid, capacity);
  Diffusion diffusion(launcher, scene, definitions);
  Monodomain monodomain(launcher, scene, definitions, capacity);
  const std::vector<std::byte> packed = pack(numbers, precision_);
  const cl::Buffer parameters = device_.allocate(packed.size(), "parameters");
  launcher.queue().enqueueWriteBuffer(parameters, CL_TRUE, 0, packed.size(), packed.data());
  tissue.build(parameters, count);
  tissue.build_fibres(parameters);
  monodomain.assemble(tissue, diffusion, parameters, members);

  const double dt =
      uniform ? uniform_step_ms : std::min(step_of_spacing * spacing * spacing, longest_step_ms);
  monodomain.initialise(tissue, parameters, dt, 1);
  const double end = uniform ? uniform_end_ms : cable_cells * spacing / slowest;
  std::vector<float> activation(static_cast<size_t>(tissue.stride));
  // The cells of cable m stand in one run of segments, x upwards.
  std::vector<std::size_t> first_place;
  for (size_t m = 0; m < cables.size(); ++m) {
    first_place.push_back(static_cast<std::size_t>(Tissue::first_cell_place) +
                          static_cast<std::size_t>(tissue.first_block[m]) * Tissue::block_cells);
    while (tissue.regions[first_place[m]] == 255) ++first_place[m];
  }
  const auto at = [&](int m, int x) {
    return first_place[static_cast<size_t>(m)] + static_cast<std::size_t>(x);
  };
  const int first = static_cast<int>(first_share * cable_cells),
            last = static_cast<int>(last_share * cable_cells);
  const double look_ms =
      uniform ? longest_look_ms : std::min(cells_to_a_look * spacing / fastest, longest_look_ms);
  const int steps_to_a_look = std::max(1, static_cast<int>(std::lround(look_ms / dt)));

  // Each cable is measured at the look that first finds its front beyond `last`, whatever the others do: a
  // faster front would have left its cable by the time the slowest one comes.
  std::vector<Front> fronts(cables.size());
  const auto measure = [&](int m, const std::vector<double>& potential) {
    Front& front = fronts[static_cast<size_t>(m)];
    const double t_first = static_cast<double>(activation[at(m, first)]);
    const double t_last = static_cast<double>(activation[at(m, last)]);
    if (uniform) {
      front.latency_ms = t_last;
      return;
    }
    if (t_first < 0 || t_last <= t_first) return;
    front.speed = (last - first) * spacing / (t_last - t_first);
    front.latency_ms = t_first - (first + 0.5 - stimulated_cells) * spacing / front.speed;
    double lowest = 1e9, highest = -1e9, steepest = 0;
    for (int x = 0; x + 1 < cable_cells; ++x) {
      const double V = potential[at(m, x)];
      lowest = std::min(lowest, V);
      highest = std::max(highest, V);
      steepest = std::max(steepest, std::abs(potential[at(m, x + 1)] - V));
    }
    front.width_mm = steepest > 0 ? (highest - lowest) / steepest * spacing : 0;
  };
  std::vector<std::byte> raw(static_cast<size_t>(tissue.stride) * real_bytes(precision_));
  struct Progress {
    int activated = 0;
    double latest_ms = 0;  // when a cell was last seen to have been activated
    bool over = false;
  };
  std::vector<Progress> progress(cables.size());
  std::int64_t step = 0;
  for (int running = count; running > 0;) {
    for (int k = 0; k < steps_to_a_look; ++k, ++step)
      monodomain.advance(tissue, parameters, static_cast<double>(step) * dt, step == 0);
    const double now = static_cast<double>(step) * dt;
    launcher.queue().enqueueReadBuffer(monodomain.activation(), CL_TRUE, 0, activation.size() * sizeof(float),
                                       activation.data());
    std::vector<double> potential;
    for (int m = 0; m < count; ++m) {
      Progress& p = progress[static_cast<size_t>(m)];
      if (p.over) continue;
      int activated = 0;
      for (int x = 0; x < cable_cells; ++x) activated += activation[at(m, x)] >= 0 ? 1 : 0;
      if (activated > p.activated) p.latest_ms = now;
      p.activated = activated;
      p.over = activation[at(m, last)] >= 0 || now >= std::min(end, p.latest_ms + stalled_ms);
      if (!p.over) continue;
      --running;
      if (potential.empty()) {
        launcher.queue().enqueueReadBuffer(monodomain.potential(), CL_TRUE, 0, raw.size(), raw.data());
        potential = unpack(raw, precision_);
      }
      measure(m, potential);
    }
  }
  return fronts;
}

std::vector<Front> Conduction::converged(const std::vector<Cable>& cables) {
  std::map<std::string, std::vector<Cable>> missing;  // by cell model
  for (const Cable& cable : cables) {
    std::vector<Cable>& group = missing[cable.cell_model];
    if (!known_.contains(cable) && std::find(group.begin(), group.end(), cable) == group.end())
      group.push_back(cable);
  }
  for (auto& [model, group] : missing) {
    if (group.empty()) continue;
    std::vector<Cable> open = group;
    std::map<Cable, Front> coarse;
    double spacing = coarsest_spacing;
    for (int halving = 0; halving <= most_halvings && !open.empty(); ++halving, spacing /= 2) {
      const std::vector<Front> fine = run(open, spacing, false);
      std::vector<Cable> next;
      for (size_t k = 0; k < open.size(); ++k) {
        const auto before = coarse.find(open[k]);
        const Front& f = fine[k];
        if (before != coarse.end() &&
            (std::abs(f.speed - before->second.speed) <= tolerance * f.speed || halving == most_halvings)) {
          const auto limit = [&](double c, double d) { return d + (d - c) / 3; };
          known_[open[k]] = {limit(before->second.speed, f.speed), f.width_mm,
                             limit(before->second.latency_ms, f.latency_ms)};
        } else {
          next.push_back(open[k]);
        }
        coarse[open[k]] = f;
      }
      open = next;
    }
  }
  std::vector<Front> result;
  for (const Cable& cable : cables) result.push_back(known_.at(cable));
  return result;
}

std::vector<double> Conduction::uniform_latency(const std::vector<Cable>& cables) {
  std::map<std::string, std::vector<Cable>> missing;
  for (const Cable& cable : cables) {
    std::vector<Cable>& group = missing[cable.cell_model];
    if (!known_uniform_.contains(cable) && std::find(group.begin(), group.end(), cable) == group.end())
      group.push_back(cable);
  }
  for (const auto& [model, group] : missing) {
    if (group.empty()) continue;
    const std::vector<Front> fronts = run(group, 1, true);
    for (size_t k = 0; k < group.size(); ++k) known_uniform_[group[k]] = fronts[k].latency_ms;
  }
  std::vector<double> result;
  for (const Cable& cable : cables) result.push_back(known_uniform_.at(cable));
  return result;
}

double Conduction::on_grid(const Cable& cable, double spacing) {
  const auto [entry, is_new] = known_on_grid_.try_emplace({cable, spacing}, 0.0);
  if (is_new) entry->second = run({cable}, spacing, false).front().speed;
  return entry->second;
}

}  // namespace cohort
