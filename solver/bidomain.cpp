#include "solver/bidomain.hpp"

#include <algorithm>
#include <cmath>

#include "solver/electrophysiology.hpp"
#include "solver/precision.hpp"

namespace cohort {

namespace {

// A source (root mean square, mV/ms) below this counts as this much: what single precision leaves of a
// potential at rest.
constexpr double single_precision_floor = 0.01;
constexpr int most_iterations = 60;

std::size_t whole_groups(std::size_t cells) {
  return (cells + Tissue::group - 1) / Tissue::group * Tissue::group;
}

std::size_t first_place(const Tissue& tissue, std::size_t m) {
  return static_cast<std::size_t>(Tissue::first_cell_place + tissue.first_block[m] * Tissue::block_cells);
}
std::size_t places_of(const Tissue& tissue, std::size_t m) {
  return static_cast<std::size_t>((tissue.first_block[m + 1] - tissue.first_block[m]) * Tissue::block_cells);
}

}  // namespace

Bidomain::Bidomain(Launcher& launcher, const Scene& scene, const Definitions& definitions, const Grid& grid,
                   int members_per_batch)
    : launcher_(launcher),
      scene_(scene),
      conductor_(launcher, scene, grid, members_per_batch, Tissue::Holds::conductors),
      extracellular_offset_(region_parameters(scene).extracellular_offset),
      width_(launcher.device().vector_width(scene.precision == Precision::double_)),
      tolerance_(scene.parameters.value("electrophysiology.elliptic_tolerance")) {
  const cl::Program program =
      definitions.build(launcher.device(), {"segments.clh", "diffusion.clh", "bidomain.cl"},
                        {"WIDTH=" + std::to_string(width_)});
  add_couplings_ = launcher.handle(program, "add_couplings");
  source_ = launcher.handle(program, "bidomain_source");
  injected_source_ = launcher.handle(program, "injected_source");
  extrapolate_ = launcher.handle(program, "extrapolate");
  gather_ = launcher.handle(program, "gather_extracellular");
  diffusion_ = launcher.handle(program, "bidomain_diffusion");
}

std::size_t Bidomain::bytes(const Device& device, const Tissue& conductor, int members, std::int64_t stride,
                            std::int64_t conductor_stride, Precision precision) {
  const std::array<int, 3> cells = box_of(conductor, 0).cells;
  std::size_t padded = 1;
  for (const int n : cells) padded *= static_cast<std::size_t>(n) + 2;
  const std::size_t real = real_bytes(precision);
  const std::size_t dense =
      6 * padded * real +
      EllipticSolver::bytes(device, cells, 1, precision == Precision::double_, Couplings::cross);
  return Tissue::bytes(conductor.grid(), members, conductor_stride, precision) +
         Diffusion::bytes(conductor_stride, precision) + static_cast<std::size_t>(members) * dense +
         6 * static_cast<std::size_t>(stride) * real;
}

// The smallest box that holds what conducts of member m.
Bidomain::Box Bidomain::box_of(const Tissue& conductor, std::size_t m) {
  const auto& [nx, ny, nz] = conductor.grid().cells;
  std::array<int, 3> lower = {nx, ny, nz}, upper = {0, 0, 0};
  const std::size_t begin = first_place(conductor, m), end = begin + places_of(conductor, m);
  for (std::size_t i = begin; i < end; ++i) {
    if (conductor.regions[i] == 255) continue;
    const std::int64_t cell = conductor.first_cells[i / Tissue::lanes] % conductor.grid().size();
    const std::array<int, 3> place = {static_cast<int>(cell % nx) + static_cast<int>(i % Tissue::lanes),
                                      static_cast<int>(cell / nx % ny),
                                      static_cast<int>(cell / (std::int64_t{nx} * ny))};
    for (std::size_t a = 0; a < 3; ++a) {
      lower[a] = std::min(lower[a], place[a]);
      upper[a] = std::max(upper[a], place[a]);
    }
  }
  Box box;
  for (std::size_t a = 0; a < 3; ++a) {
    box.lower[a] = std::min(lower[a], upper[a]);
    box.cells[a] = std::max(upper[a] - lower[a] + 1, 1);
  }
  return box;
}

void Bidomain::assemble(const Tissue& tissue, Diffusion& diffusion, const Monodomain& monodomain,
                        const cl::Buffer& parameters, std::span<const Member> members) {
  Device& device = launcher_.device();
  const std::size_t real = real_bytes(scene_.precision);
  conductor_.build(parameters, static_cast<int>(members.size()));
  conductor_.build_fibres(parameters);
  if (conductor_.stride > conductor_capacity_) {
    conductor_capacity_ = conductor_.stride + conductor_.stride / 16;
    conductor_stencil_ =
        device.allocate(Diffusion::bytes(conductor_capacity_, scene_.precision), "conductor stencil");
  }
  if (tissue.stride > capacity_) {
    capacity_ = tissue.stride + tissue.stride / 16;
    const auto bytes = static_cast<std::size_t>(capacity_) * real;
    // Void cells are read as neighbours and never written.
    for (cl::Buffer* buffer : {&extracellular_, &intracellular_, &diffused_}) {
      *buffer = device.allocate(bytes);
      launcher_.queue().enqueueFillBuffer(*buffer, cl_uchar{0}, 0, bytes);
    }
    for (cl::Buffer& buffer : scratch_) buffer = cl::Buffer();
  }
  diffusion.assemble(conductor_, parameters, extracellular_offset_, 1.0, Diffusion::Use::layered,
                     conductor_stencil_);
  build_operators(tissue, monodomain.stencil());
  boundary_current(members);
}

void Bidomain::build_operators(const Tissue& tissue, const cl::Buffer& intracellular) {
  Device& device = launcher_.device();
  const std::size_t real = real_bytes(scene_.precision);
  const std::size_t members = conductor_.first_block.size() - 1;
  boxes_.resize(members);
  for (std::size_t m = 0; m < members; ++m) {
    Box box = box_of(conductor_, m);
    if (boxes_[m].solver && boxes_[m].cells == box.cells) {
      const std::array<int, 3> lower = box.lower;
      box = std::move(boxes_[m]);
      box.lower = lower;
    } else {
      boxes_[m] = {};
      box.solver = std::make_unique<EllipticSolver>(device, box.cells, 1,
                                                    scene_.precision == Precision::double_, Couplings::cross);
      for (cl::Buffer* buffer : box.fields()) *buffer = device.allocate(box.solver->field_cells() * real);
    }
    const std::size_t bytes = box.solver->field_cells() * real;
    cl::CommandQueue& queue = launcher_.queue();
    for (const cl::Buffer* buffer : box.fields()) queue.enqueueFillBuffer(*buffer, cl_uchar{0}, 0, bytes);
    for (const cl::Buffer* buffer : {&box.solver->conductance(), &box.solver->cross()})
      queue.enqueueFillBuffer(*buffer, cl_uchar{0}, 0, 3 * bytes);
    const auto add = [&](const Tissue& cells, const cl::Buffer& stencil) {
      launcher_(add_couplings_, cl::NDRange(places_of(cells, m)), cl::NDRange(Tissue::group),
                static_cast<double>(19 * real * places_of(cells, m)), cells.first_cell, cells.capacity,
                stencil, box.solver->conductance(), box.solver->cross(), box.lower[0], box.lower[1],
                box.lower[2], box.cells[0], box.cells[1], box.cells[2], cells.stride,
                static_cast<int>(first_place(cells, m)));
    };
    add(conductor_, conductor_stencil_);
    add(tissue, intracellular);
    queue.finish();  // the elliptic solver has a queue of its own while this one profiles
    box.solver->prepare();
    device.queue().finish();
    box.share = 0;
    boxes_[m] = std::move(box);
  }
  initialise();
}

void Bidomain::initialise() {
  worst_residual_.assign(boxes_.size(), 0);
  for (Box& box : boxes_) {
    for (Box::Track& track : box.tracks) {
      launcher_.queue().enqueueFillBuffer(track.potential, cl_uchar{0}, 0,
                                          box.solver->field_cells() * real_bytes(scene_.precision));
      track.solved = 0;
    }
  }
  stale_ = true;
}

void Bidomain::boundary_current(std::span<const Member> members) {
  injected_ms_.clear();
  injects_ = false;
  std::vector<double> current(static_cast<std::size_t>(conductor_.stride), 0.0);
  const ParameterTable& table = scene_.parameters;
  for (std::size_t m = 0; m < members.size(); ++m) {
    const auto value = [&](const std::string& name) {
      return members[m].values[static_cast<std::size_t>(table.index("electrophysiology." + name))];
    };
    const double start = value("boundary_current_start_ms");
    injected_ms_.push_back({start, start + value("boundary_current_duration_ms")});
    if (injected_ms_[m][1] <= start) continue;
    const double membrane = value("surface_to_volume_per_mm") * value("capacitance_uF_per_mm2");
    const std::size_t begin = first_place(conductor_, m), end = begin + places_of(conductor_, m);
    const char* components[] = {".x", ".y", ".z"};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double density = value(std::string("boundary_current_uA_per_mm2") + components[axis]);
      if (density == 0) continue;
      std::vector<std::size_t> ends[2];
      for (std::size_t i = begin; i < end; ++i) {
        if (conductor_.regions[i] == 255) continue;
        const double place =
            (conductor_.centre(i)[axis] - conductor_.grid().origin_mm[axis]) / conductor_.grid().dx_mm - 0.5;
        const auto index = static_cast<int>(std::lround(place)) - boxes_[m].lower[axis];
        if (index == 0) ends[0].push_back(i);
        if (index == boxes_[m].cells[axis] - 1) ends[1].push_back(i);
      }
      // All that enters leaves, should the upper end have another area than the lower.
      const double each = density / (membrane * conductor_.grid().dx_mm);
      for (const std::size_t i : ends[0]) current[i] += each;
      for (const std::size_t i : ends[1])
        current[i] -= each * static_cast<double>(ends[0].size()) / static_cast<double>(ends[1].size());
      injects_ = true;
    }
  }
  if (injects_) inject(current);
}

