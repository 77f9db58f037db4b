#include "solver/stimulus.hpp"

#include <algorithm>
#include <cmath>

#include "solver/geometry.hpp"
#include "solver/pv_output.hpp"

namespace cohort {

std::vector<double> stimulus_block(const Scene& scene, std::span<const double> values) {
  std::vector<double> block;
  for (const Stimulus& stimulus : scene.stimuli) {
    const auto value = [&](const std::string& name) {
      return values[static_cast<size_t>(scene.parameters.index("stimuli." + stimulus.name + "." + name))];
    };
    std::vector<double> s = {value("start_ms"), value("duration_ms"), value("period_ms"), value("count"),
                             value("amplitude_mV_per_ms")};
    switch (stimulus.kind) {
      case Stimulus::Kind::box:
        s.push_back(0);
        for (const char* corner : {"lower_mm", "upper_mm"})
          for (const char* axis : {".x", ".y", ".z"}) s.push_back(value(std::string(corner) + axis));
        break;
      case Stimulus::Kind::sphere:
        s.push_back(1);
        for (const char* axis : {".x", ".y", ".z"}) s.push_back(value(std::string("centre_mm") + axis));
        s.push_back(value("radius_mm"));
        break;
      case Stimulus::Kind::site: {
        s.push_back(1);
        const Sphere sphere = site(scene, stimulus.site, values);
        s.insert(s.end(), sphere.centre.begin(), sphere.centre.end());
        s.push_back(value("radius_mm"));
        break;
      }
    }
    s.resize(stimulus_numbers - 1, 0.0);
    s.push_back(value("s2_interval_ms"));
    block.insert(block.end(), s.begin(), s.end());
  }
  return block;
}

bool stimulus_on(std::span<const double> block, double time, double dt) {
  for (size_t first = 0; first + stimulus_numbers <= block.size(); first += stimulus_numbers) {
    const double start = block[first], duration = block[first + 1], period = block[first + 2];
    const auto overlaps = [&](double pulse) { return pulse < time + dt && pulse + duration > time; };
    const double pulses = period > 0 ? std::floor(block[first + 3]) : 1;
    const double s2_interval = block[first + 12];
    if (s2_interval > 0 && overlaps(start + (pulses - 1) * period + s2_interval)) return true;
    if (period <= 0) {
      if (overlaps(start)) return true;
      continue;
    }
    const double latest = std::clamp(std::floor((time + dt - start) / period), 0.0, pulses - 1);
    for (double pulse = latest; pulse >= 0 && start + pulse * period + duration > time; --pulse)
      if (overlaps(start + pulse * period)) return true;
  }
  return false;
}

std::vector<std::string> stimulus_warnings(const Scene& scene, std::span<const double> values) {
  const auto value = [&](const std::string& path) {
    return values[static_cast<size_t>(scene.parameters.index(path))];
  };
  const double end = recorded_ms(scene);
  const std::string end_name = scene.beats ? "time.beats.length_ms" : "time.end_ms";
  std::vector<std::string> warnings;
  for (const Stimulus& stimulus : scene.stimuli) {
    const auto own = [&](const char* name) { return value("stimuli." + stimulus.name + "." + name); };
    const auto warn = [&](const std::string& what) {
      warnings.push_back("stimulus \"" + stimulus.name + "\" " + what);
    };
    const double start = own("start_ms"), period = own("period_ms"), pulses = std::floor(own("count"));
    const double last = start + (period > 0 ? (pulses - 1) * period : 0) + own("s2_interval_ms");
    if (start >= end)
      warn("never fires: start_ms is not before " + end_name);
    else if (last >= end)
      warn("does not fire to its last pulse, which would start at " + end_name + " or later");
    if (own("amplitude_mV_per_ms") == 0) warn("does nothing: amplitude_mV_per_ms is 0");
    if (period <= 0 && pulses > 1) warn("fires once: count without period_ms is no train");
    if (period > 0 && pulses < 2) warn("fires once: period_ms without count is no train");
    if (period > 0 && pulses > 1 && own("duration_ms") > period)
      warn("overlaps itself: duration_ms is longer than period_ms");
  }
  const std::string current = "electrophysiology.boundary_current_";
  if (scene.parameters.find(current + "duration_ms") < 0) return warnings;  // not the bidomain equations
  bool flows = false;
  for (const char* axis : {".x", ".y", ".z"}) flows = flows || value(current + "uA_per_mm2" + axis) != 0;
  if (flows && value(current + "duration_ms") <= 0)
    warnings.emplace_back("the boundary current never flows: boundary_current_duration_ms is 0");
  else if (flows && value(current + "start_ms") >= end)
    warnings.push_back("the boundary current never flows: boundary_current_start_ms is not before " +
                       end_name);
  else if (!flows && value(current + "duration_ms") > 0)
    warnings.emplace_back("the boundary current never flows: boundary_current_uA_per_mm2 is 0");
  return warnings;
}

}  // namespace cohort
