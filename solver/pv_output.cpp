#include "solver/pv_output.hpp"

#include <cmath>

#include "solver/pv_features.hpp"

namespace cohort {

namespace {

std::vector<double> times_ms(const Scene& scene, const std::string& rate) {
  if (scene.mechanics && scene.mechanics->quasi_static) return {0};
  constexpr double rounding = 1e-9;
  const double interval = 1000 / scene.parameters.value(rate);
  const auto samples = static_cast<int>(std::ceil(recorded_ms(scene) / interval - rounding));
  std::vector<double> times;
  for (int k = 0; k < samples; ++k) times.push_back(k * interval);
  return times;
}

}  // namespace

void declare_pv_outputs(Scene& scene) {
  const auto add_rate = [&](const std::string& output, double rate, const std::string& meaning,
                            const std::string& source) {
    Parameter parameter{"outputs." + output + ".rate_hz", "Hz", rate, 1, 1e5, meaning, source};
    parameter.structural = true;
    scene.parameters.add(parameter);
  };
  if (scene.pv)
    add_rate("pv", 1000, "samples of pressure and volume in a second",
             "measured: the largest dP/dt to 1.5 %");
  if (!scene.displacement) return;
  add_rate("displacement", 100, "samples of displacement in a second", "chosen");
  for (const std::string& point : scene.displacement->points) {
    Parameter place{"outputs.displacement.points." + point + "_mm",           "mm",       0, -1e4, 1e4,
                    "place, before any load, whose displacement is recorded", "the scene"};
    place.structural = true;
    scene.parameters.add_vector(place, 0, 0, 0);
  }
}

std::vector<std::string> pv_compartments(const Scene& scene) {
  if (!scene.pv) return {};
  if (scene.circulation && scene.circulation->kind == Circulation::Kind::closed_loop)
    return {"LV", "RV", "LA", "RA", "aorta", "pulmonary_artery"};
  if (scene.circulation) return {"LV", "aorta"};
  std::vector<std::string> names;
  if (scene.mechanics)
    for (const Mechanics::Cavity& cavity : scene.mechanics->cavities) names.push_back(cavity.name);
  return names;
}

double recorded_ms(const Scene& scene) {
  return scene.parameters.value(scene.beats ? "time.beats.length_ms" : "time.end_ms");
}

std::vector<double> pv_times_ms(const Scene& scene) {
  return scene.pv ? times_ms(scene, "outputs.pv.rate_hz") : std::vector<double>();
}

std::vector<double> displacement_times_ms(const Scene& scene) {
  return scene.displacement ? times_ms(scene, "outputs.displacement.rate_hz") : std::vector<double>();
}

std::vector<std::pair<std::string, std::string>> heart_check_names(const Scene& scene) {
  if (!scene.circulation || !scene.pv) return {};
  std::vector<std::pair<std::string, std::string>> names = {{"beats", "1"}, {"beat_difference", "1"}};
  if (scene.mechanics)
    names.insert(names.end(), {{"valve_switches", "1"},
                               {"ringing_mmHg", "mmHg"},
                               {"blood_apart_mL", "mL"},
                               {"smallest_volume_ratio", "1"}});
  return names;
}

std::vector<float> recorded_pv_features(const Scene& scene, const Recording& recording,
                                        std::span<const double> values) {
  if (!scene.pv) return {};
  const auto value = [&](const std::string& path) {
    const int index = scene.parameters.find(path);
    return index < 0 ? std::nan("") : values[static_cast<std::size_t>(index)];
  };
  const std::vector<std::string> compartments = pv_compartments(scene);
  return pv_features({compartments, recording.pressure, recording.volume, 1000 / value("outputs.pv.rate_hz"),
                      value(scene.beats ? "time.beats.length_ms" : "time.beat_ms"),
                      value("circulation.windkessel.filling_pressure_mmHg")});
}

}  // namespace cohort
