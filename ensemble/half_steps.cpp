#include "ensemble/half_steps.hpp"

namespace cohort {
namespace {

/// Indices of what is halved. 0 stands for a value that is chosen, and stays 0.
std::vector<std::size_t> halved(const ParameterTable& table) {
  std::vector<const char*> paths = {"grid.dx_mm", "mechanics.dx_mm"};
  if (table.find("time.step_factor") >= 0)
    paths.push_back("time.step_factor");
  else
    paths.insert(paths.end(), {"time.dt_ms", "circulation.dt_ms"});
  std::vector<std::size_t> indices;
  for (const char* path : paths)
    if (const int index = table.find(path); index >= 0) indices.push_back(static_cast<std::size_t>(index));
  return indices;
}

}  // namespace

Scene half_steps(Scene scene) {
  for (const auto index : halved(scene.parameters)) scene.parameters[static_cast<int>(index)].value /= 2;
  return scene;
}

Member half_steps(const Scene& scene, Member member) {
  for (const auto index : halved(scene.parameters)) member.values[index] /= 2;
  return member;
}

}  // namespace cohort
