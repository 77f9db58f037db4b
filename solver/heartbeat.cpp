#include "solver/heartbeat.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "solver/circulation.hpp"
#include "solver/excitation.hpp"
#include "solver/pv_output.hpp"

namespace cohort {

std::size_t Heartbeat::bytes(const Scene& scene, int members_per_batch) {
  return LumpedCirculation::bytes(scene, members_per_batch, pv_times_ms(scene).size()) +
         static_cast<std::size_t>(members_per_batch * scene.parameters.size()) * real_bytes(scene.precision);
}

Heartbeat::Heartbeat(Launcher& launcher, const Scene& scene, int members_per_batch)
    : launcher_(launcher),
      scene_(scene),
      circulation_(launcher, scene, members_per_batch, pv_times_ms(scene).size()),
      parameters_(
          launcher.device().allocate(static_cast<std::size_t>(members_per_batch * scene.parameters.size()) *
                                     real_bytes(scene.precision))) {}

void Heartbeat::run(std::span<const Member> members, std::span<Recording> recordings, double timeout_s) {
  const auto start = Clock::now();
  std::vector<std::size_t> beating;  // of the batch
  std::vector<double> values;
  for (std::size_t m = 0; m < members.size(); ++m) {
    if (recordings[m].outcome != Outcome::done) continue;
    if (const std::string why = circulation_defect(scene_, members[m].values); !why.empty()) {
      reject(recordings[m], why);
      continue;
    }
    beating.push_back(m);
    values.insert(values.end(), members[m].values.begin(), members[m].values.end());
  }
  if (beating.empty()) return;
  const std::vector<std::byte> packed = pack(values, scene_.precision);
  launcher_.queue().enqueueWriteBuffer(parameters_, CL_TRUE, 0, packed.size(), packed.data());
  circulation_.initialise(parameters_, static_cast<int>(beating.size()));

  launcher_.profile(batches_++ == 1);  // the first batch compiles
  // A beat at a time. What deforms stands between the steps of the circulation, in launches of its own.
  std::vector<HeartStatus> status;
  bool running = true, late = false;
  while (running && !late) {
    circulation_.advance(parameters_, circulation_.steps_of_beat());
    status = circulation_.status();
    running = std::any_of(status.begin(), status.end(),
                          [](const HeartStatus& s) { return s.ended == HeartEnd::running; });
    late = seconds_since(start) > timeout_s;
  }
  launcher_.profile(false);
  const std::vector<float> pressure = circulation_.pressure(), volume = circulation_.volume();
  const std::size_t row = pressure.size() / beating.size();
  const double share_s = seconds_since(start) / static_cast<double>(beating.size());
  for (std::size_t k = 0; k < beating.size(); ++k) {
    Recording& recording = recordings[beating[k]];
    recording.device_s += share_s;
    simulated_ms_ += static_cast<double>(status[k].ended_ms);
    if (status[k].ended == HeartEnd::running) {
      recording.outcome = Outcome::timeout;
      recording.failed_at_ms = status[k].beats * beat_ms(scene_);
      recording.reason = "not finished after " + std::to_string(timeout_s) + " s";
      continue;
    }
    store(members[beating[k]], status[k], std::span(pressure).subspan(k * row, row),
          std::span(volume).subspan(k * row, row), recording);
  }
}

void Heartbeat::store(const Member& member, const HeartStatus& status, std::span<const float> pressure,
                      std::span<const float> volume, Recording& recording) const {
  recording.pressure.assign(pressure.begin(), pressure.end());
  recording.volume.assign(volume.begin(), volume.end());
  if (recording.dt_ms == 0) recording.dt_ms = circulation_.dt_ms();
  if (status.ended == HeartEnd::unstable) {
    recording.outcome = Outcome::unstable;
    recording.failed_at_ms = static_cast<double>(status.ended_ms);
    recording.reason = instability(scene_, status);
    return;
  }
  if (scene_.beats && !(status.difference <= scene_.parameters.value("time.beats.until_periodic")))
    spdlog::warn("member {}: after {} beats the last two differ by {:.2g}: not periodic to {:.2g}", member.id,
                 status.beats, status.difference, scene_.parameters.value("time.beats.until_periodic"));
  const std::vector<float> features = recorded_pv_features(scene_, recording, member.values);
  std::copy(features.rbegin(), features.rend(), recording.features.rbegin());  // the last of layout()
}

}  // namespace cohort
