#include "ensemble/half_steps.hpp"

namespace cohort {
namespace {

struct Change {
  std::size_t index;
  double factor;
};

/// 0 stands for a value that is chosen, and stays 0.
std::vector<Change> changes(const ParameterTable& table) {
  std::vector<const char*> paths = {"grid.dx_mm", "mechanics.dx_mm"};
  if (table.find("time.step_factor") >= 0)
    paths.push_back("time.step_factor");
  else
    paths.insert(paths.end(), {"time.dt_ms", "circulation.dt_ms"});
  std::vector<Change> result;
  for (const char* path : paths)
    if (const int index = table.find(path); index >= 0)
      result.push_back({static_cast<std::size_t>(index), 0.5});
  const int until = table.find("time.beats.until_periodic"), at_most = table.find("time.beats.at_most");
  if (until < 0 || table[until].value == 0 || table[at_most].value == 1) return result;
  result.push_back({static_cast<std::size_t>(until), 0.25});
  if (2 * table[at_most].value <= table[at_most].upper)
    result.push_back({static_cast<std::size_t>(at_most), 2});
  return result;
}

}  // namespace

Scene half_steps(Scene scene) {
  for (const auto& [index, factor] : changes(scene.parameters))
    scene.parameters[static_cast<int>(index)].value *= factor;
  return scene;
}

Member half_steps(const Scene& scene, Member member) {
  for (const auto& [index, factor] : changes(scene.parameters)) member.values[index] *= factor;
  return member;
}

}  // namespace cohort