void Bidomain::inject(const std::vector<double>& current) {
  injects_ = true;
  const auto& [nx, ny, nz] = conductor_.grid().cells;
  for (std::size_t m = 0; m < boxes_.size(); ++m) {
    Box& box = boxes_[m];
    std::vector<double> dense(box.solver->field_cells(), 0.0);
    const std::size_t begin = first_place(conductor_, m), end = begin + places_of(conductor_, m);
    for (std::size_t i = begin; i < end; ++i) {
      if (conductor_.regions[i] == 255) continue;
      const std::int64_t cell = conductor_.first_cells[i / Tissue::lanes] % conductor_.grid().size();
      const std::int64_t x = cell % nx + static_cast<std::int64_t>(i % Tissue::lanes) - box.lower[0] + 1,
                         y = cell / nx % ny - box.lower[1] + 1,
                         z = cell / (std::int64_t{nx} * ny) - box.lower[2] + 1;
      dense[static_cast<std::size_t>(x + (box.cells[0] + 2) * (y + (box.cells[1] + 2) * z))] = current[i];
    }
    const std::vector<std::byte> packed = pack(dense, scene_.precision);
    if (box.injected() == nullptr) box.injected = launcher_.device().allocate(packed.size(), "injected");
    launcher_.queue().enqueueWriteBuffer(box.injected, CL_TRUE, 0, packed.size(), packed.data());
  }
}

