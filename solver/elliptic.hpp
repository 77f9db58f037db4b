#pragma once

#include <array>
#include <vector>

#include "solver/device.hpp"

namespace cohort {

/// How a solve went.
struct EllipticResult {
  int iterations;            ///< V-cycles, equal for all right-hand sides
  double relative_residual;  ///< |b - A x| / |b| recomputed from x, the largest of the right-hand sides
  std::vector<double>
      history;  ///< the iteration's own |r| / |b|, largest of the right-hand sides, after each residual check
};

/// How a solve is to be done.
struct EllipticOptions {
  double tolerance;  ///< of |r| / |b|
  int max_iterations = 40;
  int check_every = 2;  ///< iterations between two looks at the residual, for each of which the host waits
  bool from_given =
      false;           ///< starts from the x that is there, not from zero, and looks at its residual first
  double floor = 0;    ///< root mean square of b over its cells below which |b| counts as that much
  bool verify = true;  ///< recomputes the residual from x at the end and goes on where it has drifted
};

/// What the operator couples.
enum class Couplings {
  faces,  ///< six neighbours by the conductances of faces
  cross,  ///< twelve more across the diagonals of plaquettes, in conjugate gradients alone: the V-cycle,
          ///< which has the faces only, remains a preconditioner of an equivalent spectrum
};

/// div(sigma grad x) = -b with an insulated boundary on a uniform grid, for several right-hand sides at once:
/// conjugate gradients, one multigrid V-cycle as preconditioner (kernels/multigrid.cl). The singular operator
/// is met by taking the mean off b; x has mean zero over the cells that conduct. Fields have shape (fields,
/// nz+2, ny+2, nx+2), one layer of ghost cells around; ghosts of b must be zero.
class EllipticSolver {
 public:
  /// `double_precision`: type of the fields. Throws std::runtime_error when memory does not suffice
  /// (Device::allocate). where: whose memory it is.
  EllipticSolver(Device& device, std::array<int, 3> cells, int fields, bool double_precision,
                 Couplings couplings = Couplings::faces,
                 const std::source_location& where = std::source_location::current());

  /// Device memory that the constructor takes, in bytes.
  static std::size_t bytes(const Device& device, std::array<int, 3> cells, int fields, bool double_precision,
                           Couplings couplings = Couplings::faces);

  /// Conductances of the lower x, y and z faces, shape (3, nz+2, ny+2, nx+2), in mS: written by the caller,
  /// zero on the boundary and in ghosts. Call prepare() after a change.
  cl::Buffer& conductance() { return levels_.front().conductance; }
  /// Couplings::cross only: those of the lower xy, xz and yz plaquettes (kernels/stencil.cl), same shape.
  cl::Buffer& cross() { return cross_; }
  /// 1 / sum of the conductances of a cell, shape (nz+2, ny+2, nx+2); 0 where nothing conducts. Filled by
  /// prepare().
  const cl::Buffer& inverse_diagonal() const { return levels_.front().inverse_diagonal; }
  /// Conductances of the coarse levels and all diagonals.
  void prepare();

  /// Solves for x until the residual that the iteration carries is at most tolerance |b| for each right-hand
  /// side and the recomputed one at most ten times that (single precision rounds x to about 2e-6), or gives
  /// up after max_iterations; the result says which. The host waits only for a residual after each
  /// `check_every` iterations.
  EllipticResult solve(const cl::Buffer& b, cl::Buffer& x, const EllipticOptions& options);
  EllipticResult solve(const cl::Buffer& b, cl::Buffer& x, double tolerance, int max_iterations = 40,
                       int check_every = 2) {
    return solve(b, x, EllipticOptions{tolerance, max_iterations, check_every});
  }

  /// |r| / |b| (largest of the right-hand sides) after each of `cycles` V-cycles alone, x += V (b - A x) from
  /// zero: for looking at the multigrid itself.
  std::vector<double> iterate(const cl::Buffer& b, cl::Buffer& x, int cycles);

  std::array<int, 3> cells() const { return levels_.front().cells; }
  std::size_t field_cells() const {
    return levels_.front().field_cells();
  }                                           ///< of one field, ghosts included
  int launches() const { return launches_; }  ///< kernels enqueued since construction

 private:
  struct Level {
    std::array<int, 3> cells;
    cl::Buffer conductance, inverse_diagonal;
    cl::Buffer b, x;  ///< right-hand side and correction; the finest level's b is the residual
    std::size_t field_cells() const;
  };
  void v_cycle();
  double relative_residual(double floor);
  std::vector<cl::Buffer> finest_operator() const;
  template <typename... Arguments>
  void launch(const char* kernel, cl::NDRange global, cl::NDRange local, const Arguments&... arguments);
  cl::NDRange global(int x, int y, int z) const;
  cl::NDRange local() const { return device_.info().gpu ? cl::NDRange(16, 8, 1) : cl::NullRange; }

  Device& device_;
  int fields_;
  Couplings couplings_;
  bool double_, accumulate_double_;
  int chunks_, group_;
  cl::Program program_;
  std::vector<std::pair<std::string, Device::Counted>> kernels_;
  std::vector<Level> levels_;
  cl::Buffer cross_, p_, p_before_, q_, partial_, scalars_;
  int launches_ = 0;
};

}  // namespace cohort
