#pragma once

#include <array>

#include "solver/launch.hpp"

namespace cohort {

/// Points of a regular lattice, x fastest. The cells between them have their centres on a lattice too, its
/// dual.
struct Lattice {
  std::array<int, 3> points;
  double dx_mm;

  std::size_t size() const {
    return static_cast<std::size_t>(points[0]) * static_cast<std::size_t>(points[1]) *
           static_cast<std::size_t>(points[2]);
  }
  Lattice centres() const { return {{points[0] - 1, points[1] - 1, points[2] - 1}, dx_mm}; }
};

/// How the places of points are given: nowhere but in the lattice, as positions, or as displacements from it.
/// Displacements lose least to rounding.
enum class Coordinates { reference, position, displacement };

/// Interpolation, gradient, divergence and Laplacian on a deformed grid, and Jacobi's method for the latter
/// (kernels/operators.cl). Buffers are (members, components, points), coordinates (members, 3, points) in mm;
/// `coordinates` is not read in the reference configuration. Where results are on the lattice's centres, the
/// same operator on `lattice.centres()` leads back to its inner points.
class Operators {
 public:
  Operators(Launcher& launcher, Precision precision, Coordinates coordinates, int members = 1);

  /// `result` (members, components, centres).
  void interpolate(const Lattice& lattice, const cl::Buffer& field, int components, const cl::Buffer& result);
  /// `result` (members, components, 3, centres), 1/mm.
  void gradient(const Lattice& lattice, const cl::Buffer& coordinates, const cl::Buffer& field,
                int components, const cl::Buffer& result);
  /// `field` (members, rows, 3, points); `result` (members, rows, centres), 1/mm.
  void divergence(const Lattice& lattice, const cl::Buffer& coordinates, const cl::Buffer& field, int rows,
                  const cl::Buffer& result);
  /// `result` on the lattice itself, 1/mm2; its rim is left as it is.
  void laplacian(const Lattice& lattice, const cl::Buffer& coordinates, const cl::Buffer& field,
                 int components, const cl::Buffer& result) {
    inner(laplacian_, lattice, components, coordinates, field, result);
  }
  /// The Laplacian where the point lies in its dual cell, instead of at the cell's centre.
  void laplacian_at_vertex(const Lattice& lattice, const cl::Buffer& coordinates, const cl::Buffer& field,
                           int components, const cl::Buffer& result) {
    inner(at_vertex_, lattice, components, coordinates, field, result);
  }

  /// identity u - diffusion Laplacian u = right_hand_side at inner points, u given on the rim. (0, -1) is
  /// Poisson's equation, (1, nu dt) a step of implicit Euler.
  struct System {
    double identity = 0, diffusion_mm2 = -1;
  };
  struct Iteration {
    double damping = 0;  ///< of Jacobi's method; 0: what is best for the eigenvalues measured
    int sweeps = 1000;
    bool stored_rows = true;  ///< rows are assembled once and kept, 27 numbers a point; else in every sweep
  };
  /// Sweeps of Jacobi's method on `solution` (members, components, points), in place. Returns the damping
  /// that was used.
  double solve(const Lattice& lattice, const cl::Buffer& coordinates, const System& system,
               const cl::Buffer& right_hand_side, int components, const Iteration& iteration,
               const cl::Buffer& solution);

  /// Of D^-1 A of the system, over all members. Damping must stay below 2 / largest.
  struct Eigenvalues {
    double smallest;  ///< that of a constant, where that is least: smooth fields come close to it
    double largest;   ///< in size, by power iteration
  };
  Eigenvalues eigenvalues(const Lattice& lattice, const cl::Buffer& coordinates, const System& system);

 private:
  void inner(Launcher::Handle& kernel, const Lattice& lattice, int components, const cl::Buffer& coordinates,
             const cl::Buffer& field, const cl::Buffer& result);
  void sweeps(const Lattice& lattice, const cl::Buffer& coordinates, const System& system,
              const cl::Buffer& right_hand_side, int components, const Iteration& iteration,
              const cl::Buffer& solution);
  cl::NDRange over(std::size_t points) const;
  double bytes(std::size_t points, int numbers) const;

  Launcher& launcher_;
  Precision precision_;
  int members_, width_;
  int coordinate_numbers_;  ///< that a point's coordinates are: 3, or 0 in the reference configuration
  Launcher::Handle interpolate_, gradient_, divergence_, laplacian_, at_vertex_, weights_, jacobi_, stored_;
};

}  // namespace cohort
