#include "solver/template_cells.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "solver/heterogeneity.hpp"

namespace cohort {

namespace {

// tests/unit/eikonal_activation.cpp measures what it costs in accuracy.
constexpr int columns_of_a_range = 24;

/// Least and largest change of the varying parameter over a wall. The apico-basal coordinate leaves [0, 1] in
/// the apex and in the right outflow.
std::array<double, 2> range_of_change(const Scene& scene, const std::string& name,
                                      std::span<const double> values) {
  const auto slope = [&](const char* basis) {
    const int i = scene.parameters.find("electrophysiology.heterogeneity." + name + "." + basis);
    return i < 0 ? 0.0 : values[static_cast<size_t>(i)];
  };
  constexpr double lowest = -0.7, highest = 1.1;  // of apico-basal - 1/2
  const double wall = 0.5 * std::abs(slope("transmural")),
               around = std::hypot(slope("lateral"), slope("anterior"));
  const auto [apex, base] = std::minmax({lowest * slope("apico_basal"), highest * slope("apico_basal")});
  const auto [least, most] = std::minmax({slope("endocardial"), slope("midmyocardial"), slope("epicardial")});
  return {-wall - around + apex + least, wall + around + base + most};
}

int parameter_of(const CellModel& model, const std::string& name) {
  for (size_t k = 0; k < model.parameters.size(); ++k)
    if (model.parameters[k].path == name) return static_cast<int>(k);
  return -1;
}

}  // namespace

TemplateColumns template_columns(const Scene& scene) {
  const std::vector<bool> varies = heterogeneous_regions(scene);
  const CellModels models(scene);
  TemplateColumns columns;
  for (size_t r = 0; r < scene.regions.size(); ++r) {
    columns.first.push_back(columns.total);
    int count = scene.regions[r].excitable ? 1 : 0;
    if (count > 0 && varies[r] &&
        parameter_of(models.all()[static_cast<size_t>(models.of_region()[r])],
                     scene.heterogeneity.parameters.front()) >= 0)
      count = columns_of_a_range;
    columns.count.push_back(count);
    columns.total += count;
  }
  return columns;
}

std::vector<TemplateCells> template_cells(const Scene& scene, const CellModels& models,
                                          const RegionParameters& regions, const TemplateColumns& columns,
                                          std::span<const Member> members, std::vector<double>& ranges) {
  const auto threshold_of = [&](const Member& member) {
    return member
        .values[static_cast<size_t>(scene.parameters.index("electrophysiology.activation_threshold_mV"))];
  };
  std::vector<TemplateCells> batches(models.all().size());
  for (size_t m = 0; m < members.size(); ++m) {
    double reference = 0;
    bool first = true;
    for (size_t r = 0; r < scene.regions.size(); ++r) {
      if (columns.count[r] == 0) {
        ranges.insert(ranges.end(), {0, 0});
        continue;
      }
      const auto k = static_cast<size_t>(models.of_region()[r]);
      const CellModel& model = models.all()[k];
      const auto begin = members[m].values.begin() + regions.cell_first[r];
      std::vector<double> p(begin, begin + static_cast<std::ptrdiff_t>(model.parameters.size()));
      if (first) reference = p[static_cast<size_t>(model.rest)];
      first = false;
      double low = 0, high = 0;
      int varying = -1;
      if (columns.count[r] > 1) {
        const std::string& name = scene.heterogeneity.parameters.front();
        varying = parameter_of(model, name);
        const double own = p[static_cast<size_t>(varying)];
        const Parameter& declared = model.parameters[static_cast<size_t>(varying)];
        const auto change = range_of_change(scene, name, members[m].values);
        const auto within = [&](double value) {
          return std::clamp(value, std::min(declared.lower, own), std::max(declared.upper, own));
        };
        low = within(own + change[0]);
        high = within(own + change[1]);
      }
      ranges.insert(ranges.end(), {low, high});
      for (int c = 0; c < columns.count[r]; ++c) {
        if (varying >= 0) p[static_cast<size_t>(varying)] = low + (high - low) * c / (columns.count[r] - 1);
        TemplateCells& batch = batches[k];
        batch.parameters.insert(batch.parameters.end(), p.begin(), p.end());
        batch.threshold.push_back(threshold_of(members[m]));
        batch.reference.push_back(reference);
        batch.step_factor.push_back(
            members[m].values[static_cast<size_t>(scene.parameters.index("time.step_factor"))]);
        batch.columns.push_back(static_cast<int>(m) * columns.total + columns.first[r] + c);
      }
    }
  }
  return batches;
}

Launcher::Handle template_columns_kernel(Launcher& launcher, const Scene& scene,
                                         const Definitions& definitions) {
  const CellModels models(scene);
  const RegionParameters regions = region_parameters(scene);
  std::vector<std::string> options = definitions.options;
  options.push_back("HETEROGENEOUS");
  options.push_back("REGIONS=" + std::to_string(scene.regions.size()));
  options.push_back("VARYING=P_" + scene.heterogeneity.parameters.front());
  const auto table = [](const std::string& name, const auto& numbers) {
    std::string text = "constant int " + name + "[] = {";
    for (const auto number : numbers) text += std::to_string(static_cast<int>(number)) + ",";
    return text + "};\n";
  };
  const std::vector<bool> varies = heterogeneous_regions(scene);
  std::vector<std::string> files = {"segments.clh", "heterogeneity.clh"};
  const std::vector<int> no_field(models.derived(), -1);
  for (const std::string& part : models.parts(scene, "template_columns.clh", no_field)) files.push_back(part);
  files.emplace_back("template_columns.cl");
  return launcher.handle(
      launcher.device().build(files, options,
                              definitions.generated + table("region_model", models.of_region()) +
                                  table("region_cell_first", regions.cell_first) +
                                  table("region_varies", varies)),
      "template_columns");
}

std::string silent_column(const Scene& scene, const TemplateColumns& columns, int column,
                          double threshold_mV) {
  std::size_t r = 0;
  while (column < columns.first[r] || column >= columns.first[r] + columns.count[r]) ++r;
  std::ostringstream text;
  text << "cells of region \"" << scene.regions[r].name
       << "\" do not rise through electrophysiology.activation_threshold_mV (" << threshold_mV
       << ") when they are stimulated: they have no action potential";
  return text.str();
}

}  // namespace cohort
