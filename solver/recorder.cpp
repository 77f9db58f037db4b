#include "solver/recorder.hpp"

namespace cohort {

Recorder::Recorder(Launcher& launcher, const Scene& scene, const Definitions& definitions,
                   int members_per_batch, int samples)
    : launcher_(launcher),
      precision_(scene.precision),
      members_per_batch_(members_per_batch),
      samples_(samples),
      quantities_((scene.ecg ? LeadWeights::leads : 0) + 1),
      weighted_(scene.ecg && scene.ecg->method == EcgRequest::Method::lead_field ? LeadWeights::leads : 0),
      width_(launcher.device().vector_width(scene.precision == Precision::double_)) {
  Device& device = launcher.device();
  const cl::Program program =
      definitions.build(device, {"segments.clh", "diffusion.clh", "record.cl"},
                        {"WIDTH=" + std::to_string(width_), "LEADS=" + std::to_string(weighted_),
                         "ROW=" + std::to_string(quantities_)});
  record_blocks_ = launcher.handle(program, "record_blocks");
  record_totals_ = launcher.handle(program, "record_totals");
  const auto bytes =
      static_cast<std::size_t>(samples * members_per_batch * quantities_) * real_bytes(precision_);
  for (cl::Buffer& half : series_) half = device.allocate(bytes);
  first_block_ = device.allocate(static_cast<std::size_t>(members_per_batch + 1) * sizeof(int));
}

std::size_t Recorder::bytes(const Scene& scene, int members_per_batch, int samples, std::int64_t stride) {
  const auto quantities = static_cast<std::size_t>((scene.ecg ? LeadWeights::leads : 0) + 1);
  const auto members = static_cast<std::size_t>(members_per_batch);
  const auto blocks = static_cast<std::size_t>(stride / Tissue::block_cells + 1);
  return (2 * static_cast<std::size_t>(samples) * members + blocks) * quantities *
             real_bytes(scene.precision) +
         (members + 1) * sizeof(int);
}

void Recorder::prepare(const Tissue& tissue) {
  members_ = static_cast<int>(tissue.first_block.size()) - 1;
  half_ = 0;
  arrived_[0] = arrived_[1] = cl::Event();
  if (tissue.blocks > capacity_blocks_) {
    capacity_blocks_ = tissue.blocks + tissue.blocks / 16 + 1;
    partial_ = launcher_.device().allocate(static_cast<std::size_t>(capacity_blocks_ * quantities_) *
                                           real_bytes(precision_));
  }
  launcher_.queue().enqueueWriteBuffer(first_block_, CL_TRUE, 0, tissue.first_block.size() * sizeof(int),
                                       tissue.first_block.data());
}

void Recorder::sample(const Tissue& tissue, Monodomain& monodomain, const cl::Buffer* weights, int slot,
                      const cl::Buffer* closed) {
  // Within the explicit limit the closing half step is part of the sum; beyond it it takes substeps of its
  // own.
  const bool substeps = closed == nullptr && monodomain.substeps() > 1;
  const cl::Buffer& potential = closed != nullptr ? *closed
                                : substeps        ? monodomain.closed_potential(tissue)
                                                  : monodomain.potential();
  const bool gpu = launcher_.device().info().gpu;
  const auto blocks = static_cast<std::size_t>(tissue.blocks);
  const auto group = static_cast<std::size_t>(Tissue::block_cells);
  const double real = static_cast<double>(real_bytes(precision_));
  const double bytes = static_cast<double>(blocks * group) * (real * (8 + weighted_) + 4);
  launcher_(record_blocks_, cl::NDRange(gpu ? blocks * group : blocks), cl::NDRange(gpu ? group : 1), bytes,
            potential, monodomain.stencil(), tissue.inverse_capacity, tissue.neighbours,
            weights != nullptr ? *weights : monodomain.potential(), partial_, tissue.stride, tissue.blocks,
            Real{substeps || closed != nullptr ? 0.0 : monodomain.open_ms()});
  const auto rows = static_cast<std::size_t>(members_ * (weighted_ + 1));
  launcher_(record_totals_, cl::NDRange(gpu ? rows * group : rows), cl::NDRange(gpu ? group : 1),
            static_cast<double>(blocks) * (weighted_ + 1) * real, partial_, first_block_, series_[half_],
            tissue.blocks, members_, slot);
}

void Recorder::start_fetch(int count) {
  std::vector<std::byte>& host = host_[half_];
  host.resize(static_cast<std::size_t>(count * members_ * quantities_) * real_bytes(precision_));
  launcher_.queue().enqueueReadBuffer(series_[half_], CL_FALSE, 0, host.size(), host.data(), nullptr,
                                      &arrived_[half_]);
  launcher_.queue().flush();
  half_ = 1 - half_;
}

std::vector<double> Recorder::fetched(bool last) {
  const int half = last ? 1 - half_ : half_;
  if (arrived_[half]() == nullptr) return {};
  arrived_[half].wait();
  arrived_[half] = cl::Event();
  return unpack(host_[half], precision_);
}

}  // namespace cohort
