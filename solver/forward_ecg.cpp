#include "solver/forward_ecg.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "solver/electrophysiology.hpp"
#include "solver/precision.hpp"

namespace cohort {

namespace {
constexpr double tolerance = 1e-5;  // of a sample's residual; what it changes in a lead is below 1e-4
constexpr int corners = 8;
}  // namespace

ForwardEcg::ForwardEcg(Launcher& launcher, const Scene& scene, const Definitions& definitions)
    : launcher_(launcher),
      scene_(scene),
      intracellular_offset_(region_parameters(scene).intracellular_offset),
      width_(launcher.device().vector_width(scene.precision == Precision::double_)) {
  const cl::Program program = definitions.build(launcher.device(), {"segments.clh", "forward_ecg.cl"},
                                                {"WIDTH=" + std::to_string(width_)});
  dipole_ = launcher.handle(program, "tissue_dipoles");
  deposit_ = launcher.handle(program, "deposit_dipoles");
  read_ = launcher.handle(program, "read_leads");
}

std::size_t ForwardEcg::bytes(std::int64_t stride, Precision precision) {
  const std::size_t real = real_bytes(precision);
  return static_cast<std::size_t>(stride) * (12 * real + corners * (3 * real + sizeof(int)));
}

double ForwardEcg::iterations_per_sample() const {
  return solves_ > 0 ? static_cast<double>(iterations_) / static_cast<double>(solves_) : 0;
}

void ForwardEcg::assemble(const Tissue& tissue, Diffusion& diffusion, const cl::Buffer& parameters,
                          std::span<const Member> members) {
  Device& device = launcher_.device();
  const std::size_t real = real_bytes(scene_.precision);
  if (tissue.stride > capacity_) {
    capacity_ = tissue.stride + tissue.stride / 16;
    const std::size_t row = static_cast<std::size_t>(capacity_) * real;
    faces_ = device.allocate(3 * row, "faces of the source");
    conductivity_ = device.allocate(6 * row, "conductivity of the source");
    dipoles_ = device.allocate(3 * row, "dipoles");
  }
  const double dx = tissue.grid().dx_mm;
  const cl::Buffer& conductivity =
      diffusion.assemble_source(tissue, parameters, intracellular_offset_, dx * dx, faces_);
  launcher_.queue().enqueueCopyBuffer(conductivity, conductivity_, 0, 0,
                                      6 * static_cast<std::size_t>(tissue.stride) * real);
  worst_residual_.assign(members.size(), 0);
  hearts_.resize(members.size());
  launcher_.queue().finish();  // the torso's solver has a queue of its own while this one profiles
  for (std::size_t m = 0; m < members.size(); ++m) {
    if (!hearts_[m].torso) hearts_[m].torso = std::make_unique<Torso>(device, scene_, 1);
    hearts_[m].torso->set_up(members[m].values);
    find_nodes(tissue, m, members[m]);
  }
  device.queue().finish();
}

void ForwardEcg::find_nodes(const Tissue& tissue, std::size_t m, const Member& member) {
  Heart& heart = hearts_[m];
  const LeadFields& grid = heart.torso->grid();
  const Pose pose = heart_pose(scene_.parameters, member.values);
  heart.inverse_conductivity =
      1 / member.values[static_cast<std::size_t>(scene_.parameters.index("torso.conductivity_mS_per_mm"))];
  const auto begin =
      static_cast<std::size_t>(Tissue::first_cell_place + tissue.first_block[m] * Tissue::block_cells);
  const auto end =
      static_cast<std::size_t>(Tissue::first_cell_place + tissue.first_block[m + 1] * Tissue::block_cells);
  const int steps[3] = {1, grid.extent[0], grid.extent[0] * grid.extent[1]};

  // The cells of the torso around tissue cell i, and the gradient of the trilinear function of each there, in
  // the heart's frame, 1/mm.
  struct Shares {
    std::array<int, corners> place;
    std::array<Point, corners> share;
  };
  const auto shares = [&](std::size_t i) {
    const Point at = pose(tissue.centre(i));
    Shares result{};
    std::array<std::array<double, 2>, 3> value{};  // of the lower and the upper function along each axis
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double s = std::clamp((at[axis] - grid.origin_mm[axis]) / grid.dx_mm, 1.0,
                                  static_cast<double>(grid.extent[axis]) - 2.001);
      const int lower = static_cast<int>(std::floor(s));
      value[axis] = {1 - (s - lower), s - lower};
      for (std::size_t k = 0; k < corners; ++k)
        result.place[k] += steps[axis] * (lower + static_cast<int>(k >> axis & 1));
    }
    for (std::size_t k = 0; k < corners; ++k) {
      const std::array<std::size_t, 3> side = {k & 1, k >> 1 & 1, k >> 2};
      Point slope{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t b = (axis + 1) % 3, c = (axis + 2) % 3;
        slope[axis] = (side[axis] == 1 ? 1 : -1) * value[b][side[b]] * value[c][side[c]] / grid.dx_mm;
      }
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::size_t row = 0; row < 3; ++row)
          result.share[k][axis] += pose.rotation[3 * row + axis] * slope[row];
    }
    return result;
  };
  const std::size_t cells = heart.torso->solver().field_cells();
  std::vector<int> count(cells, 0);
  for (std::size_t i = begin; i < end; ++i)
    if (tissue.regions[i] != 255)
      for (const int place : shares(i).place) ++count[static_cast<std::size_t>(place)];
  std::vector<int> node, start = {0}, next(cells, 0);
  for (std::size_t c = 0; c < cells; ++c) {
    if (count[c] == 0) continue;
    node.push_back(static_cast<int>(c));
    next[c] = start.back();
    start.push_back(start.back() + count[c]);
  }
  if (node.empty()) {  // a member without tissue, which is rejected
    heart.nodes = 0;
    return;
  }
  std::vector<int> from(static_cast<std::size_t>(start.back()));
  const std::size_t entries = from.size();
  std::vector<double> share(3 * entries);
  for (std::size_t i = begin; i < end; ++i) {
    if (tissue.regions[i] == 255) continue;
    const Shares of_cell = shares(i);
    for (std::size_t k = 0; k < corners; ++k) {
      const auto entry = static_cast<std::size_t>(next[static_cast<std::size_t>(of_cell.place[k])]++);
      from[entry] = static_cast<int>(i);
      for (std::size_t axis = 0; axis < 3; ++axis) share[entry + axis * entries] = of_cell.share[k][axis];
    }
  }
  heart.nodes = static_cast<int>(node.size());
  heart.entries = static_cast<int>(entries);
  Device& device = launcher_.device();
  const auto upload = [&](cl::Buffer& buffer, const void* data, std::size_t bytes) {
    buffer = device.allocate(bytes);
    launcher_.queue().enqueueWriteBuffer(buffer, CL_TRUE, 0, bytes, data);
  };
  upload(heart.node, node.data(), node.size() * sizeof(int));
  upload(heart.start, start.data(), start.size() * sizeof(int));
  upload(heart.from, from.data(), from.size() * sizeof(int));
  const std::vector<std::byte> packed = pack(share, scene_.precision);
  upload(heart.share, packed.data(), packed.size());
  const std::size_t bytes = cells * real_bytes(scene_.precision);
  for (cl::Buffer* buffer : {&heart.source, &heart.potential}) {
    *buffer = device.allocate(bytes);
    launcher_.queue().enqueueFillBuffer(*buffer, cl_uchar{0}, 0, bytes);
  }
  launcher_.queue().finish();
}

