#include "solver/cell_models.hpp"

#include <algorithm>
#include <sstream>

#include "solver/electrophysiology.hpp"
#include "solver/heterogeneity.hpp"

namespace cohort {

namespace {

// A call would pass states and constants through memory.
const std::string inlined =
    "void cell_step(realv *V, realv *state, const realv *d, real dt, realv stimulus) "
    "__attribute__((always_inline));\n";

/// #undef of every macro that `text` defines.
std::string undefine(const std::string& text) {
  std::istringstream lines(text);
  std::string result;
  for (std::string line; std::getline(lines, line);) {
    const std::string define = "#define ";
    if (!line.starts_with(define)) continue;
    result += "#undef " +
              line.substr(define.size(), line.find_first_of(" (", define.size()) - define.size()) + "\n";
  }
  return result;
}

}  // namespace

CellModels::CellModels(const Scene& scene) {
  for (const Region& region : scene.regions) {
    of_region_.push_back(-1);
    if (!region.excitable) continue;
    const auto own = scene.region_cell_models.find(region.name);
    const std::string& name = own == scene.region_cell_models.end() ? scene.cell_model : own->second;
    const auto known = std::find_if(models_.begin(), models_.end(),
                                    [&](const CellModel& model) { return model.name == name; });
    of_region_.back() = static_cast<int>(known - models_.begin());
    if (known == models_.end()) models_.push_back(read_cell_model(name));
  }
  if (models_.empty()) models_.push_back(read_cell_model(scene.cell_model));
}

std::size_t CellModels::states() const {
  std::size_t most = 0;
  for (const CellModel& model : models_) most = std::max(most, model.states.size());
  return most;
}

std::size_t CellModels::derived() const {
  std::size_t sum = 0;
  for (const CellModel& model : models_) sum += model.derived.size();
  return sum;
}

std::vector<std::string> CellModels::parts(const Scene& scene, const std::string& shared,
                                           std::span<const int> field_of) const {
  const RegionParameters regions = region_parameters(scene);
  std::string before = "#define CELL_MODELS " + std::to_string(models_.size()) + "\n", each;
  for (const char* function : {"cell_derive", "cell_fastest_rate", "cell_step"})
    before += std::string("#define ") + function + " JOIN(" + function + "_, CELL_MODEL)\n";
  std::vector<std::string> result = {before, "gates.clh"};
  std::size_t first = 0;
  for (std::size_t m = 0; m < models_.size(); ++m) {
    const CellModel& model = models_[m];
    std::string load = "#define LOAD_DERIVED(d, member, i) do { ";
    std::string store = "#define STORE_DERIVED_FIELDS(d, i) do { ";
    for (std::size_t k = 0; k < model.derived.size(); ++k) {
      const int field = field_of[first + k];
      const std::string place = std::to_string(field) + " * (size_t)stride + (i)",
                        d = "d[" + std::to_string(k) + "]";
      load += d + " = " +
              (field >= 0 ? "LOAD(derived_fields + " + place + "); "
                          : "DERIVED_CONSTANT(derived, member, " + std::to_string(first + k) + "); ");
      if (field >= 0) store += "derived_fields[" + place + "] = " + d + "; ";
    }
    const std::string macros = "#define CELL_MODEL " + std::to_string(m) + "\n" + model.macros() +
                               "#define CELL_FIRST " + std::to_string(regions.model_first[m]) +
                               "\n#define DERIVED_FIRST " + std::to_string(first) + "\n" + load +
                               "} while (0)\n" + store + "} while (0)\n" + heterogeneity_source(scene, model);
    result.insert(result.end(), {macros + inlined, "cells/" + model.name + ".cl", shared, undefine(macros)});
    first += model.derived.size();
    each += " visit(" + std::to_string(m) + ")";
  }
  result.push_back("#define EACH_CELL_MODEL(visit)" + each + "\n");
  return result;
}

std::array<double, 2> potential_bounds(const Scene& scene, const CellModels& models,
                                       std::span<const double> values) {
  constexpr double widest_mV = 1000;
  // Beside electrodes in a bath there is no bound of the cells alone.
  if (scene.activation_method == ActivationMethod::bidomain) return {-widest_mV, widest_mV};
  const RegionParameters regions = region_parameters(scene);
  double lowest = widest_mV, highest = -widest_mV;
  for (std::size_t r = 0; r < scene.regions.size(); ++r) {
    if (models.of_region()[r] < 0) continue;
    const CellModel& model = models.all()[static_cast<std::size_t>(models.of_region()[r])];
    const auto own = values.subspan(static_cast<std::size_t>(regions.cell_first[r]), model.parameters.size());
    const bool scaled = model.potential_unit >= 0;
    const double unit = scaled ? own[static_cast<std::size_t>(model.potential_unit)] : 1,
                 from = scaled ? own[static_cast<std::size_t>(model.rest)] : 0;
    lowest = std::min(lowest, from + unit * model.lowest_potential);
    highest = std::max(highest, from + unit * model.highest_potential);
  }
  for (const Stimulus& stimulus : scene.stimuli) {
    const auto value = [&](const char* name) {
      return values[static_cast<std::size_t>(
          scene.parameters.index("stimuli." + stimulus.name + "." + name))];
    };
    const double lifts_mV = value("amplitude_mV_per_ms") * value("duration_ms");
    lowest += std::min(lifts_mV, 0.0);
    highest += std::max(lifts_mV, 0.0);
  }
  return {std::max(lowest, -widest_mV), std::min(highest, widest_mV)};
}

}  // namespace cohort