// Of the time from `from_ms` to `to_ms`, or of the moment where they are one: the share in which the current
// flows.
double Bidomain::injected_share(std::size_t m, double from_ms, double to_ms) const {
  if (!injects_) return 0;
  const auto& [start, end] = injected_ms_[m];
  if (!(to_ms > from_ms)) return from_ms >= start && from_ms < end ? 1 : 0;
  return std::max(0.0, std::min(to_ms, end) - std::max(from_ms, start)) / (to_ms - from_ms);
}

// phi_e of V at one stage of a step, and gathers it with V.
void Bidomain::solve(const Tissue& tissue, const Monodomain& monodomain, const cl::Buffer& V, double from_ms,
                     double to_ms, Stage stage, bool next_step) {
  Device& device = launcher_.device();
  const auto real = static_cast<double>(real_bytes(scene_.precision));
  for (std::size_t m = 0; m < boxes_.size(); ++m) {
    Box& box = boxes_[m];
    Box::Track& track = box.tracks[stage];
    const std::size_t cells = places_of(tissue, m), dense = box.solver->field_cells();
    const cl::Buffer& injected = injects_ ? box.injected : box.source;  // not read without a share
    const double share = injected_share(m, from_ms, to_ms);
    if (share != box.share) {
      launcher_(injected_source_, cl::NDRange(whole_groups(dense)), cl::NDRange(Tissue::group),
                2 * real * static_cast<double>(dense), box.injected, box.source, static_cast<int>(dense),
                Real{share});
      box.share = share;
    }
    launcher_(source_, cl::NDRange(cells / static_cast<std::size_t>(width_)),
              cl::NDRange(Tissue::block_cells / static_cast<std::size_t>(width_)),
              9 * real * static_cast<double>(cells), V, monodomain.stencil(), tissue.capacity,
              tissue.neighbours, tissue.first_cell, injected, box.source, box.lower[0], box.lower[1],
              box.lower[2], box.cells[0], box.cells[1], box.cells[2], tissue.stride,
              static_cast<int>(first_place(tissue, m)), Real{share});
    if (next_step) {
      if (track.solved >= 2)
        launcher_(extrapolate_, cl::NDRange(whole_groups(dense)), cl::NDRange(Tissue::group),
                  4 * real * static_cast<double>(dense), track.potential, track.before,
                  static_cast<int>(dense));
      else
        launcher_.queue().enqueueCopyBuffer(track.potential, track.before, 0, 0,
                                            dense * real_bytes(scene_.precision));
      track.solved = std::min(track.solved + 1, 2);
    }
    const bool own_queue = &launcher_.queue() != &device.queue();
    if (own_queue) launcher_.queue().finish();
    EllipticOptions options{tolerance_};
    options.max_iterations = most_iterations;
    options.check_every = 1;
    options.from_given = true;
    options.floor = scene_.precision == Precision::single_ ? single_precision_floor : 0;
    options.verify = false;
    const EllipticResult result = box.solver->solve(box.source, track.potential, options);
    if (own_queue) device.queue().finish();
    ++solves_;
    iterations_ += result.iterations;
    if (!(result.relative_residual <= worst_residual_[m])) worst_residual_[m] = result.relative_residual;
  }
}

