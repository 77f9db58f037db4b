#pragma once

#include <span>
#include <string>
#include <vector>

#include "solver/cell_models.hpp"
#include "solver/electrophysiology.hpp"
#include "solver/launch.hpp"
#include "solver/tissue.hpp"

// Single cells that stand for those of a tissue, behind their arrival times: what TemplateEcg projects and
// what TensionDrive drives tensions with.
namespace cohort {

/// Columns of a table of templates: one of each excitable region, or several over the range of the one cell
/// parameter that varies through its wall.
struct TemplateColumns {
  std::vector<int> first, count;  ///< by region; count 0 where it is not excitable
  int total = 0;
};
TemplateColumns template_columns(const Scene& scene);

/// The cells of one cell model: rows of its parameters, the member's time.step_factor, and the column of the
/// table that each fills.
struct TemplateCells {
  std::vector<double> parameters, threshold, reference, step_factor;
  std::vector<int> columns;
};
/// By model of CellModels, the cells of all members: column m columns.total + ... of member m. ranges
/// (members, regions, 2): the varying parameter at the first and the last column of a region.
std::vector<TemplateCells> template_cells(const Scene& scene, const CellModels& models,
                                          const RegionParameters& regions, const TemplateColumns& columns,
                                          std::span<const Member> members, std::vector<double>& ranges);

/// Kernel of kernels/template_columns.cl, where a parameter varies.
Launcher::Handle template_columns_kernel(Launcher& launcher, const Scene& scene,
                                         const Definitions& definitions);

/// What is wrong with a column (of a member) whose cell no stimulus lifts to the threshold.
std::string silent_column(const Scene& scene, const TemplateColumns& columns, int column,
                          double threshold_mV);

}  // namespace cohort
