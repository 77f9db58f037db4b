#include "solver/elliptic.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

namespace cohort {
namespace {

constexpr int coarsest_extent = 8;   // cells along an axis below which a level is not coarsened
constexpr int coarsest_sweeps = 16;  // damps the slowest mode of eight cells by 0.85^32
// Red-black sweeps before and after the coarse correction. A third is not known to pay where the V-cycle
// lacks the couplings across diagonals.
constexpr int sweeps_for_faces = 3, sweeps_for_cross = 2;
constexpr double drift =
    10;  // of the true residual over the carried one, from rounding of x in single precision
constexpr int scalars_per_field = 7, partial_sums = 2, cells_index = 0, rr_index = 5,
              bb_index = 6;  // as in conjugate_gradient.cl
constexpr int gpu_chunks = 8192, gpu_group = 256, cpu_chunks = 64;
constexpr int gpu_sum_group = 128, cells_per_gpu_chunk = 16;  // small grids take fewer chunks

std::vector<std::array<int, 3>> level_cells(std::array<int, 3> cells) {
  std::vector<std::array<int, 3>> levels = {cells};
  while (*std::max_element(cells.begin(), cells.end()) > coarsest_extent) {
    for (int& n : cells) n = (n + 1) / 2;
    levels.push_back(cells);
  }
  return levels;
}

std::size_t padded(std::array<int, 3> cells) {
  std::size_t count = 1;
  for (const int n : cells) count *= static_cast<std::size_t>(n) + 2;
  return count;
}

std::size_t round_up(int n, std::size_t unit) {
  return (static_cast<std::size_t>(n) + unit - 1) / unit * unit;
}

/// Partial sums of an inner product.
int chunks_of(const Device& device, std::array<int, 3> cells) {
  if (!device.info().gpu) return cpu_chunks;
  return static_cast<int>(std::min<std::size_t>(
      gpu_chunks, round_up(static_cast<int>(padded(cells) / cells_per_gpu_chunk), gpu_sum_group)));
}

}  // namespace

std::size_t EllipticSolver::Level::field_cells() const {
  return padded(cells);
}

std::size_t EllipticSolver::bytes(const Device& device, std::array<int, 3> cells, int fields,
                                  bool double_precision, Couplings couplings) {
  const std::size_t real = double_precision ? sizeof(double) : sizeof(float),
                    count = static_cast<std::size_t>(fields);
  std::size_t reals = 3 * count * padded(cells);  // p, p_before, q
  if (couplings == Couplings::cross) reals += 3 * padded(cells);
  for (const auto& level : level_cells(cells)) reals += (4 + 2 * count) * padded(level);
  const auto chunks = static_cast<std::size_t>(chunks_of(device, cells));
  return reals * real + count * sizeof(double) * (partial_sums * chunks + scalars_per_field);
}

EllipticSolver::EllipticSolver(Device& device, std::array<int, 3> cells, int fields, bool double_precision,
                               Couplings couplings, const std::source_location& where)
    : device_(device),
      fields_(fields),
      couplings_(couplings),
      double_(double_precision),
      accumulate_double_(device.info().handle.getInfo<CL_DEVICE_EXTENSIONS>().find("cl_khr_fp64") !=
                         std::string::npos),
      chunks_(chunks_of(device, cells)),
      group_(device.info().gpu ? gpu_group : 1) {
  std::vector<std::string> definitions = {"COARSEST_SWEEPS=" + std::to_string(coarsest_sweeps),
                                          "CHUNKS=" + std::to_string(chunks_),
                                          "GROUP=" + std::to_string(group_)};
  if (double_) definitions.push_back("DOUBLE");
  if (accumulate_double_) definitions.push_back("ACCUMULATE_DOUBLE");
  if (couplings_ == Couplings::cross) definitions.push_back("CROSS");
  program_ = device_.build({"elliptic.clh", "multigrid.cl", "conjugate_gradient.cl"}, definitions);

  const std::size_t real = double_ ? sizeof(double) : sizeof(float),
                    count = static_cast<std::size_t>(fields_);
  const auto zeros = [&](std::size_t reals, const char* name) {
    cl::Buffer buffer = device_.allocate(reals * real, name, where);
    device_.queue().enqueueFillBuffer(buffer, cl_uchar{0}, 0, reals * real);
    return buffer;
  };
  for (const auto& extent : level_cells(cells)) {
    const std::size_t n = padded(extent);
    levels_.push_back({extent, zeros(3 * n, "conductances"), zeros(n, "diagonals"),
                       zeros(count * n, "residuals"), zeros(count * n, "corrections")});
  }
  for (cl::Buffer* buffer : {&p_, &p_before_, &q_})
    *buffer = zeros(count * levels_.front().field_cells(), "search directions");
  if (couplings_ == Couplings::cross) cross_ = zeros(3 * levels_.front().field_cells(), "couplings across");
  const std::size_t accumulator = accumulate_double_ ? sizeof(double) : real;
  partial_ =
      device_.allocate(count * partial_sums * static_cast<std::size_t>(chunks_) * accumulator, "sums", where);
  scalars_ = device_.allocate(count * scalars_per_field * accumulator, "sums", where);
}

template <typename... Arguments>
void EllipticSolver::launch(const char* name, cl::NDRange global, cl::NDRange local,
                            const Arguments&... arguments) {
  auto it =
      std::find_if(kernels_.begin(), kernels_.end(), [&](const auto& known) { return known.first == name; });
  if (it == kernels_.end()) it = kernels_.insert(it, {name, device_.kernel(program_, name)});
  cl::Kernel& kernel = it->second.kernel;
  cl_uint index = 0;
  const auto set = [&](const auto& argument) {
    using Argument = std::decay_t<decltype(argument)>;
    if constexpr (std::is_same_v<Argument, std::array<int, 3>>)
      for (const int n : argument) kernel.setArg(index++, n);
    else if constexpr (std::is_same_v<Argument, std::vector<cl::Buffer>>)
      for (const cl::Buffer& buffer : argument) kernel.setArg(index++, buffer);
    else
      kernel.setArg(index++, argument);
  };
  (set(arguments), ...);
  device_.queue().enqueueNDRangeKernel(kernel, cl::NullRange, global, local);
  device_.count_launch(it->second.place);
  ++launches_;
}

/// The finest operator as the kernels of conjugate gradients take it.
std::vector<cl::Buffer> EllipticSolver::finest_operator() const {
  if (couplings_ == Couplings::faces) return {levels_.front().conductance};
  return {levels_.front().conductance, cross_};
}

/// Range of a stencil kernel, rounded up to whole work-groups of 16x8 on GPUs.
cl::NDRange EllipticSolver::global(int x, int y, int z) const {
  if (!device_.info().gpu)
    return {static_cast<std::size_t>(x), static_cast<std::size_t>(y), static_cast<std::size_t>(z)};
  return {round_up(x, 16), round_up(y, 8), static_cast<std::size_t>(z)};
}

void EllipticSolver::prepare() {
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    Level& level = levels_[l];
    const cl::NDRange range = global(level.cells[0], level.cells[1], level.cells[2]);
    if (l > 0)
      launch("coarsen_conductance", range, local(), level.cells, levels_[l - 1].cells,
             levels_[l - 1].conductance, level.conductance);
    launch("invert_diagonal", range, local(), level.cells, level.conductance, level.inverse_diagonal);
  }
}

