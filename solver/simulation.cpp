#include "solver/simulation.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "solver/bidomain.hpp"
#include "solver/ecg_features.hpp"
#include "solver/eikonal_activation.hpp"
#include "solver/features.hpp"
#include "solver/forward_ecg.hpp"
#include "solver/heterogeneity.hpp"
#include "solver/lead_weights.hpp"
#include "solver/monodomain.hpp"
#include "solver/observer.hpp"
#include "solver/probes.hpp"
#include "solver/reaction_eikonal.hpp"
#include "solver/recorder.hpp"
#include "solver/template_ecg.hpp"
#include "solver/time_steps.hpp"

namespace cohort {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double structural(const Scene& scene, const char* path) {
  return scene.parameters[scene.parameters.index(path)].value;
}

constexpr int fetches_per_profile = 16;  // one fetch in so many is timed kernel by kernel

}  // namespace

Layout layout(const Scene& scene) {
  Layout result;
  if (scene.ecg) {
    result.leads = {"I", "II", "III", "aVR", "aVL", "aVF", "V1", "V2", "V3", "V4", "V5", "V6"};
    const double interval = sampling_interval_ms(scene);
    for (int k = 0; k < samples_of(scene); ++k) result.ecg_ms.push_back(k * interval);
  }
  for (const auto& [name, unit] : activation_feature_names(scene)) {
    result.features.push_back(name);
    result.feature_units.push_back(unit);
  }
  if (!scene.ecg) return result;
  for (const auto& [name, unit] : ecg_feature_names()) {
    result.features.push_back(name);
    result.feature_units.push_back(unit);
  }
  return result;
}

struct Simulation::State {
  State(Device& device, const Scene& scene_, const Plan& plan)
      : scene(scene_),
        grid{plan.cells, plan.origin_mm, structural(scene_, "grid.dx_mm")},
        definitions(scene_definitions(scene_, grid)),
        launcher(device, scene_.precision),
        tissue(launcher, scene_, grid, plan.members_per_device),
        diffusion(launcher, scene_, definitions),
        monodomain(launcher, scene_, definitions, plan.members_per_device),
        recorder(launcher, scene_, definitions, plan.members_per_device, Recorder::samples_per_fetch),
        shape(layout(scene_)) {
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
    parameters = device.allocate(static_cast<std::size_t>(plan.members_per_device * scene.parameters.size()) *
                                 real_bytes(scene.precision));
  }

  void prepare(std::span<const Member> members);
  std::string defect(std::size_t m, const Member& member);
  bool in_torso(std::size_t m, const Member& member);
  void advance(double time_ms, const TimeSteps& steps, bool first);
  void march(const TimeSteps& steps, std::span<const Member> members, std::span<Recording* const> recordings,
             double timeout_s);
  void stop_unsolved(std::span<Recording* const> recordings, double time_ms);
  void project(std::span<const Member> members, std::span<Recording* const> recordings);
  void store_features(std::span<const float> activation, std::span<const float> probe_potential,
                      std::size_t m, const Member& member, Recording& recording) const;
  void store_sample(int sample, double time_ms, const double* row, std::span<Recording* const> recordings);

  const Scene& scene;
  Grid grid;
  Definitions definitions;
  Launcher launcher;
  Tissue tissue;
  Diffusion diffusion;
  Monodomain monodomain;
  std::optional<Bidomain> bidomain;
  std::optional<EikonalActivation> eikonal;  ///< activation: eikonal, without a time loop
  std::optional<TemplateEcg> templates;
  std::optional<ReactionEikonal> reaction_eikonal;
  std::optional<LeadWeights> lead_weights;
  std::optional<ForwardEcg> forward;
  Recorder recorder;
  std::optional<Probes> probes;
  std::optional<Observation> observation;
  Layout shape;
  cl::Buffer parameters;
  double simulated_ms = 0, cell_updates = 0;
  bool profiled_setup = false;
  int batches = 0;
};

Simulation::Simulation(Device& device, const Scene& scene, const Plan& plan)
    : state_(std::make_unique<State>(device, scene, plan)) {}
Simulation::~Simulation() = default;

// Geometry, operators and lead fields of `members`.
void Simulation::State::prepare(std::span<const Member> members) {
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
  if (forward) forward->assemble(tissue, diffusion, parameters, members);
}

// Every so many segments of tissue are asked whether they lie in the torso: enough to find a misplaced heart.
constexpr std::size_t segments_to_a_probe = 8;

