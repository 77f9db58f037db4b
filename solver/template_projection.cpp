#include <algorithm>
#include <limits>

#include "solver/excitation.hpp"
#include "solver/pv_output.hpp"

namespace cohort {

void Excitation::project(std::span<const Member> members, std::span<Recording* const> recordings) {
  const auto start = Clock::now();
  const double end_ms = recorded_ms(scene), interval = sampling_interval_ms(scene);
  if (templates) {
    const std::vector<double> rows =
        templates->series(tissue, parameters, eikonal->arrival(), lead_weights->weights(), members);
    const auto width = static_cast<size_t>(recorder.quantities()) * members.size();
    for (int k = 0; k < writer.samples(); ++k)
      writer.store_sample(k, k * interval, rows.data() + static_cast<size_t>(k) * width, recordings);
    for (size_t m = 0; m < members.size(); ++m) {
      Recording& recording = *recordings[m];
      if (recording.outcome != Outcome::unstable || templates->silent(m).empty()) continue;
      reject(recording, templates->silent(m));
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
    writer.store_features(tissue, activation, {}, m, members[m], *recordings[m]);
    recordings[m]->dt_ms = templates ? templates->spacing_ms() : 0;
    recordings[m]->device_s = share_s;
    simulated_ms += end_ms;
  }
}

}  // namespace cohort
