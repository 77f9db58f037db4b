#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "solver/cell_models.hpp"
#include "solver/electrophysiology.hpp"
#include "solver/lead_weights.hpp"
#include "solver/template_cells.hpp"

namespace cohort {

/// The ECG without a time loop: each cell's potential is an action potential of its region, run once for a
/// single cell, behind the cell's arrival time (kernels/templates.cl). One cell parameter may vary through
/// walls; the table then has columns over its range, and cells interpolate between them.
class TemplateEcg {
 public:
  /// Throws std::invalid_argument where more than one parameter varies.
  TemplateEcg(Launcher& launcher, const Scene& scene, const Definitions& definitions, int members_per_batch);

  /// Series of `members` from arrival (stride) ms and weights (leads, stride): rows (samples, members,
  /// leads + 1) as Recorder::fetched gives them. The tissue's coordinates must have been built where a
  /// parameter varies.
  std::vector<double> series(const Tissue& tissue, const cl::Buffer& parameters, const cl::Buffer& arrival,
                             const cl::Buffer& weights, std::span<const Member> members);

  /// Why cells of member m of the last series() have no action potential behind their arrival: what they are
  /// is then no number. Empty where all have one.
  const std::string& silent(std::size_t m) const { return silent_[m]; }
  /// Spacing of the templates in time.
  double spacing_ms() const { return interval_ms_ / phases_; }
  /// Whether the scene's heterogeneity can be tabulated; empty, or why not.
  static std::string refusal(const Scene& scene);
  static std::size_t bytes(const Device& device, const Scene& scene, int members, std::int64_t stride);

 private:
  /// Extents of the table in time.
  struct Extents {
    std::size_t group;
    int samples, phases, foot, row;
  };
  static Extents extents_of(const Device& device, const Scene& scene);
  void run_cells(std::span<const Member> members);
  void place_cells(const Tissue& tissue, const cl::Buffer& parameters, const cl::Buffer& arrival);

  Launcher& launcher_;
  const Scene& scene_;
  CellModels models_;
  RegionParameters regions_;
  TemplateColumns columns_;
  int members_per_batch_, width_;
  std::size_t group_;  ///< work-items of a group, each at so many samples as a vector has lanes
  int samples_, phases_, row_;
  double interval_ms_;
  int capacity_ = 0, capacity_blocks_ = 0;
  std::vector<double> last_cells_;   ///< parameters that the table holds
  std::vector<std::string> silent_;  ///< by member of that table
  cl::Buffer table_, column_first_, column_count_, range_, column_of_, place_, start_, share_, partial_,
      series_, first_block_;
  /// Of one cell model: the cells that are run for the table.
  struct Runs {
    cl::Buffer parameters, columns, threshold, reference, step_factor, silent;
    Launcher::Handle run;
  };
  std::vector<Runs> runs_;
  Launcher::Handle columns_kernel_, places_, project_, totals_;
};

}  // namespace cohort
