#include <algorithm>
#include <cmath>
#include <limits>

#include "solver/excitation.hpp"
#include "solver/pv_output.hpp"

namespace cohort {

namespace {
constexpr int fetches_per_profile = 16;  // one fetch in so many is timed kernel by kernel
}  // namespace

void Excitation::stop_unsolved(std::span<Recording* const> recordings, double time_ms) {
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
      writer.store_sample(fetch.first + k, std::min((fetch.first + k) * interval, end_ms),
                          rows.data() + static_cast<size_t>(k) * width, recordings);
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
        recording->reason = "not finished after " + std::to_string(timeout_s) + " s";
      }
      stopped = true;
    }
    stopped = stopped || std::all_of(recordings.begin(), recordings.end(),
                                     [](const Recording* r) { return r->outcome != Outcome::done; });
  }
  if (pending) receive(*pending, true);
  launcher.profile(false);
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