/// Correction levels_[0].x for the residual levels_[0].b.
void EllipticSolver::v_cycle() {
  constexpr int red = 0, black = 1;
  const int sweeps = couplings_ == Couplings::cross ? sweeps_for_cross : sweeps_for_faces;
  const auto half_range = [&](const Level& level) {
    return global((level.cells[0] + 1) / 2, level.cells[1], level.cells[2] * fields_);
  };
  const auto sweep = [&](Level& level, int colour) {
    launch("smooth", half_range(level), local(), colour, level.cells, level.conductance,
           level.inverse_diagonal, level.b, level.x);
  };
  for (std::size_t l = 0; l + 1 < levels_.size(); ++l) {
    Level &fine = levels_[l], &coarse = levels_[l + 1];
    launch("smooth_from_zero", half_range(fine), local(), fine.cells, fine.conductance, fine.inverse_diagonal,
           fine.b, fine.x);
    for (int n = 1; n < sweeps; ++n) {
      sweep(fine, red);
      sweep(fine, black);
    }
    launch("restrict_residual", global(coarse.cells[0], coarse.cells[1], coarse.cells[2] * fields_), local(),
           coarse.cells, fine.cells, fine.conductance, fine.b, fine.x, coarse.b);
  }
  const Level& coarsest = levels_.back();
  const std::size_t lanes = device_.info().gpu ? 128 : 1;
  launch("smooth_coarsest", lanes * static_cast<std::size_t>(fields_), lanes, coarsest.cells,
         coarsest.conductance, coarsest.inverse_diagonal, coarsest.b, coarsest.x);
  for (std::size_t l = levels_.size() - 1; l-- > 0;) {
    Level &fine = levels_[l], &coarse = levels_[l + 1];
    launch("smooth_corrected", half_range(fine), local(), fine.cells, coarse.cells, fine.conductance,
           fine.inverse_diagonal, fine.b, coarse.x, fine.x);
    sweep(fine, red);
    for (int n = 1; n < sweeps; ++n) {
      sweep(fine, black);
      sweep(fine, red);
    }
  }
}