// The potentials of both spaces, phi_e and V + phi_e, from the solution of a stage.
void Bidomain::gather(const Tissue& tissue, const cl::Buffer& V, Stage stage) {
  const auto real = static_cast<double>(real_bytes(scene_.precision));
  for (std::size_t m = 0; m < boxes_.size(); ++m) {
    const Box& box = boxes_[m];
    const std::size_t cells = places_of(tissue, m);
    launcher_(gather_, cl::NDRange(cells), cl::NDRange(Tissue::group), 5 * real * static_cast<double>(cells),
              box.tracks[stage].potential, V, tissue.capacity, tissue.first_cell, extracellular_,
              intracellular_, box.lower[0], box.lower[1], box.lower[2], box.cells[0], box.cells[1],
              box.cells[2], static_cast<int>(first_place(tissue, m)));
  }
}

const cl::Buffer& Bidomain::scratch(std::size_t which) {
  cl::Buffer& buffer = scratch_[which];
  if (buffer() == nullptr) {
    const auto bytes = static_cast<std::size_t>(capacity_) * real_bytes(scene_.precision);
    buffer = launcher_.device().allocate(bytes);
    launcher_.queue().enqueueFillBuffer(buffer, cl_uchar{0}, 0, bytes);
  }
  return buffer;
}

// to = base + dt_ms L_i stage - phi_e, the potentials that are gathered.
void Bidomain::last_stage(const Tissue& tissue, const Monodomain& monodomain, const cl::Buffer& stage,
                          const cl::Buffer& base, double dt_ms, const cl::Buffer& to) {
  const auto cells = static_cast<std::size_t>(tissue.blocks) * Tissue::block_cells;
  const auto real = static_cast<double>(real_bytes(scene_.precision));
  launcher_(diffusion_, cl::NDRange(cells / static_cast<std::size_t>(width_)),
            cl::NDRange(Tissue::block_cells / static_cast<std::size_t>(width_)),
            static_cast<double>(cells) * (11 * real + 4), stage, base, extracellular_, to,
            monodomain.stencil(), tissue.inverse_capacity, tissue.neighbours, tissue.stride, Real{dt_ms});
}