void ForwardEcg::sample(const Tissue& tissue, const cl::Buffer& V, const cl::Buffer& series, int row,
                        int slot) {
  Device& device = launcher_.device();
  const auto real = static_cast<double>(real_bytes(scene_.precision));
  const auto cells = static_cast<std::size_t>(tissue.blocks) * Tissue::block_cells;
  launcher_(dipole_, cl::NDRange(cells / static_cast<std::size_t>(width_)),
            cl::NDRange(Tissue::block_cells / static_cast<std::size_t>(width_)),
            13 * real * static_cast<double>(cells), V, conductivity_, faces_, tissue.neighbours, dipoles_,
            tissue.stride);
  for (std::size_t m = 0; m < hearts_.size(); ++m) {
    Heart& heart = hearts_[m];
    if (heart.nodes == 0) continue;
    const auto nodes = static_cast<std::size_t>(heart.nodes);
    launcher_(deposit_, cl::NDRange((nodes + Tissue::group - 1) / Tissue::group * Tissue::group),
              cl::NDRange(Tissue::group),
              corners * (6 * real + 4) * static_cast<double>(tissue.tissue_cells[m]), heart.node, heart.start,
              heart.from, heart.share, dipoles_, heart.source, heart.nodes, heart.entries, tissue.stride,
              Real{heart.inverse_conductivity});
    const bool own_queue = &launcher_.queue() != &device.queue();
    if (own_queue) launcher_.queue().finish();
    EllipticOptions options{tolerance};
    options.check_every = 1;
    options.from_given = true;
    options.verify = false;
    const EllipticResult result = heart.torso->solver().solve(heart.source, heart.potential, options);
    if (own_queue) device.queue().finish();
    ++solves_;
    iterations_ += result.iterations;
    if (!(result.relative_residual <= worst_residual_[m])) worst_residual_[m] = result.relative_residual;
    const LeadFields& grid = heart.torso->grid();
    launcher_(read_, cl::NDRange(1), cl::NDRange(1), 9 * 64 * 2 * real, heart.potential,
              heart.torso->electrode_weights(), heart.torso->electrode_windows(), grid.extent[0],
              grid.extent[0] * grid.extent[1], series,
              (slot * static_cast<int>(hearts_.size()) + static_cast<int>(m)) * row);
  }
}

}  // namespace cohort
