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
  std::vector<std::string> result = {before};
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

}  // namespace cohort