// V after dt_ms / 2 beside the phi_e that is gathered, to first order.
void Bidomain::half_step(const Tissue& tissue, Monodomain& monodomain, double dt_ms, const cl::Buffer& to) {
  const int substeps = (monodomain.substeps() + 1) / 2;
  const cl::Buffer* from = &intracellular_;
  for (int substep = 1; substep < substeps; ++substep) {
    const cl::Buffer& next = scratch(static_cast<std::size_t>(substep % 2));
    monodomain.diffusion_stage(tissue, *from, *from, next, 0.5 * dt_ms / substeps);
    from = &next;
  }
  last_stage(tissue, monodomain, *from, *from, 0.5 * dt_ms / substeps, to);
}

void Bidomain::advance(const Tissue& tissue, Monodomain& monodomain, const cl::Buffer& parameters,
                       double time_ms, bool first) {
  const double dt_ms = (first ? 0.5 : 1.0) * monodomain.dt_ms();
  if (stale_) {
    solve(tissue, monodomain, monodomain.potential(), time_ms, time_ms, at_start, true);
    gather(tissue, monodomain.potential(), at_start);
  }
  half_step(tissue, monodomain, dt_ms, diffused_);
  // Diffusion runs half a step behind time_ms, the first of a run aside: all of its own time counts, so that
  // a current brings its charge whatever the steps.
  const double from_ms = first ? time_ms : time_ms - 0.5 * dt_ms;
  solve(tissue, monodomain, diffused_, from_ms, from_ms + dt_ms, at_middle, true);
  gather(tissue, monodomain.potential(), at_middle);
  const int substeps = monodomain.substeps();
  const cl::Buffer* from = &intracellular_;
  for (int substep = 1; substep < substeps; ++substep) {
    const cl::Buffer& next = scratch(static_cast<std::size_t>(substep % 2));
    monodomain.diffuse(tissue, *from, next, dt_ms / substeps);
    from = &next;
  }
  const cl::Buffer& stage = scratch(2);
  monodomain.diffusion_stage(tissue, *from, *from, stage, 0.5 * dt_ms / substeps);
  last_stage(tissue, monodomain, stage, *from, dt_ms / substeps, diffused_);
  monodomain.react(tissue, parameters, time_ms, diffused_);
  stale_ = true;
}

const cl::Buffer& Bidomain::closed_potential(const Tissue& tissue, Monodomain& monodomain, double time_ms) {
  if (stale_) {
    solve(tissue, monodomain, monodomain.potential(), time_ms, time_ms, at_start, true);
    gather(tissue, monodomain.potential(), at_start);
  }
  stale_ = false;
  half_step(tissue, monodomain, monodomain.dt_ms(), diffused_);
  return diffused_;
}

const cl::Buffer& Bidomain::extracellular(const Tissue& tissue, const Monodomain& monodomain,
                                          const cl::Buffer& V, double time_ms) {
  solve(tissue, monodomain, V, time_ms, time_ms, at_start, false);
  gather(tissue, V, at_start);
  stale_ = true;
  return extracellular_;
}

std::vector<double> Bidomain::potential_of_conductor(std::size_t m) const {
  const Box& box = boxes_[m];
  std::vector<std::byte> raw(box.solver->field_cells() * real_bytes(scene_.precision));
  launcher_.queue().enqueueReadBuffer(box.tracks[at_start].potential, CL_TRUE, 0, raw.size(), raw.data());
  const std::vector<double> dense = unpack(raw, scene_.precision);
  const auto& [nx, ny, nz] = conductor_.grid().cells;
  std::vector<double> result;
  const std::size_t begin = first_place(conductor_, m), end = begin + places_of(conductor_, m);
  for (std::size_t i = begin; i < end; ++i) {
    if (conductor_.regions[i] == 255) continue;
    const std::int64_t cell = conductor_.first_cells[i / Tissue::lanes] % conductor_.grid().size();
    const std::int64_t x = cell % nx + static_cast<std::int64_t>(i % Tissue::lanes) - box.lower[0] + 1,
                       y = cell / nx % ny - box.lower[1] + 1,
                       z = cell / (std::int64_t{nx} * ny) - box.lower[2] + 1;
    result.push_back(dense[static_cast<std::size_t>(x + (box.cells[0] + 2) * (y + (box.cells[1] + 2) * z))]);
  }
  return result;
}

}  // namespace cohort
