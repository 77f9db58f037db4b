#include "solver/heterogeneity.hpp"

#include <algorithm>
#include <array>
#include <iomanip>
#include <sstream>
#include <stdexcept>

#include "solver/cell_models.hpp"
#include "solver/labels.hpp"

namespace cohort {

namespace {

const std::string root = "electrophysiology.heterogeneity.";

// In the order of wall_basis() in kernels/heterogeneity.clh.
constexpr std::array all_bases = {"transmural",  "apico_basal",   "lateral",   "anterior",
                                  "endocardial", "midmyocardial", "epicardial"};

const Parameter* find(const CellModel& model, const std::string& name) {
  const auto it = std::find_if(model.parameters.begin(), model.parameters.end(),
                               [&](const Parameter& p) { return p.path == name; });
  return it == model.parameters.end() ? nullptr : &*it;
}

std::string literal(double value) {
  std::ostringstream text;
  text << std::setprecision(17) << std::scientific << value;
  return "R(" + text.str() + ")";
}

}  // namespace

bool has_wall(const Scene& scene, const Region& region) {
  return region.excitable && region.fibres == Region::Fibres::transmural &&
         scene.geometry != GeometryKind::box;
}

std::vector<std::string> layer_bounds() {
  return {"endocardial_until", "epicardial_from"};
}

std::string layer_defect(const Scene& scene, std::span<const double> values) {
  if (scene.heterogeneity.parameters.empty()) return {};
  const auto value = [&](const std::string& name) {
    return values[static_cast<size_t>(scene.parameters.index(root + name))];
  };
  const double inner = value("endocardial_until"), outer = value("epicardial_from");
  if (inner <= outer) return {};
  std::ostringstream text;
  text << root << "endocardial_until (" << inner << ") lies beyond epicardial_from (" << outer
       << "): the layers of the wall cross";
  return text.str();
}

std::vector<std::string> heterogeneity_bases(const Scene& scene) {
  if (scene.geometry == GeometryKind::box) return {};
  // Shapes have a wall, but neither an apex nor an axis.
  if (scene.geometry == GeometryKind::shapes)
    return {"transmural", "endocardial", "midmyocardial", "epicardial"};
  return {all_bases.begin(), all_bases.end()};
}

std::vector<bool> heterogeneous_regions(const Scene& scene) {
  std::vector<bool> result;
  const std::vector<std::string>& named = scene.heterogeneity.regions;
  const bool any = !scene.heterogeneity.parameters.empty();
  const bool labelled =
      scene.geometry == GeometryKind::labels && (scene.labels->has("lv") || scene.labels->has("rv"));
  const bool of_heart = scene.geometry == GeometryKind::heart || labelled;
  for (const Region& region : scene.regions) {
    const bool chosen = !named.empty() ? std::find(named.begin(), named.end(), region.name) != named.end()
                        : of_heart     ? region.name == "lv" || region.name == "rv"
                                       : has_wall(scene, region);
    result.push_back(any && chosen);
  }
  return result;
}

void declare_heterogeneity(Scene& scene) {
  if (scene.heterogeneity.parameters.empty()) return;
  const std::vector<bool> regions = heterogeneous_regions(scene);
  for (const std::string& name : scene.heterogeneity.regions) {
    const auto region = std::find_if(scene.regions.begin(), scene.regions.end(),
                                     [&](const Region& r) { return r.name == name; });
    if (region == scene.regions.end())
      throw std::invalid_argument("electrophysiology.heterogeneity.regions: no region \"" + name + "\"");
    if (!has_wall(scene, *region))
      throw std::invalid_argument("electrophysiology.heterogeneity.regions: region \"" + name +
                                  "\" has no wall with an inner and an outer surface");
  }
  if (std::find(regions.begin(), regions.end(), true) == regions.end())
    throw std::invalid_argument("electrophysiology.heterogeneity: no region has a wall to vary through");

  const CellModels models(scene);
  ParameterTable& table = scene.parameters;
  const char* source = "none unless set";
  for (const std::string& name : scene.heterogeneity.parameters) {
    const Parameter* widest = nullptr;
    for (size_t r = 0; r < regions.size(); ++r) {
      if (!regions[r]) continue;
      const Parameter* own = find(models.all()[static_cast<size_t>(models.of_region()[r])], name);
      if (own && (!widest || own->upper - own->lower > widest->upper - widest->lower)) widest = own;
    }
    if (!widest)
      throw std::invalid_argument("electrophysiology.heterogeneity." + name +
                                  ": no cell model of its regions has that parameter");
    const double width = widest->upper - widest->lower;
    for (const std::string& basis : heterogeneity_bases(scene))
      table.add({root + name + "." + basis, widest->unit, 0, -width, width,
                 "change of " + name + " along the basis " + basis, source});
  }
  const char* layers = "three equal layers, a convention";
  table.add({root + "endocardial_until", "1", 1.0 / 3, 0, 1,
             "transmural coordinate where the inner layer ends", layers});
  table.add({root + "epicardial_from", "1", 2.0 / 3, 0, 1,
             "transmural coordinate where the outer layer begins", layers});
}

std::string heterogeneity_source(const Scene& scene, const CellModel& model) {
  std::string body;
  for (size_t k = 0; k < model.parameters.size(); ++k) {
    const Parameter& p = model.parameters[k];
    const std::vector<std::string>& varying = scene.heterogeneity.parameters;
    if (std::find(varying.begin(), varying.end(), p.path) == varying.end()) continue;
    std::string change;
    for (const std::string& basis : heterogeneity_bases(scene)) {
      const auto place = std::find(all_bases.begin(), all_bases.end(), basis) - all_bases.begin();
      change += (change.empty() ? "P[" : " + P[") +
                std::to_string(scene.parameters.index(root + p.path + "." + basis)) + "] * basis[" +
                std::to_string(place) + "]";
    }
    body += "p[" + std::to_string(k) + "] = shifted(p[" + std::to_string(k) + "], " + change + ", " +
            literal(p.lower) + ", " + literal(p.upper) + "); ";
  }
  return body.empty() ? "" : "#define HETEROGENEITY(p, P, basis) do { " + body + "} while (0)\n";
}

bool has_slope(const Scene& scene, const std::string& name, const std::vector<double>& values) {
  const std::vector<std::string>& varying = scene.heterogeneity.parameters;
  if (std::find(varying.begin(), varying.end(), name) == varying.end()) return false;
  const std::vector<std::string> bases = heterogeneity_bases(scene);
  return std::any_of(bases.begin(), bases.end(), [&](const std::string& basis) {
    return values[static_cast<size_t>(scene.parameters.index(root + name + "." + basis))] != 0;
  });
}

}  // namespace cohort