/// Largest |r| / |b| of the fields. Waits for the device.
double EllipticSolver::relative_residual(double floor) {
  const auto largest = [&](auto scalars) {
    device_.queue().enqueueReadBuffer(scalars_, CL_TRUE, 0, scalars.size() * sizeof scalars[0],
                                      scalars.data());
    double square = 0;
    for (std::size_t i = 0; i < scalars.size(); i += scalars_per_field) {
      const double least = floor * floor * static_cast<double>(scalars[i + cells_index]);
      const double rr = scalars[i + rr_index], bb = std::max<double>(scalars[i + bb_index], least);
      if (!std::isfinite(rr)) return std::numeric_limits<double>::quiet_NaN();
      if (bb > 0) square = std::max(square, rr / bb);
    }
    return std::sqrt(square);
  };
  const std::size_t count = static_cast<std::size_t>(fields_) * scalars_per_field;
  return accumulate_double_ || double_ ? largest(std::vector<double>(count))
                                       : largest(std::vector<float>(count));
}

EllipticResult EllipticSolver::solve(const cl::Buffer& b, cl::Buffer& x, const EllipticOptions& options) {
  const double tolerance = options.tolerance;
  const int max_iterations = options.max_iterations;
  Level& finest = levels_.front();
  const int cells = static_cast<int>(finest.field_cells());
  const std::size_t real = double_ ? sizeof(double) : sizeof(float),
                    fields = static_cast<std::size_t>(fields_);
  const cl::NDRange sums(static_cast<std::size_t>(chunks_), fields),
      totals(static_cast<std::size_t>(group_) * fields);
  const cl::NDRange sums_local = device_.info().gpu ? cl::NDRange(gpu_sum_group, 1) : cl::NDRange(1, 1);
  const cl::NDRange totals_local(static_cast<std::size_t>(group_));

  if (!options.from_given)
    device_.queue().enqueueFillBuffer(x, cl_uchar{0}, 0, fields * finest.field_cells() * real);
  device_.queue().enqueueFillBuffer(p_before_, cl_uchar{0}, 0, fields * finest.field_cells() * real);

  EllipticResult result{0, 0, {}};
  // The residual that the iteration carries drifts from b - A x by rounding: when it has converged the true
  // one is taken, and where that is much larger than asked the iteration starts again from it.
  for (int restart = 0;; ++restart) {
    launch("sum_source", sums, sums_local, cells, finest.inverse_diagonal, b, partial_);
    launch("finish_source", totals, totals_local, partial_, scalars_);
    launch("residual", sums, sums_local, finest.cells, finest_operator(), finest.inverse_diagonal, b, x,
           scalars_, finest.b, partial_);
    launch("finish_residual", totals, totals_local, cl_int{1}, partial_, scalars_);
    double carried = 1;
    if (restart == 0 && options.from_given) {
      carried = result.relative_residual = relative_residual(options.floor);
      if (carried <= tolerance || !std::isfinite(carried)) return result;
    }
    if (restart > 0) {
      const double before = result.relative_residual;
      result.relative_residual = relative_residual(options.floor);
      const bool stagnates = restart > 1 && !(result.relative_residual < before / 2);
      if (result.relative_residual <= drift * tolerance || stagnates || result.iterations >= max_iterations)
        return result;
      if (!std::isfinite(result.relative_residual)) return result;
    }
    while (!(carried <= tolerance) && result.iterations < max_iterations) {
      v_cycle();
      launch("sum_preconditioned", sums, sums_local, cells, finest.b, finest.x, partial_);
      launch("finish_beta", totals, totals_local, partial_, scalars_);
      launch("search_direction", sums, sums_local, finest.cells, finest_operator(), finest.inverse_diagonal,
             finest.x, p_before_, scalars_, p_, q_, partial_);
      launch("finish_alpha", totals, totals_local, partial_, scalars_);
      launch("update", sums, sums_local, cells, p_, q_, scalars_, x, finest.b, partial_);
      std::swap(p_, p_before_);
      if (++result.iterations % options.check_every == 0 || result.iterations == max_iterations) {
        launch("finish_residual", totals, totals_local, cl_int{0}, partial_, scalars_);
        carried = relative_residual(options.floor);
        result.history.push_back(carried);
        if (!std::isfinite(carried)) break;
      }
    }
    if (!options.verify) {
      result.relative_residual = carried;
      return result;
    }
  }
}

