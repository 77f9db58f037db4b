#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "solver/excitation.hpp"
#include "solver/pv_output.hpp"

namespace cohort {

namespace {
constexpr int fetches_per_profile = 16;  // one fetch in so many is timed kernel by kernel
// Of the charge that diffusion moves; rounding leaves 1e-8 (solver/README.md, checks).
constexpr double charge_tolerance = 1e-4;
}  // namespace

void Excitation::stop_unsolved(std::span<Recording* const> recordings, double time_ms) {
  constexpr double acceptable_forward = 1e-3;
  for (std::size_t m = 0; m < recordings.size(); ++m) {
    const bool extracellular =
        bidomain && !(bidomain->worst_residual()[m] <= bidomain->acceptable_residual());
    const bool torso = forward && !(forward->worst_residual()[m] <= acceptable_forward);
    if (recordings[m]->outcome != Outcome::done || !(extracellular || torso)) continue;
    end_unstable(
        *recordings[m], time_ms,
        fmt::format("the {} does not converge: its residual is {:.2g}, at {:g} ms",
                    extracellular ? "extracellular potential" : "potential of the torso",
                    extracellular ? bidomain->worst_residual()[m] : forward->worst_residual()[m], time_ms));
  }
}

std::string Excitation::place_of(std::size_t cell) const {
  const std::array<double, 3> X = tissue.centre(cell);
  const std::uint8_t region = tissue.regions[cell];
  return fmt::format("({:.3g}, {:.3g}, {:.3g}) mm, region {}", X[0], X[1], X[2],
                     region < scene.regions.size() ? scene.regions[region].name : "none");
}

void Excitation::name_outcome(std::size_t m, double interval_ms, Recording& recording, bool was_done) {
  if (!was_done) return;
  if (recording.outcome == Outcome::unstable) {
    const Recorder::First first = recorder.first_wild(tissue, m);
    const std::string value = std::isfinite(first.what) ? fmt::format("{:.4g} mV", first.what) : "none";
    recording.reason += fmt::format("; first {} at {}, beyond {:.4g} to {:.4g} mV", value,
                                    place_of(first.cell), recorder.bounds(m)[0], recorder.bounds(m)[1]);
  } else if (recording.outcome == Outcome::done && recorder.looks()[m].states_beyond) {
    const Recorder::First first = recorder.first_state_beyond(tissue, m);
    const double time_ms = first.sample * interval_ms;
    end_unstable(
        recording, time_ms,
        fmt::format("state {} of the cells is beyond what it can be, at {}, at {:g} ms",
                    monodomain.state_name(static_cast<std::size_t>(first.what), tissue.regions[first.cell]),
                    place_of(first.cell), time_ms));
  }
}

void Excitation::advance(double time_ms, const TimeSteps& steps, bool first) {
  if (reaction_eikonal) reaction_eikonal->trigger(tissue, monodomain, parameters, time_ms, steps.dt_ms);
  if (bidomain)
    bidomain->advance(tissue, monodomain, parameters, time_ms, first);
  else
    monodomain.advance(tissue, parameters, time_ms, first);
}

// Nothing in it waits for the device but the fetch of samples that were taken one fetch ago, and the turns to
// and from the profiling queue, one fetch in sixteen.
void Excitation::march(const TimeSteps& steps, std::span<const Member> members,
                       std::span<Recording* const> recordings, double timeout_s, const Window& window) {
  const double end_ms = recorded_ms(scene), interval = sampling_interval_ms(scene);
  constexpr double rounding = 1e-9;
  const auto total_steps = static_cast<std::int64_t>(std::ceil(end_ms / steps.dt_ms - rounding));
  const int samples = samples_of(scene);
  const auto loop_start = Clock::now();

  monodomain.initialise(tissue, parameters, steps.dt_ms, steps.substeps);
  if (bidomain) bidomain->initialise();
  recorder.prepare(tissue, members);
  if (probes) probes->prepare(tissue, members);
  if (observation) observation->begin(launcher, tissue);
  const cl::Buffer* weights = lead_weights ? &lead_weights->weights() : nullptr;

  struct Fetch {
    int first, count;
  };
  std::optional<Fetch> pending;
  std::vector<double> net(members.size(), 0), moved(members.size(), 0);  // of charge, the most at any look
  const auto receive = [&](const Fetch& fetch, bool last) {
    const std::vector<double> rows = recorder.fetched(last);
    const auto width = static_cast<size_t>(recorder.quantities()) * members.size();
    std::vector<bool> was_done;
    for (const Recording* recording : recordings) was_done.push_back(recording->outcome == Outcome::done);
    for (int k = 0; k < fetch.count; ++k)
      writer.store_sample(fetch.first + k, std::min((fetch.first + k) * interval, end_ms),
                          rows.data() + static_cast<size_t>(k) * width, recordings);
    for (std::size_t m = 0; m < members.size(); ++m) {
      name_outcome(m, interval, *recordings[m], was_done[m]);
      net[m] = std::max(net[m], std::abs(recorder.looks()[m].net));
      moved[m] = std::max(moved[m], recorder.looks()[m].all);
    }
  };

  std::int64_t step = 0;
  bool stopped = window && !window(0);
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
      if (k == count - 1) recorder.look(tissue, monodomain);
      for (int n = 0; n < steps.per_sample && step < total_steps && !stopped; ++n) {
        advance(static_cast<double>(step) * steps.dt_ms, steps, step == 0);
        ++step;
        if (window && (step % window_steps(steps) == 0 || step == total_steps))
          stopped = !window(std::min(static_cast<double>(step) * steps.dt_ms, end_ms));
      }
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
        recording->reason = fmt::format("not finished after {:g} s: at {:g} of {:g} ms", timeout_s,
                                        recording->failed_at_ms, end_ms);
      }
      stopped = true;
    }
    stopped = stopped || std::all_of(recordings.begin(), recordings.end(),
                                     [](const Recording* r) { return r->outcome != Outcome::done; });
  }
  if (pending) receive(*pending, true);
  launcher.profile(false);
  for (std::size_t m = 0; m < members.size(); ++m) {
    spdlog::debug("member {}: of the charge that diffusion moves {:.2g} is left", members[m].id,
                  moved[m] > 0 ? net[m] / moved[m] : 0);
    if (recordings[m]->outcome == Outcome::done && net[m] > charge_tolerance * moved[m])
      end_unstable(
          *recordings[m], end_ms,
          fmt::format("charge is not conserved: {:.2g} of what diffusion moves is left over, at {:g} ms",
                      net[m] / moved[m], end_ms));
  }
  finish(members, recordings);
  const double share_s = seconds_since(loop_start) / static_cast<double>(members.size());
  for (size_t m = 0; m < members.size(); ++m) {
    recordings[m]->dt_ms = steps.dt_ms;
    recordings[m]->device_s = share_s;
    simulated_ms += static_cast<double>(step) * steps.dt_ms;
    cell_updates += static_cast<double>(step) * static_cast<double>(tissue.tissue_cells[m]);
  }
}

int Excitation::window_steps(const TimeSteps& steps) {
  constexpr double window_ms = 1, rounding = 1e-9;
  return std::max(1, static_cast<int>(window_ms / steps.dt_ms + rounding));
}

std::vector<float> Excitation::activation_times() {
  if (eikonal) return eikonal->activation(tissue, std::numeric_limits<float>::max());
  std::vector<float> times(static_cast<size_t>(tissue.stride));
  launcher.queue().enqueueReadBuffer(monodomain.activation(), CL_TRUE, 0, times.size() * sizeof(float),
                                     times.data());
  return times;
}

void Excitation::finish(std::span<const Member> members, std::span<Recording* const> recordings) {
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
    writer.store_features(tissue, activation, std::span<const float>(series).subspan(m * row, row), m,
                          members[m], *recordings[m]);
}

}  // namespace cohort
