#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "solver/tissue.hpp"

namespace cohort {

/// Arrival times of an activation front on the tissue of a batch: sqrt(grad T . M grad T) = 1 with the
/// squared velocity M = v_l^2 f f^T + v_t^2 (I - f f^T), f the tissue's fibre (kernels/eikonal.cl).
class Eikonal {
 public:
  /// What T holds where no wave comes; also in cells without tissue.
  static constexpr double unreached_ms = 1e9;

  /// Where a wave starts. Cells are places of the compact fields (they know their member). With a trigger the
  /// wave starts start_ms after its arrival at that cell, and never where it does not come there; triggers
  /// may follow on triggers, but not in a circle. Points, mm, say it exactly: the wave starts at `point`,
  /// near the cell (in the layer's surface where the cell is in a sheet), and `trigger_point` waits for it.
  struct Source {
    int cell;
    double start_ms;
    int trigger = -1;
    std::optional<std::array<double, 3>> point{}, trigger_point{};
  };
  /// A fast layer, known by the cells about it: id (stride) uchar, 0 outside; distance (stride)
  /// real mm, signed, from it; speed (stride) real mm/ms, along it, between cells of one id alone; depth
  /// (stride) real ms, the way between cell and layer, negative beyond a rim, where the wave only comes out
  /// (kernels/eikonal.cl). slow() slows the depth alone.
  struct Sheet {
    const cl::Buffer& id;
    const cl::Buffer& distance;
    const cl::Buffer& speed;
    const cl::Buffer& depth;
  };

  /// graph_of_region: a bit for each graph that a region belongs to; waves pass between cells that share one
  /// (atria and ventricles may touch, a path between them belongs to both). Empty: all are one graph.
  Eikonal(Launcher& launcher, const Scene& scene, const Definitions& definitions,
          std::vector<std::uint8_t> graph_of_region = {});

  /// Solves for arrival(). speed (2, stride) real, along and across fibres, mm/ms; a cell with a speed that
  /// is not positive conducts nothing. initial (stride) real, ms: cells below unreached_ms start a wave, in
  /// addition to `sources`; sheet and initial may be null. fibres (3, stride) real: the tissue's where null,
  /// which must have been built. Reads one number from the device every few sweeps.
  void solve(const Tissue& tissue, const cl::Buffer& speed, const Sheet* sheet, const cl::Buffer* initial,
             std::span<const Source> sources, const cl::Buffer* fibres = nullptr);

  /// Solves once more, for sqrt(grad T . M grad T) = slowness (stride, real), with the sources and sheet of
  /// the last solve(); sheets keep their speed.
  void slow(const Tissue& tissue, const cl::Buffer& slowness);

  /// (stride) real, ms; with a sheet the times of its own wave follow.
  const cl::Buffer& arrival() const { return arrival_[current_]; }
  /// Sweeps that the last solution took.
  int sweeps() const { return sweeps_; }

  /// Device bytes for `stride` compact cells, without a sheet; with one 9 reals more a cell.
  static std::size_t bytes(std::int64_t stride, Precision precision);

 private:
  void reserve(const Tissue& tissue);
  void upload_sources(const Tissue& tissue, std::span<const Source> sources);
  void fire(const Tissue& tissue, int mark);
  void sweep(const Tissue& tissue, int number);
  void propagate(const Tissue& tissue);
  void build_metric(const Tissue& tissue);
  void correct(const Tissue& tissue);

  Launcher& launcher_;
  Definitions definitions_;
  Precision precision_;
  int width_;
  int capacity_ = 0, source_capacity_ = 0;
  int current_ = 0, sweeps_ = 0;
  int sources_ = 0;
  std::vector<int> first_source_;  ///< of those that fire together, no two of one member; and the end
  bool triggered_ = false, with_sheet_ = false, sheet_capacity_ = false, with_initial_ = false;
  /// Of the last solve().
  cl::Buffer sheet_id_, sheet_depth_, sheet_distance_, sheet_speed_, slowed_depth_, initial_, speed_, fibres_;
  cl::Buffer graph_of_region_, arrival_[2], changed_[2], metric_, linked_, in_sheet_, sheet_metric_, second_,
      correction_, last_change_;
  cl::Buffer trigger_, trigger_point_, start_, fired_, source_cell_, source_point_;
  Launcher::Handle link_, normals_, sheet_metric_kernel_, metric_kernel_, start_kernel_, trigger_kernel_,
      fire_, sweep_, sheet_sweep_, second_differences_, correction_kernel_, slow_;
};

}  // namespace cohort