std::vector<double> EllipticSolver::iterate(const cl::Buffer& b, cl::Buffer& x, int cycles) {
  Level& finest = levels_.front();
  const int cells = static_cast<int>(finest.field_cells());
  const std::size_t real = double_ ? sizeof(double) : sizeof(float),
                    fields = static_cast<std::size_t>(fields_);
  const cl::NDRange sums(static_cast<std::size_t>(chunks_), fields),
      totals(static_cast<std::size_t>(group_) * fields);
  const cl::NDRange sums_local = device_.info().gpu ? cl::NDRange(gpu_sum_group, 1) : cl::NDRange(1, 1);
  const cl::NDRange totals_local(static_cast<std::size_t>(group_));
  device_.queue().enqueueFillBuffer(x, cl_uchar{0}, 0, fields * finest.field_cells() * real);
  launch("sum_source", sums, sums_local, cells, finest.inverse_diagonal, b, partial_);
  launch("finish_source", totals, totals_local, partial_, scalars_);
  std::vector<double> history;
  for (int cycle = 0; cycle <= cycles; ++cycle) {
    launch("residual", sums, sums_local, finest.cells, finest_operator(), finest.inverse_diagonal, b, x,
           scalars_, finest.b, partial_);
    launch("finish_residual", totals, totals_local, cl_int{1}, partial_, scalars_);
    if (cycle > 0) history.push_back(relative_residual(0));
    if (cycle == cycles) break;
    v_cycle();
    launch("add_correction", sums, sums_local, cells, finest.inverse_diagonal, finest.x, x);
  }
  return history;
}

}  // namespace cohort