bool Simulation::State::in_torso(std::size_t m, const Member& member) {
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

// Why member m cannot run; empty when it can.
std::string Simulation::State::defect(std::size_t m, const Member& member) {
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
  if (eikonal && !eikonal->defect(m).empty()) return eikonal->defect(m);
  if (reaction_eikonal) {
    const std::string reason = reaction_eikonal->defect(tissue, monodomain, m, member);
    if (!reason.empty()) return reason;
  }
  if (!in_torso(m, member)) return "the heart does not lie inside the torso";
  return {};
}

// One sample of every member: eight leads to twelve, and the check.
void Simulation::State::store_sample(int sample, double time_ms, const double* row,
                                     std::span<Recording* const> recordings) {
  for (Recording* recording : recordings) {
    const double wild = row[recorder.quantities() - 1];
    if (wild > 0 || std::isnan(wild)) {
      if (recording->outcome == Outcome::done) {
        recording->outcome = Outcome::unstable;
        recording->failed_at_ms = time_ms;
        recording->reason = "the potential is beyond 1000 mV, or no number, in " +
                            std::to_string(static_cast<std::int64_t>(wild)) + " cells";
      }
    } else if (scene.ecg && sample < static_cast<int>(shape.ecg_ms.size()) &&
               recording->outcome == Outcome::done) {
      const std::size_t samples = shape.ecg_ms.size();
      const auto put = [&](std::size_t lead, float mV) {
        recording->ecg[lead * samples + static_cast<size_t>(sample)] = mV;
      };
      // The limb leads are exact combinations of the stored I and II.
      const auto I = static_cast<float>(row[0]), II = static_cast<float>(row[1]);
      put(0, I);
      put(1, II);
      put(2, II - I);
      put(3, -0.5f * (I + II));
      put(4, I - 0.5f * II);
      put(5, II - 0.5f * I);
      for (std::size_t v = 0; v < 6; ++v) put(6 + v, static_cast<float>(row[2 + v]));
    }
    row += recorder.quantities();
  }
}

// Ends members whose potentials the elliptic solver could not find.
void Simulation::State::stop_unsolved(std::span<Recording* const> recordings, double time_ms) {
  constexpr double acceptable_forward = 1e-3;
  for (std::size_t m = 0; m < recordings.size(); ++m) {
    const bool extracellular =
        bidomain && !(bidomain->worst_residual()[m] <= bidomain->acceptable_residual());
    const bool torso = forward && !(forward->worst_residual()[m] <= acceptable_forward);
    if (recordings[m]->outcome != Outcome::done || !(extracellular || torso)) continue;
    recordings[m]->outcome = Outcome::unstable;
    recordings[m]->failed_at_ms = time_ms;
    recordings[m]->reason = extracellular ? "the extracellular potential does not converge"
                                          : "the potential of the torso does not converge";
  }
}

// Features of a member that is done, in the order of layout().
void Simulation::State::store_features(std::span<const float> activation,
                                       std::span<const float> probe_potential, std::size_t m,
                                       const Member& member, Recording& recording) const {
  if (recording.outcome != Outcome::done) return;
  std::vector<float> features;
  if (scene.activation)
    features = activation_features(scene, tissue, activation, m, member.values, probe_potential);
  if (scene.ecg) {
    const std::vector<float> measured = ecg_features(recording.ecg, sampling_interval_ms(scene));
    features.insert(features.end(), measured.begin(), measured.end());
  }
  recording.features = std::move(features);
}

// ECG and activation of all members of the batch from their arrival times: no time loop. `recordings` of
// members that were rejected stay as they are.
void Simulation::State::project(std::span<const Member> members, std::span<Recording* const> recordings) {
  const auto start = Clock::now();
  const double end_ms = structural(scene, "time.end_ms"), interval = sampling_interval_ms(scene);
  if (templates) {
    const std::vector<double> rows =
        templates->series(tissue, parameters, eikonal->arrival(), lead_weights->weights(), members);
    const auto width = static_cast<size_t>(recorder.quantities()) * members.size();
    for (size_t k = 0; k < shape.ecg_ms.size(); ++k)
      store_sample(static_cast<int>(k), static_cast<double>(k) * interval, rows.data() + k * width,
                   recordings);
    for (size_t m = 0; m < members.size(); ++m) {
      Recording& recording = *recordings[m];
      if (recording.outcome != Outcome::unstable || templates->silent(m).empty()) continue;
      recording.outcome = Outcome::rejected;
      recording.reason = templates->silent(m);
      recording.failed_at_ms = 0;
      std::fill(recording.ecg.begin(), recording.ecg.end(), std::numeric_limits<float>::quiet_NaN());
    }
  }
  std::vector<float> activation;
  if (scene.activation || observation) activation = eikonal->activation(tissue, end_ms);
  if (observation) {
    observation->begin(launcher, tissue);
    observation->end(activation);
  }
  const double share_s = seconds_since(start) / static_cast<double>(members.size());
  for (size_t m = 0; m < members.size(); ++m) {
    if (recordings[m]->outcome == Outcome::rejected) continue;
    store_features(activation, {}, m, members[m], *recordings[m]);
    recordings[m]->dt_ms = templates ? templates->spacing_ms() : 0;
    recordings[m]->device_s = share_s;
    simulated_ms += end_ms;
  }
}

// One step of whatever activates the tissue.
void Simulation::State::advance(double time_ms, const TimeSteps& steps, bool first) {
  if (reaction_eikonal) reaction_eikonal->trigger(tissue, monodomain, parameters, time_ms, steps.dt_ms);
  if (bidomain)
    bidomain->advance(tissue, monodomain, parameters, time_ms, first);
  else
    monodomain.advance(tissue, parameters, time_ms, first);
}

// The time loop of members that share their steps. Nothing in it waits for the device but the fetch of
// samples that were taken one fetch ago, and the turns to and from the profiling queue, one fetch in sixteen.
void Simulation::State::march(const TimeSteps& steps, std::span<const Member> members,
                              std::span<Recording* const> recordings, double timeout_s) {
  const double end_ms = structural(scene, "time.end_ms"), interval = sampling_interval_ms(scene);
  constexpr double rounding = 1e-9;
  const auto total_steps = static_cast<std::int64_t>(std::ceil(end_ms / steps.dt_ms - rounding));
  const int samples = samples_of(scene);
  const auto loop_start = Clock::now();

  monodomain.initialise(tissue, parameters, steps.dt_ms, steps.substeps);
  if (bidomain) bidomain->initialise();
  recorder.prepare(tissue);
  if (probes) probes->prepare(tissue, members);
  if (observation) observation->begin(launcher, tissue);
  const cl::Buffer* weights = lead_weights ? &lead_weights->weights() : nullptr;

  struct Fetch {
    int first, count;
  };
  std::optional<Fetch> pending;
  const auto receive = [&](const Fetch& fetch, bool last) {
    const std::vector<double> rows = recorder.fetched(last);
    const auto width = static_cast<size_t>(recorder.quantities()) * members.size();
    for (int k = 0; k < fetch.count; ++k)
      store_sample(fetch.first + k, std::min((fetch.first + k) * interval, end_ms),
                   rows.data() + static_cast<size_t>(k) * width, recordings);
  };

  std::int64_t step = 0;
  bool stopped = false;
  // The last sample, at end_ms, is for the check alone.
  for (int first = 0; first <= samples && !stopped; first += Recorder::samples_per_fetch) {
    const int count = std::min(Recorder::samples_per_fetch, samples + 1 - first);
    // The very first launches are not timed: kernels are still being compiled.
    const int fetch = first / Recorder::samples_per_fetch;
    launcher.profile(fetch % fetches_per_profile == (batches > 0 ? 0 : 1));
    for (int k = 0; k < count; ++k) {
      const double sample_ms = static_cast<double>(step) * steps.dt_ms;
      const cl::Buffer* closed = bidomain  ? &bidomain->closed_potential(tissue, monodomain, sample_ms)
                                 : forward ? &monodomain.closed_potential(tissue)
                                           : nullptr;
      recorder.sample(tissue, monodomain, weights, k, closed);
      if (forward) forward->sample(tissue, *closed, recorder.series(), recorder.quantities(), k);
      if (probes) probes->sample(monodomain.potential(), first + k);
      if (observation)
        observation->sample(launcher, tissue, monodomain, closed, first + k,
                            std::min((first + k) * interval, end_ms));
      for (int n = 0; n < steps.per_sample && step < total_steps; ++n, ++step)
        advance(static_cast<double>(step) * steps.dt_ms, steps, step == 0);
      launcher.queue().flush();
    }
    recorder.start_fetch(count);
    if (pending) receive(*pending, false);
    pending = Fetch{first, count};
    stop_unsolved(recordings, (first + count) * interval);
    if (seconds_since(loop_start) > timeout_s) {
      for (Recording* recording : recordings) {
        if (recording->outcome != Outcome::done) continue;
        recording->outcome = Outcome::timeout;
        recording->failed_at_ms = (first + count) * interval;
        recording->reason = "not finished after " + std::to_string(timeout_s) + " s";
      }
      stopped = true;
    }
    stopped = stopped || std::all_of(recordings.begin(), recordings.end(),
                                     [](const Recording* r) { return r->outcome != Outcome::done; });
  }
  if (pending) receive(*pending, true);
  launcher.profile(false);

  std::vector<float> activation;
  if (scene.activation) {
    activation.resize(static_cast<size_t>(tissue.stride) * static_cast<size_t>(activation_fields(scene)));
    launcher.queue().enqueueReadBuffer(monodomain.activation(), CL_TRUE, 0, activation.size() * sizeof(float),
                                       activation.data());
    if (observation)
      observation->end(std::span<const float>(activation).first(static_cast<size_t>(tissue.stride)));
  }
  const std::vector<float> series = probes ? probes->series() : std::vector<float>();
  const std::size_t row = series.size() / members.size();
  for (size_t m = 0; m < members.size(); ++m)
    store_features(activation, std::span<const float>(series).subspan(m * row, row), m, members[m],
                   *recordings[m]);
  const double share_s = seconds_since(loop_start) / static_cast<double>(members.size());
  for (size_t m = 0; m < members.size(); ++m) {
    recordings[m]->dt_ms = steps.dt_ms;
    recordings[m]->device_s = share_s;
    simulated_ms += static_cast<double>(step) * steps.dt_ms;
    cell_updates += static_cast<double>(step) * static_cast<double>(tissue.tissue_cells[m]);
  }
}

std::vector<Recording> Simulation::run(std::span<const Member> members, double timeout_s) {
  State& s = *state_;
  const auto start = Clock::now();
  std::vector<Recording> recordings(members.size());
  for (Recording& recording : recordings) {
    recording.outcome = Outcome::done;
    recording.dx_mm = s.grid.dx_mm;
    recording.ecg.assign(s.shape.leads.size() * s.shape.ecg_ms.size(),
                         std::numeric_limits<float>::quiet_NaN());
    recording.features.assign(s.shape.features.size(), std::numeric_limits<float>::quiet_NaN());
  }
  s.launcher.profile(s.batches == 1);  // the set-up of the second batch is timed: the first one compiles
  try {
    s.prepare(members);
  } catch (const std::runtime_error& error) {
    // Lead fields that do not converge, a heart too large for the memory: one member's matter. Of several the
    // culprit is not known; each is tried alone.
    s.launcher.profile(false);
    if (members.size() == 1) {
      recordings[0].outcome = Outcome::rejected;
      recordings[0].reason = error.what();
      recordings[0].failed_at_ms = 0;
      return recordings;
    }
    for (size_t m = 0; m < members.size(); ++m)
      recordings[m] = std::move(run(members.subspan(m, 1), timeout_s).front());
    return recordings;
  }
  s.launcher.profile(false);
  s.launcher.queue().finish();

  // Members whose steps differ run after each other, so that each one's steps are its own.
  struct Group {
    TimeSteps steps;
    std::vector<Member> members;
    std::vector<Recording*> recordings;
  };
  std::vector<Group> groups;
  for (size_t m = 0; m < members.size(); ++m) {
    std::string reason = s.defect(m, members[m]);
    TimeSteps steps{};
    if (reason.empty() && !s.eikonal) {
      try {
        steps = choose_steps(s.scene, s.monodomain.fastest_rate()[m], s.monodomain.diffusion_limit_ms()[m]);
      } catch (const std::runtime_error& error) {
        reason = error.what();
      }
    }
    if (!reason.empty()) {
      recordings[m].outcome = Outcome::rejected;
      recordings[m].reason = reason;
      recordings[m].failed_at_ms = 0;
      continue;
    }
    for (const std::string& probe : probes_outside(s.scene, s.tissue, m, members[m].values))
      spdlog::warn("member {}: probe \"{}\" lies outside the tissue and reads NaN", members[m].id, probe);
    if (s.eikonal) continue;
    auto group = std::find_if(groups.begin(), groups.end(), [&](const Group& g) { return g.steps == steps; });
    if (group == groups.end()) group = groups.insert(groups.end(), Group{steps, {}, {}});
    group->members.push_back(members[m]);
    group->recordings.push_back(&recordings[m]);
  }
  const double setup_s = seconds_since(start) / static_cast<double>(members.size());
  for (Group& group : groups) {
    if (group.members.size() != members.size()) s.prepare(group.members);
    s.march(group.steps, group.members, group.recordings, timeout_s);
  }
  if (s.eikonal) {
    std::vector<Recording*> all;
    for (Recording& recording : recordings) all.push_back(&recording);
    s.launcher.profile(s.batches == 1);
    s.project(members, all);
    s.launcher.profile(false);
  }
  ++s.batches;
  for (Recording& recording : recordings) {
    recording.setup_s = setup_s;
    recording.wall_s = seconds_since(start) / static_cast<double>(members.size());
  }
  return recordings;
}

void Simulation::observe(Observer observer) {
  if (state_->eikonal && observer.interval_ms > 0) {
    spdlog::warn("activation: eikonal keeps no potentials to show; reaction_eikonal and monodomain do");
    observer.interval_ms = 0;
  }
  state_->observation.emplace(std::move(observer), state_->scene.precision,
                              sampling_interval_ms(state_->scene));
}

std::vector<KernelPerformance> Simulation::performance() const {
  return state_->launcher.performance();
}
double Simulation::simulated_ms() const {
  return state_->simulated_ms;
}
double Simulation::cell_updates() const {
  return state_->cell_updates;
}

}  // namespace cohort
