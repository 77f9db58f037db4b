#include "solver/recording_writer.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "solver/ecg_features.hpp"
#include "solver/energy_balance.hpp"
#include "solver/features.hpp"
#include "solver/pv_features.hpp"
#include "solver/pv_output.hpp"
#include "solver/time_steps.hpp"

namespace cohort {

Layout layout(const Scene& scene) {
  Layout result;
  if (scene.ecg) {
    result.leads = {"I", "II", "III", "aVR", "aVL", "aVF", "V1", "V2", "V3", "V4", "V5", "V6"};
    const double interval = sampling_interval_ms(scene);
    for (int k = 0; k < samples_of(scene); ++k) result.ecg_ms.push_back(k * interval);
  }
  result.compartments = pv_compartments(scene);
  result.pv_ms = pv_times_ms(scene);
  if (scene.displacement) result.points = scene.displacement->points;
  result.displacement_ms = displacement_times_ms(scene);

  const auto add = [&](const std::vector<std::pair<std::string, std::string>>& features) {
    for (const auto& [name, unit] : features) {
      result.features.push_back(name);
      result.feature_units.push_back(unit);
    }
  };
  add(activation_feature_names(scene));
  if (scene.ecg) add(ecg_feature_names());
  if (scene.pv) add(pv_feature_names(result.compartments));
  add(heart_check_names(scene));
  add(energy_names(scene));
  return result;
}

RecordingWriter::RecordingWriter(const Scene& scene, int quantities)
    : scene_(scene), layout_(layout(scene)), quantities_(quantities) {}

Recording blank_recording(const Scene& scene) {
  constexpr float nothing = std::numeric_limits<float>::quiet_NaN();
  const Layout shapes = layout(scene);
  Recording recording;
  recording.outcome = Outcome::done;
  if (scene.geometry != GeometryKind::none) recording.dx_mm = scene.parameters.value("grid.dx_mm");
  recording.ecg.assign(shapes.leads.size() * shapes.ecg_ms.size(), nothing);
  recording.pressure.assign(shapes.compartments.size() * shapes.pv_ms.size(), nothing);
  recording.volume = recording.pressure;
  recording.displacement.assign(shapes.points.size() * 3 * shapes.displacement_ms.size(), nothing);
  recording.features.assign(shapes.features.size(), nothing);
  return recording;
}

// One sample of every member: eight leads to twelve, and the check.
void RecordingWriter::store_sample(int sample, double time_ms, const double* row,
                                   std::span<Recording* const> recordings) const {
  for (Recording* recording : recordings) {
    const double wild = row[quantities_ - 1];
    if (wild > 0 || std::isnan(wild)) {
      if (recording->outcome == Outcome::done) {
        end_unstable(*recording, time_ms,
                     fmt::format("the potential is out of bounds, or no number, in {:.0f} cells, at {:g} ms",
                                 wild, time_ms));
      }
    } else if (scene_.ecg && sample < static_cast<int>(layout_.ecg_ms.size()) &&
               recording->outcome == Outcome::done) {
      const std::size_t samples = layout_.ecg_ms.size();
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
    row += quantities_;
  }
}

// Features of a member that is done, in the order of layout(), but for those of pressures and volumes.
void RecordingWriter::store_features(const Tissue& tissue, std::span<const float> activation,
                                     std::span<const float> probe_potential, std::size_t m,
                                     const Member& member, Recording& recording) const {
  if (recording.outcome != Outcome::done) return;
  std::vector<float> features;
  if (scene_.activation)
    features = activation_features(scene_, tissue, activation, m, member.values, probe_potential);
  if (scene_.ecg) {
    const std::vector<float> measured = ecg_features(recording.ecg, sampling_interval_ms(scene_));
    features.insert(features.end(), measured.begin(), measured.end());
  }
  std::copy(features.begin(), features.end(), recording.features.begin());
}

void end_unstable(Recording& recording, double time_ms, const std::string& reason) {
  recording.outcome = Outcome::unstable;
  recording.reason = reason;
  recording.failed_at_ms = time_ms;
}

void reject(Recording& recording, const std::string& reason) {
  recording.outcome = Outcome::rejected;
  recording.reason = reason;
  recording.failed_at_ms = 0;
}

}  // namespace cohort
