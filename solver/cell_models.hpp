#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "solver/cell_model.hpp"
#include "solver/scene.hpp"

namespace cohort {

/// The cell models that the excitable regions of a scene have: one, or several where regions name their own
/// (Scene::region_cell_models). A kernel program holds all of them, one behind the other.
class CellModels {
 public:
  /// Needs scene.regions.
  explicit CellModels(const Scene& scene);

  const std::vector<CellModel>& all() const { return models_; }
  /// By region: index into all(), -1 where it is not excitable.
  const std::vector<int>& of_region() const { return of_region_; }
  /// States of the model that has most: every cell has room for so many.
  std::size_t states() const;
  /// Derived constants of all models together, model after model.
  std::size_t derived() const;

  /// Parts of a program for Device::build: for each model its macros, its file and `shared`, a file of
  /// kernels/ written against one model; then  CELL_MODELS, EACH_CELL_MODEL(visit)  visit(0) visit(1) ...
  /// Around model k stand its macros (CellModel::macros), CELL_MODEL k, CELL_FIRST (parameter index of its
  /// first parameter), DERIVED_FIRST, and LOAD_DERIVED(d, member, i), STORE_DERIVED_FIELDS(d,
  /// i), where field_of tells for each of the derived() constants its field or -1; cell_derive,
  /// cell_fastest_rate and cell_step of model k are cell_derive_<k>, ...  HETEROGENEITY as
  /// heterogeneity_source() says.
  std::vector<std::string> parts(const Scene& scene, const std::string& shared,
                                 std::span<const int> field_of) const;

 private:
  std::vector<CellModel> models_;
  std::vector<int> of_region_;
};

/// Between which the potential of a member stays (mV): of the models of its regions, and as much beyond as
/// stimuli add.
std::array<double, 2> potential_bounds(const Scene& scene, const CellModels& models,
                                       std::span<const double> values);

}  // namespace cohort
