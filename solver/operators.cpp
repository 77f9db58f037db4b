#include "solver/operators.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "solver/precision.hpp"

namespace cohort {

namespace {

constexpr std::size_t group = 64;
constexpr int stencil = 27;

std::size_t inner_points(const Lattice& lattice) {
  return lattice.centres().centres().size();
}

void check(const Lattice& lattice, int least) {
  if (std::ranges::min(lattice.points) < least)
    throw std::invalid_argument("an operator needs at least " + std::to_string(least) +
                                " points along each axis");
}

}  // namespace

Operators::Operators(Launcher& launcher, Precision precision, Coordinates coordinates, int members)
    : launcher_(launcher),
      precision_(precision),
      members_(members),
      width_(launcher.device().vector_width(precision == Precision::double_)),
      coordinate_numbers_(coordinates == Coordinates::reference ? 0 : 3) {
  std::vector<std::string> options;
  if (precision == Precision::double_) options.push_back("DOUBLE");
  if (coordinates == Coordinates::position) options.push_back("POSITION");
  if (coordinates == Coordinates::displacement) options.push_back("DISPLACEMENT");
  options.push_back("WIDTH=" + std::to_string(width_));
  const cl::Program program = launcher.device().build({"deformed_cell.clh", "operators.cl"}, options);
  interpolate_ = launcher.handle(program, "interpolate");
  gradient_ = launcher.handle(program, "gradient");
  divergence_ = launcher.handle(program, "divergence");
  laplacian_ = launcher.handle(program, "laplacian");
  at_vertex_ = launcher.handle(program, "laplacian_at_vertex");
  weights_ = launcher.handle(program, "laplacian_weights");
  jacobi_ = launcher.handle(program, "jacobi");
  stored_ = launcher.handle(program, "jacobi_stored");
}

cl::NDRange Operators::over(std::size_t points) const {
  return {(points + group - 1) / group * group, static_cast<std::size_t>(members_)};
}

double Operators::bytes(std::size_t points, int numbers) const {
  return static_cast<double>(points) * members_ * numbers * static_cast<double>(real_bytes(precision_));
}

void Operators::interpolate(const Lattice& lattice, const cl::Buffer& field, int components,
                            const cl::Buffer& result) {
  check(lattice, 2);
  const auto [nx, ny, nz] = lattice.points;
  launcher_(interpolate_, over(lattice.centres().size()), cl::NDRange(group, 1),
            bytes(lattice.size(), 2 * components), field, result, components, nx, ny, nz);
}

void Operators::gradient(const Lattice& lattice, const cl::Buffer& coordinates, const cl::Buffer& field,
                         int components, const cl::Buffer& result) {
  check(lattice, 2);
  const auto [nx, ny, nz] = lattice.points;
  launcher_(gradient_, over(lattice.centres().size()), cl::NDRange(group, 1),
            bytes(lattice.size(), 4 * components + coordinate_numbers_), coordinates, field, result,
            components, nx, ny, nz, Real{1 / lattice.dx_mm});
}

void Operators::divergence(const Lattice& lattice, const cl::Buffer& coordinates, const cl::Buffer& field,
                           int rows, const cl::Buffer& result) {
  check(lattice, 2);
  const auto [nx, ny, nz] = lattice.points;
  launcher_(divergence_, over(lattice.centres().size()), cl::NDRange(group, 1),
            bytes(lattice.size(), 4 * rows + coordinate_numbers_), coordinates, field, result, rows, nx, ny,
            nz, Real{1 / lattice.dx_mm});
}

void Operators::inner(Launcher::Handle& kernel, const Lattice& lattice, int components,
                      const cl::Buffer& coordinates, const cl::Buffer& field, const cl::Buffer& result) {
  check(lattice, 3);
  const auto [nx, ny, nz] = lattice.points;
  launcher_(kernel, over(inner_points(lattice)), cl::NDRange(group, 1),
            bytes(lattice.size(), 2 * components + coordinate_numbers_), coordinates, field, result,
            components, nx, ny, nz, Real{1 / lattice.dx_mm});
}

void Operators::sweeps(const Lattice& lattice, const cl::Buffer& coordinates, const System& system,
                       const cl::Buffer& right_hand_side, int components, const Iteration& iteration,
                       const cl::Buffer& solution) {
  check(lattice, 3);
  const auto [nx, ny, nz] = lattice.points;
  const std::size_t points = lattice.size(), inside = inner_points(lattice), real = real_bytes(precision_),
                    all = points * static_cast<std::size_t>(members_);
  Device& device = launcher_.device();
  const Real over_dx{1 / lattice.dx_mm}, identity{system.identity}, diffusion{system.diffusion_mm2},
      damping{iteration.damping};
  cl::CommandQueue& queue = launcher_.queue();
  cl::Buffer weights;
  if (iteration.stored_rows) {
    weights = device.allocate(stencil * all * real, "weights");
    queue.enqueueFillBuffer(weights, cl_uchar{0}, 0, stencil * all * real);
    launcher_(weights_, over(inside), cl::NDRange(group, 1), bytes(points, stencil + coordinate_numbers_),
              coordinates, weights, nx, ny, nz, over_dx);
  }
  // Two buffers in turn, both with the rim, and room behind for vectors that reach over the end.
  const std::size_t size = all * static_cast<std::size_t>(components) * real;
  const auto width = static_cast<std::size_t>(width_);
  cl::Buffer from = device.allocate(size + width * real, "from"),
             to = device.allocate(size + width * real, "to");
  for (const cl::Buffer& buffer : {from, to}) {
    queue.enqueueFillBuffer(buffer, cl_uchar{0}, size, width * real);
    queue.enqueueCopyBuffer(solution, buffer, 0, 0, size);
  }
  const std::size_t rim = 1 + static_cast<std::size_t>(nx) * (1 + static_cast<std::size_t>(ny));
  const cl::NDRange vectors = over((points - 2 * rim + width - 1) / width);
  for (int sweep = 0; sweep < iteration.sweeps; ++sweep) {
    if (iteration.stored_rows)
      launcher_(stored_, vectors, cl::NDRange(group, 1), bytes(points, 3 * components + stencil), weights,
                from, right_hand_side, to, components, nx, ny, nz, identity, diffusion, damping);
    else
      launcher_(jacobi_, over(inside), cl::NDRange(group, 1),
                bytes(points, 3 * components + coordinate_numbers_), coordinates, from, right_hand_side, to,
                components, nx, ny, nz, over_dx, identity, diffusion, damping);
    std::swap(from, to);
  }
  queue.enqueueCopyBuffer(from, solution, 0, 0, size);
}

double Operators::solve(const Lattice& lattice, const cl::Buffer& coordinates, const System& system,
                        const cl::Buffer& right_hand_side, int components, const Iteration& iteration,
                        const cl::Buffer& solution) {
  constexpr double margin = 1.05;  // power iteration comes from below
  Iteration measured = iteration;
  if (measured.damping == 0) {
    const Eigenvalues values = eigenvalues(lattice, coordinates, system);
    measured.damping = 2 / (values.smallest + margin * values.largest);
  }
  sweeps(lattice, coordinates, system, right_hand_side, components, measured, solution);
  return measured.damping;
}

Operators::Eigenvalues Operators::eigenvalues(const Lattice& lattice, const cl::Buffer& coordinates,
                                              const System& system) {
  // A sweep without a right-hand side is u - damping D^-1 A u, whose fastest mode grows with a damping of 2.
  constexpr double damping = 2;
  constexpr int rounds = 8, sweeps_of_round = 8;
  const std::size_t members = static_cast<std::size_t>(members_), points = lattice.size();
  const auto [nx, ny, nz] = lattice.points;
  std::vector<double> u(members * points, 0.0);
  // A wave along one axis is the fastest mode of the undeformed grid; what is added to it lets others grow.
  for (std::size_t m = 0; m < members; ++m)
    for (int z = 1; z < nz - 1; ++z)
      for (int y = 1; y < ny - 1; ++y)
        for (int x = 1; x < nx - 1; ++x)
          u[m * points + static_cast<std::size_t>(x + nx * (y + ny * z))] =
              (x % 2 ? 1 : -1) + 0.5 * (y % 2 ? 1 : -1) + 0.25 * (z % 2 ? 1 : -1) +
              0.1 * std::sin(1.3 * x + 2.1 * y + 2.9 * z);
  Device& device = launcher_.device();
  const cl::Buffer field = device.allocate(u.size() * real_bytes(precision_), "field"),
                   zero = device.allocate(u.size() * real_bytes(precision_), "zero");
  const auto write = [&](const cl::Buffer& buffer, const std::vector<double>& numbers) {
    const std::vector<std::byte> raw = pack(numbers, precision_);
    launcher_.queue().enqueueWriteBuffer(buffer, CL_TRUE, 0, raw.size(), raw.data());
  };
  write(zero, std::vector<double>(u.size(), 0.0));
  const auto swept = [&](std::vector<double> numbers, double by, int count) {
    write(field, numbers);
    sweeps(lattice, coordinates, system, zero, 1, {by, count, true}, field);
    std::vector<std::byte> raw(numbers.size() * real_bytes(precision_));
    launcher_.queue().enqueueReadBuffer(field, CL_TRUE, 0, raw.size(), raw.data());
    return unpack(raw, precision_);
  };
  // Of a constant, with itself on the rim, one sweep leaves 1 - its eigenvalue.
  double left = 0;
  const std::vector<double> constant = swept(std::vector<double>(u.size(), 1.0), 1, 1);
  for (std::size_t m = 0; m < members; ++m)
    for (int z = 1; z < nz - 1; ++z)
      for (int y = 1; y < ny - 1; ++y)
        for (int x = 1; x < nx - 1; ++x)
          left = std::max(left, constant[m * points + static_cast<std::size_t>(x + nx * (y + ny * z))]);
  double growth = 1;
  for (int round = 0; round < rounds; ++round) {
    double before = 0, after = 0;
    for (const double value : u) before = std::max(before, std::abs(value));
    for (double& value : u) value /= before;
    u = swept(u, damping, sweeps_of_round);
    for (const double value : u) after = std::max(after, std::abs(value));
    growth = std::pow(after, 1.0 / sweeps_of_round);
  }
  return {1 - left, (1 + growth) / damping};
}

}  // namespace cohort
