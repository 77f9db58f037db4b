#pragma once

#include <array>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "solver/device.hpp"
#include "solver/elliptic.hpp"
#include "solver/scene.hpp"

namespace cohort {

inline constexpr std::array<std::string_view, 9> electrode_names = {"RA", "LA", "LL", "V1", "V2",
                                                                    "V3", "V4", "V5", "V6"};
using Point = std::array<double, 3>;

/// Declares torso.*: conductivity, pose of the heart, electrodes and, unless `unbounded`, sizes and grid.
/// Frame of the torso: x to the left, y to the back, z up (left, posterior, superior), mm.
///   box        half_width, half_depth, lower, upper
///   ellipsoid  the same, inscribed in that box
///   cylinder   vertical, cross-section |x/half_width|^exponent + |y/half_depth|^exponent < 1
void declare_torso(ParameterTable& table, TorsoKind kind);

/// Rigid motion from the heart's frame (x to the septum, y anterior, z to the base) into the torso's.
struct Pose {
  std::array<double, 9> rotation;  ///< row-major
  Point translation_mm;
  Point operator()(const Point& heart_mm) const;
};
/// The apex points to (cos el cos az, -cos el sin az, -sin el): azimuth from left to front, elevation
/// downwards. At roll 0 the septum's side is horizontal, to the right and front, and the anterior wall faces
/// up; a positive roll turns the anterior wall to the front and the right ventricle down. `point_mm` of the
/// heart comes to lie at `position_mm`.
Pose heart_pose(const ParameterTable& table, const std::vector<double>& values);

/// Electrodes where they act: RA, LA and those inside as given; the others, and any outside, moved onto the
/// skin along the horizontal ray from the axis of the torso (ellipsoid: the ray from its centre; unbounded:
/// as given). Table order.
std::array<Point, 9> electrode_places(TorsoKind kind, const ParameterTable& table,
                                      const std::vector<double>& values);

/// Potentials of a unit current (1 uA) at each electrode, with a sink spread over the torso that all
/// electrodes share and every lead cancels.
struct LeadFields {
  cl::Buffer
      potential;  ///< (9, nz, ny, nx) real, mV/uA for 1 mS/mm; ghosts counted. unbounded: 64 unread bytes
  std::array<int, 3>
      extent{};       ///< nx, ny, nz of the buffer, one layer of ghosts included; zeros when unbounded
  Point origin_mm{};  ///< centre of its first cell, in the torso's frame
  double dx_mm = 0;
  std::array<Point, 9> electrodes_mm{};
  int iterations = 0;
  double relative_residual = 0;  ///< largest of the nine, of the potentials as stored
};

/// The torso of a scene on one device.
class Torso {
 public:
  /// Compiles; allocates at the first solve. Throws std::out_of_range when the scene declared no torso.
  /// `fields`: right-hand sides of its solver; nine for fields(), else one's own.
  Torso(Device& device, const Scene& scene, int fields = static_cast<int>(electrode_names.size()));

  /// The member's grid, conductances and electrodes, ready to solve on, without the lead fields. Throws as
  /// fields(), and std::invalid_argument for an unbounded torso.
  void set_up(const std::vector<double>& values);
  /// Geometry of the grid set up last; `potential` is that of the last fields().
  const LeadFields& grid() const { return fields_; }

  /// The lead fields of a member: nine elliptic solves, or those of the last call when none of the parameters
  /// that they depend on has changed (all of torso.* but the heart's pose and the conductivity, which scales
  /// them: block()). Valid until the next call. Throws std::runtime_error when memory does not suffice or the
  /// solver does not converge.
  const LeadFields& fields(const std::vector<double>& values);

  /// The member's block that kernels/lead_field.clh reads beside the fields: pose, 1/conductivity, grid,
  /// electrodes.
  std::vector<double> block(const std::vector<double>& values);

  /// Whether all places, in the torso's frame, lie inside the torso of these values.
  bool holds(std::span<const Point> places_mm, const std::vector<double>& values) const;

  /// Cells of the grid of these values.
  std::size_t cells(const std::vector<double>& values) const;
  /// Device memory that fields(values) will take, in bytes; allocates nothing.
  std::size_t bytes(const std::vector<double>& values) const;
  /// Definitions (-D) that lead_field.clh needs.
  std::vector<std::string> definitions() const;

  int solves() const { return solves_; }  ///< how often fields() had to solve
  /// The solver with this torso's conductances (for 1 mS/mm), after fields() or set_up(). Not for
  /// `unbounded`.
  EllipticSolver& solver() { return *solver_; }
  /// Moving least squares weights that inject and read at the electrodes, (9, 4, 4, 4) real over cells (z, y,
  /// x), and the first cell (x, y, z) of each window in the buffer, (9, 3) int.
  const cl::Buffer& electrode_weights() const { return weights_; }
  const cl::Buffer& electrode_windows() const { return windows_; }

 private:
  struct Box {
    Point centre, half;  ///< mm
    std::array<int, 3> cells;
    Point corner;  ///< first corner of the first cell, mm
    double dx;
  };
  Box box(const std::vector<double>& values) const;
  void solve(const std::vector<double>& values);
  template <typename Real>
  void enqueue_conductances(const std::vector<double>& values, const Box& grid);
  std::vector<double> inclusions(const std::vector<double>& values, const Box& grid) const;

  Device& device_;
  TorsoKind kind_;
  bool double_;
  int count_;
  ParameterTable table_;
  std::vector<int> key_parameters_;
  std::vector<double> key_, set_up_key_;
  cl::Program program_;
  std::unique_ptr<EllipticSolver> solver_;
  cl::Buffer source_, weights_, windows_, level_;
  LeadFields fields_;
  int solves_ = 0;
};

}  // namespace cohort
