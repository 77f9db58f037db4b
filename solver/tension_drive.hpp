#pragma once

#include <span>
#include <string>
#include <vector>

#include "solver/solid.hpp"
#include "solver/template_cells.hpp"

namespace cohort {

/// What drives an active tension behind arrival times: the potential, or the intracellular calcium, of single
/// cells by the time since a cell's own activation (kernels/tension_drive.clh), one column for each excitable
/// region, or several where a cell parameter varies through its wall.
class TensionDrive {
 public:
  /// Of tissue that no wave excites: below any resting potential, and no calcium.
  static constexpr double idle_mV = -1000, idle_mM = 0;
  /// Whether the tension of the scene needs a drive.
  static bool wanted(const Scene& scene);
  /// definitions: of the excited tissue.
  TensionDrive(Launcher& launcher, const Scene& scene, const Definitions& definitions, int members_per_batch);

  /// Of a program whose cells read the table.
  std::vector<std::string> options() const;
  /// Tables of `members`.
  void prepare(std::span<const Member> members);
  /// Why member m cannot be driven; empty when it can.
  const std::string& defect(std::size_t m) const { return defects_[m]; }
  /// Where the cells of `solid`, of the same members, find theirs. places: nearest_places(). parameters:
  /// blocks of the tissue's members, of which `of_tissue` are these.
  void connect(std::span<const Member> members, std::span<const std::size_t> of_tissue, const Tissue& tissue,
               const cl::Buffer& parameters, std::span<const int> places, Solid& solid);
  static std::size_t bytes(const Scene& scene, int members);

 private:
  std::vector<double> columns_of_cells(std::span<const Member> members,
                                       std::span<const std::size_t> of_tissue, const Tissue& tissue,
                                       const cl::Buffer& parameters, std::span<const int> places,
                                       const SolidMesh& mesh);

  Launcher& launcher_;
  const Scene& scene_;
  CellModels models_;
  RegionParameters regions_;
  TemplateColumns columns_;
  int row_;
  std::vector<Launcher::Handle> runs_;  ///< by cell model
  Launcher::Handle varying_;
  cl::Buffer table_;
  std::vector<double> last_cells_;    ///< parameters of the cells that the table holds
  std::vector<std::string> defects_;  ///< by member of that table
};

}  // namespace cohort
