#include "solver/stimulus.hpp"

#include <algorithm>
#include <cmath>

#include "solver/geometry.hpp"

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
    s.resize(stimulus_numbers, 0.0);
    block.insert(block.end(), s.begin(), s.end());
  }
  return block;
}

bool stimulus_on(std::span<const double> block, double time, double dt) {
  for (size_t first = 0; first + stimulus_numbers <= block.size(); first += stimulus_numbers) {
    const double start = block[first], duration = block[first + 1], period = block[first + 2];
    const auto overlaps = [&](double pulse) { return pulse < time + dt && pulse + duration > time; };
    if (period <= 0) {
      if (overlaps(start)) return true;
      continue;
    }
    const double latest =
        std::clamp(std::floor((time + dt - start) / period), 0.0, std::floor(block[first + 3]) - 1);
    for (double pulse = latest; pulse >= 0 && start + pulse * period + duration > time; --pulse)
      if (overlaps(start + pulse * period)) return true;
  }
  return false;
}

}  // namespace cohort
