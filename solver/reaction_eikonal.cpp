#include "solver/reaction_eikonal.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "solver/stimulus.hpp"

namespace cohort {

namespace {

constexpr double trigger_length_ms = 1;  // for a cell without currents: sets the amplitude
constexpr double pulse_ms = 2;           // of the stimulus that starts a cable's front
constexpr int latencies = 2;

/// Reads the numbers of one excitable region of a member.
struct RegionNumbers {
  const Scene& scene;
  const CellModels& models;
  const RegionParameters& regions;
  const Member& member;
  std::size_t region;

  const CellModel& model() const { return models.all()[static_cast<size_t>(models.of_region()[region])]; }
  double tissue(int offset) const {
    return member.values[static_cast<size_t>(regions.first + regions.slot[region] * regions.stride + offset)];
  }
  double cell(int k) const { return member.values[static_cast<size_t>(regions.cell_first[region] + k)]; }
  double value(const std::string& path) const {
    return member.values[static_cast<size_t>(scene.parameters.index(path))];
  }
  /// Along (0) or across (1) fibres, of the equation that the scene solves: of the bidomain equations that
  /// of a plane front in tissue without a bath.
  double diffusivity(int direction) const {
    const double membrane = value("electrophysiology.surface_to_volume_per_mm") *
                            value("electrophysiology.capacitance_uF_per_mm2");
    if (scene.activation_method != ActivationMethod::bidomain)
      return tissue(regions.conductivity_offset + direction) / membrane;
    const double inside = tissue(regions.intracellular_offset + direction);
    const double outside = tissue(regions.extracellular_offset + direction);
    return inside * outside / (inside + outside) / membrane;
  }
  double threshold_mV() const { return value("electrophysiology.activation_threshold_mV"); }
  Cable cable(double amplitude, double duration) const {
    Cable result{model().name, {}, threshold_mV(), amplitude, duration};
    for (size_t k = 0; k < model().parameters.size(); ++k) result.cell.push_back(cell(static_cast<int>(k)));
    return result;
  }
  /// The rate that lifts a passive cell from rest to the threshold in `length` ms.
  double lift(double length) const { return (threshold_mV() - cell(model().rest)) / length; }
  /// Twice what lifts a passive cell to the threshold: starts a front wherever there can be one.
  Cable pulse() const { return cable(2 * lift(pulse_ms), pulse_ms); }
};

}  // namespace

std::vector<RegionFront> region_fronts(Conduction& conduction, const Scene& scene,
                                       std::span<const Member> members) {
  const CellModels models(scene);
  const RegionParameters regions = region_parameters(scene);
  std::vector<Cable> cables;
  for (const Member& member : members)
    for (size_t r = 0; r < scene.regions.size(); ++r)
      if (regions.slot[r] >= 0) cables.push_back(RegionNumbers{scene, models, regions, member, r}.pulse());
  const std::vector<Front> fronts = conduction.converged(cables);
  std::vector<RegionFront> result;
  for (const Member& member : members)
    for (size_t r = 0; r < scene.regions.size(); ++r) {
      if (regions.slot[r] < 0) continue;
      const RegionNumbers numbers{scene, models, regions, member, r};
      const Front& front = fronts[result.size()];
      const double D_along = numbers.diffusivity(0), D_across = numbers.diffusivity(1);
      const bool may_be_given = regions.velocity_offset >= 0;
      result.push_back({static_cast<int>(r), front, D_along, D_across, front.speed * std::sqrt(D_along),
                        front.speed * std::sqrt(D_across),
                        may_be_given ? numbers.tissue(regions.velocity_offset) : 0,
                        may_be_given ? numbers.tissue(regions.velocity_offset + 1) : 0,
                        front.width_mm * std::sqrt(D_along), front.width_mm * std::sqrt(D_across)});
    }
  return result;
}

ReactionEikonal::ReactionEikonal(Launcher& launcher, const Scene& scene, const Definitions& definitions,
                                 int members_per_batch)
    : launcher_(launcher),
      scene_(scene),
      conduction_(launcher.device(), scene.precision),
      eikonal_(launcher, scene, definitions, activation_graphs(scene)),
      width_(launcher.device().vector_width(scene.precision == Precision::double_)),
      members_per_batch_(members_per_batch) {
  Device& device = launcher.device();
  if (scene.conduction_system) network_.emplace(launcher, scene, definitions, members_per_batch);
  const auto stimuli = std::max<std::size_t>(scene.stimuli.size(), 1);
  std::vector<std::string> options = definitions.options;
  options.push_back("WIDTH=" + std::to_string(width_));
  options.push_back("STIMULI=" + std::to_string(stimuli));
  options.push_back("PASSIVE_LIFT_ms=" + std::to_string(trigger_length_ms));
  if (activation_fields(scene) > 0) options.push_back("ACTIVATION");
  if (activation_fields(scene) > 1) options.push_back("BEATS");
  const cl::Program program =
      device.build({"segments.clh", "stimulus.clh", "diffusion.clh", "reaction_eikonal.cl"}, options,
                   definitions.generated);
  front_speed_ = launcher.handle(program, "front_speed");
  front_sources_ = launcher.handle(program, "front_sources");
  front_slowness_ = launcher.handle(program, "front_slowness");
  trigger_cells_ = launcher.handle(program, "trigger_cells");
  const auto slots = static_cast<std::size_t>(members_per_batch) * scene.regions.size();
  const std::size_t real = real_bytes(scene.precision);
  speeds_ = device.allocate(2 * slots * real, "speeds");
  trigger_ = device.allocate(2 * slots * real, "trigger");
  latency_ = device.allocate(slots * stimuli * latencies * real, "latency");
  beats_ = device.allocate(2 * static_cast<std::size_t>(members_per_batch) * real, "beats");
}

std::size_t ReactionEikonal::bytes(const Scene& scene, int members, std::int64_t stride) {
  const Precision precision = scene.precision;
  const std::size_t real = real_bytes(precision), stimuli = std::max<std::size_t>(scene.stimuli.size(), 1);
  const std::size_t of_member = ((4 + stimuli * latencies) * scene.regions.size() + 2) * real;
  constexpr std::size_t small = 20;  // buffers of the eikonal solver, the network and this
  return Eikonal::bytes(stride, precision) + static_cast<std::size_t>(stride) * 4 * real +
         (scene.conduction_system ? ConductionNetwork::bytes(scene, members, stride) : 0) +
         static_cast<std::size_t>(members) * of_member + small * Device::least_bytes;
}

void ReactionEikonal::assemble(const Tissue& tissue, Monodomain& monodomain, const cl::Buffer& parameters,
                               std::span<const Member> members) {
  Device& device = launcher_.device();
  cl::CommandQueue& queue = launcher_.queue();
  const std::size_t real = real_bytes(scene_.precision);
  const auto n = static_cast<std::size_t>(tissue.stride);
  if (tissue.stride > capacity_) {
    capacity_ = tissue.stride + tissue.stride / 16;
    const std::size_t bytes = static_cast<std::size_t>(capacity_) * real;
    speed_ = device.allocate(2 * bytes, "speed");
    initial_ = device.allocate(bytes, "initial");
    slowness_ = device.allocate(bytes, "slowness");
  }
  const auto upload = [&](const cl::Buffer& buffer, const std::vector<double>& numbers) {
    const std::vector<std::byte> packed = pack(numbers, scene_.precision);
    if (!packed.empty()) queue.enqueueWriteBuffer(buffer, CL_TRUE, 0, packed.size(), packed.data());
  };

  // Speeds, triggers and latencies by member and region; stimuli only where they act.
  const CellModels models(scene_);
  const RegionParameters regions = region_parameters(scene_);
  const auto slots = static_cast<std::size_t>(regions.slots), stimuli = scene_.stimuli.size();
  std::vector<double> speeds;
  for (const RegionFront& front : region_fronts(conduction_, scene_, members)) {
    speeds.push_back(front.given_along > 0 ? front.given_along : front.along_mm_per_ms);
    speeds.push_back(front.given_across > 0 ? front.given_across : front.across_mm_per_ms);
  }
  std::vector<Cable> triggers, starts;
  std::vector<std::size_t> start_of;  // of each latency: its cable
  std::vector<double> triggered, latency(members.size() * slots * stimuli * latencies, Eikonal::unreached_ms),
      beats;
  for (size_t m = 0; m < members.size(); ++m) {
    std::vector<std::uint8_t> acts(slots, 0);
    const auto begin =
        static_cast<std::size_t>(Tissue::first_cell_place + tissue.first_block[m] * Tissue::block_cells);
    const auto end =
        static_cast<std::size_t>(Tissue::first_cell_place + tissue.first_block[m + 1] * Tissue::block_cells);
    for (std::size_t i = begin; i < end; ++i)
      if (tissue.regions[i] != 255 && regions.slot[tissue.regions[i]] >= 0)
        acts[static_cast<size_t>(regions.slot[tissue.regions[i]])] |= monodomain.stimulated_by()[i];
    const std::vector<double> block = stimulus_block(scene_, members[m].values);
    beats.push_back(stimuli > 0 ? block[2] : 0);
    beats.push_back(stimuli > 0 && block[2] > 0 ? std::floor(block[3]) : 1);
    for (size_t r = 0; r < scene_.regions.size(); ++r) {
      if (regions.slot[r] < 0) continue;
      const auto slot = static_cast<std::size_t>(regions.slot[r]);
      const RegionNumbers numbers{scene_, models, regions, members[m], r};
      constexpr double until_activated = 1000;
      triggers.push_back(numbers.cable(numbers.lift(trigger_length_ms), until_activated));
      for (size_t k = 0; k < stimuli; ++k) {
        if (!(acts[slot] >> k & 1)) continue;
        start_of.push_back(((m * slots + slot) * stimuli + k) * latencies);
        starts.push_back(numbers.cable(block[k * stimulus_numbers + 4], block[k * stimulus_numbers + 1]));
      }
    }
  }
  const std::vector<double> lengths = conduction_.uniform_latency(triggers);
  untriggered_.assign(members.size(), {});
  for (size_t m = 0; m < members.size(); ++m)
    for (size_t r = 0; r < scene_.regions.size(); ++r)
      if (regions.slot[r] >= 0 && !(lengths[m * slots + static_cast<size_t>(regions.slot[r])] > 0))
        untriggered_[m] = "cells of region \"" + scene_.regions[r].name +
                          "\" do not rise through electrophysiology.activation_threshold_mV when they are "
                          "stimulated: a front cannot trigger them";
  for (size_t k = 0; k < triggers.size(); ++k) {
    triggered.push_back(triggers[k].amplitude_mV_per_ms);
    triggered.push_back(lengths[k]);
  }
  const std::vector<Front> started = conduction_.converged(starts);
  const std::vector<double> inside = conduction_.uniform_latency(starts);
  for (size_t k = 0; k < starts.size(); ++k) {
    if (!(started[k].speed > 0)) continue;
    latency[start_of[k]] = started[k].latency_ms;
    latency[start_of[k] + 1] = inside[k] > 0 ? inside[k] : started[k].latency_ms;
  }
  upload(speeds_, speeds);
  upload(trigger_, triggered);
  upload(latency_, latency);
  upload(beats_, beats);

  const cl::NDRange global(n), local(Tissue::group);
  const auto bytes = static_cast<double>(n * real);
  launcher_(front_speed_, global, local, 2 * bytes, tissue.member_of, tissue.region, speeds_, speed_,
            tissue.stride);
  if (stimuli > 0)
    launcher_(front_sources_, global, local, 6 * bytes, monodomain.stimuli(),
              tissue.grid().origin_and_spacing(), tissue.first_cell, tissue.place, tissue.member_of,
              tissue.region, monodomain.stimulated_by_mask(), tissue.fibre, speed_, latency_, initial_,
              tissue.stride, static_cast<int>(tissue.places.size()) * Tissue::lanes);
  std::optional<Eikonal::Sheet> sheet;
  std::vector<Eikonal::Source> sources;
  if (network_) {
    network_->assemble(tissue, parameters, speed_, members);
    sheet.emplace(network_->sheet());
    sources = network_->sources();
  }
  eikonal_.solve(tissue, speed_, sheet ? &*sheet : nullptr, stimuli > 0 ? &initial_ : nullptr, sources,
                 network_ ? &network_->fibres() : nullptr);
  const auto cells = static_cast<std::size_t>(tissue.blocks) * Tissue::block_cells;
  queue.enqueueFillBuffer(slowness_, cl_uchar{0}, 0, n * real);
  launcher_(front_slowness_, cl::NDRange(cells / static_cast<size_t>(width_)),
            cl::NDRange(Tissue::block_cells / static_cast<size_t>(width_)), 8 * bytes, eikonal_.arrival(),
            monodomain.stencil(), tissue.inverse_capacity, tissue.neighbours, slowness_, tissue.stride);
  eikonal_.slow(tissue, slowness_);
  monodomain.silence_stimuli();

  std::vector<std::byte> raw(n * real);
  queue.enqueueReadBuffer(eikonal_.arrival(), CL_TRUE, 0, raw.size(), raw.data());
  host_arrival_ = unpack(raw, scene_.precision);
  first_ms_ = Eikonal::unreached_ms;
  last_ms_ = 0;
  for (const double t : host_arrival_) {
    first_ms_ = std::min(first_ms_, t);
    if (t < Eikonal::unreached_ms) last_ms_ = std::max(last_ms_, t);
  }
  first_ms_ -= lengths.empty() ? 0 : *std::max_element(lengths.begin(), lengths.end());
  double longest_train_ms = 0;
  for (size_t m = 0; m < members.size(); ++m)
    longest_train_ms = std::max(longest_train_ms, beats[2 * m] * (beats[2 * m + 1] - 1));
  last_ms_ += longest_train_ms;
}

void ReactionEikonal::trigger(const Tissue& tissue, Monodomain& monodomain, const cl::Buffer& parameters,
                              double time_ms, double dt_ms) {
  if (time_ms + dt_ms < first_ms_ || time_ms > last_ms_) return;
  const auto n = static_cast<std::size_t>(tissue.stride);
  const double whole = std::floor(time_ms);
  launcher_(trigger_cells_, cl::NDRange(n), cl::NDRange(Tissue::group),
            static_cast<double>(n) * (1 + static_cast<double>(real_bytes(scene_.precision))),
            monodomain.potential(), eikonal_.arrival(), tissue.member_of, tissue.region, trigger_, parameters,
            monodomain.activation(), beats_, Real{whole}, Real{time_ms - whole}, Real{dt_ms}, tissue.stride);
}

std::string ReactionEikonal::defect(const Tissue& tissue, const Monodomain& monodomain, std::size_t m,
                                    const Member& member) {
  if (!untriggered_[m].empty()) return untriggered_[m];
  if (network_ && !network_->missing()[m].empty()) return network_->missing()[m];
  const std::vector<double> block = stimulus_block(scene_, member.values);
  std::vector<double> latest(scene_.stimuli.size(), -1);  // arrival in the cells of each stimulus
  const auto begin =
      static_cast<std::size_t>(Tissue::first_cell_place + tissue.first_block[m] * Tissue::block_cells);
  const auto end =
      static_cast<std::size_t>(Tissue::first_cell_place + tissue.first_block[m + 1] * Tissue::block_cells);
  for (std::size_t i = begin; i < end; ++i)
    for (size_t k = 0; k < latest.size(); ++k)
      if (tissue.regions[i] != 255 && monodomain.stimulated_by()[i] >> k & 1)
        latest[k] = std::max(latest[k], host_arrival_[i]);
  for (size_t k = 0; k < latest.size(); ++k) {
    const double* s = block.data() + k * stimulus_numbers;
    const std::string name = "stimulus \"" + scene_.stimuli[k].name + "\"";
    if (s[2] != block[2] || (s[2] > 0 && std::floor(s[3]) != std::floor(block[3])))
      return name +
             " has another period or count than the first one: reaction_eikonal repeats one beat; "
             "electrophysiology.activation: monodomain paces freely";
    if (s[12] > 0)
      return name +
             " has an s2_interval_ms: reaction_eikonal repeats one beat; electrophysiology.activation: "
             "monodomain paces freely";
    if (latest[k] >= Eikonal::unreached_ms) return name + " does not start a front";
    if (latest[k] < s[0])
      return name +
             " comes after the front has passed it: reaction_eikonal knows one front; "
             "electrophysiology.activation: monodomain paces freely";
  }
  return {};
}

}  // namespace cohort
