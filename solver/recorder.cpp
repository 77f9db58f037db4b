#include "solver/recorder.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace cohort {

namespace {

constexpr std::size_t check_width = 3;  // numbers of a member in a look

// Bounds of the states of all models, a little wider: gates end at 0 and 1 to rounding.
std::string state_bounds(const CellModels& models) {
  constexpr double tolerance = 1e-4;
  std::ostringstream lowest, highest;
  lowest << std::scientific;
  highest << std::scientific;
  for (const CellModel& model : models.all())
    for (std::size_t k = 0; k < models.states(); ++k) {
      const bool there = k < model.states.size();
      lowest << (there ? model.states[k].lowest - tolerance : -CellModel::unbounded) << "f,";
      highest << (there ? model.states[k].highest + tolerance : CellModel::unbounded) << "f,";
    }
  return "constant float lowest_state[] = {" + lowest.str() + "}, highest_state[] = {" + highest.str() +
         "};\n";
}

}  // namespace

Recorder::Recorder(Launcher& launcher, const Scene& scene, const Definitions& definitions,
                   int members_per_batch, int samples)
    : launcher_(launcher),
      definitions_(definitions),
      precision_(scene.precision),
      members_per_batch_(members_per_batch),
      samples_(samples),
      quantities_((scene.ecg ? LeadWeights::leads : 0) + 1),
      weighted_(scene.ecg && scene.ecg->method == EcgRequest::Method::lead_field ? LeadWeights::leads : 0),
      width_(launcher.device().vector_width(scene.precision == Precision::double_)),
      scene_(scene),
      models_(scene) {}

// What a time loop needs: without one there is no sample.
void Recorder::begin() {
  Device& device = launcher_.device();
  Definitions own = definitions_;
  own.generated += state_bounds(models_);
  const cl::Program program =
      own.build(device, {"segments.clh", "diffusion.clh", "sum_of_group.clh", "record.cl", "cell_checks.cl"},
                {"WIDTH=" + std::to_string(width_), "LEADS=" + std::to_string(weighted_),
                 "ROW=" + std::to_string(quantities_), "CELL_MODELS=" + std::to_string(models_.all().size()),
                 "STATES=" + std::to_string(models_.states())});
  record_blocks_ = launcher_.handle(program, "record_blocks");
  record_totals_ = launcher_.handle(program, "record_totals");
  check_cells_ = launcher_.handle(program, "check_cells");
  check_members_ = launcher_.handle(program, "check_members");
  const auto bytes =
      static_cast<std::size_t>(samples_ * members_per_batch_ * quantities_) * real_bytes(precision_);
  for (cl::Buffer& half : series_) half = device.allocate(bytes, "samples");
  const auto members = static_cast<std::size_t>(members_per_batch_);
  for (cl::Buffer& half : checks_) half = device.allocate(members * check_width * real_bytes(precision_));
  bounds_buffer_ = device.allocate(members * 2 * real_bytes(precision_));
  first_block_ = device.allocate((members + 1) * sizeof(int));
}

std::size_t Recorder::bytes(const Scene& scene, int members_per_batch, int samples, std::int64_t stride) {
  const auto quantities = static_cast<std::size_t>((scene.ecg ? LeadWeights::leads : 0) + 1);
  const auto members = static_cast<std::size_t>(members_per_batch);
  const auto blocks = static_cast<std::size_t>(stride / Tissue::block_cells + 1);
  const std::size_t real = real_bytes(scene.precision);
  const bool weighted = scene.ecg && scene.ecg->method == EcgRequest::Method::lead_field;
  const std::size_t sums_of_weights = weighted ? 2 * LeadWeights::leads * blocks * real : 0;
  constexpr std::size_t small = 8;  // buffers of a few numbers
  return sums_of_weights + small * Device::least_bytes +
         (2 * static_cast<std::size_t>(samples) * members + blocks) * quantities * real +
         (members + 1) * sizeof(int) + 2 * members * (check_width + 1) * real +
         blocks * (4 * sizeof(int) + 4 * real);
}

void Recorder::make_room(const Tissue& tissue) {
  if (tissue.blocks <= capacity_blocks_) return;
  capacity_blocks_ = tissue.blocks + tissue.blocks / 16 + 1;
  Device& device = launcher_.device();
  const auto blocks = static_cast<std::size_t>(capacity_blocks_);
  const std::size_t real = real_bytes(precision_);
  partial_ = device.allocate(blocks * static_cast<std::size_t>(quantities_) * real, "partial sums");
  moved_ = device.allocate(2 * blocks * real);
  for (cl::Buffer* buffer : {&wild_, &beyond_}) *buffer = device.allocate(2 * blocks * sizeof(int));
  for (cl::Buffer* buffer : {&wild_mV_, &beyond_state_}) *buffer = device.allocate(blocks * real);
}

void Recorder::prepare(const Tissue& tissue, std::span<const Member> members) {
  if (first_block_() == nullptr) begin();
  members_ = static_cast<int>(tissue.first_block.size()) - 1;
  half_ = sample_ = 0;
  arrived_[0] = arrived_[1] = cl::Event();
  make_room(tissue);
  cl::CommandQueue& queue = launcher_.queue();
  queue.enqueueWriteBuffer(first_block_, CL_TRUE, 0, tissue.first_block.size() * sizeof(int),
                           tissue.first_block.data());
  bounds_.clear();
  std::vector<double> bounds;
  for (const Member& member : members) {
    bounds_.push_back(potential_bounds(scene_, models_, member.values));
    bounds.insert(bounds.end(), bounds_.back().begin(), bounds_.back().end());
  }
  const std::vector<std::byte> packed = pack(bounds, precision_);
  queue.enqueueWriteBuffer(bounds_buffer_, CL_TRUE, 0, packed.size(), packed.data());
  for (const cl::Buffer* buffer : {&wild_, &beyond_})
    queue.enqueueFillBuffer(*buffer, cl_int{-1}, 0,
                            2 * static_cast<std::size_t>(tissue.blocks) * sizeof(int));
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
            weights != nullptr ? *weights : monodomain.potential(), tissue.member_of, bounds_buffer_,
            partial_, wild_, wild_mV_, tissue.stride, tissue.blocks, sample_++,
            Real{substeps || closed != nullptr ? 0.0 : monodomain.open_ms()});
  const auto rows = static_cast<std::size_t>(members_ * (weighted_ + 1));
  launcher_(record_totals_, cl::NDRange(gpu ? rows * group : rows), cl::NDRange(gpu ? group : 1),
            static_cast<double>(blocks) * (weighted_ + 1) * real, partial_, first_block_, series_[half_],
            tissue.blocks, members_, slot);
}

void Recorder::look(const Tissue& tissue, const Monodomain& monodomain) {
  const bool gpu = launcher_.device().info().gpu;
  const auto blocks = static_cast<std::size_t>(tissue.blocks), members = static_cast<std::size_t>(members_);
  const auto group = static_cast<std::size_t>(Tissue::block_cells);
  const auto real = static_cast<double>(real_bytes(precision_));
  launcher_(check_cells_, cl::NDRange(gpu ? blocks * group : blocks), cl::NDRange(gpu ? group : 1),
            static_cast<double>(blocks * group) * (real * static_cast<double>(8 + models_.states()) + 4),
            monodomain.potential(), monodomain.stencil(), tissue.inverse_capacity, tissue.neighbours,
            monodomain.states(), monodomain.model_of(), moved_, beyond_, beyond_state_, tissue.stride,
            tissue.blocks, sample_ - 1);
  launcher_(check_members_, cl::NDRange(gpu ? members * group : members), cl::NDRange(gpu ? group : 1),
            static_cast<double>(blocks) * (2 * real + 4), moved_, beyond_, first_block_, checks_[half_],
            tissue.blocks);
}

std::vector<double> Recorder::weights_left(const Tissue& tissue, const cl::Buffer& weights) {
  if (check_weights_.program() == nullptr)
    check_weights_ = launcher_.handle(
        definitions_.build(launcher_.device(), {"segments.clh", "sum_of_group.clh", "check_weights.cl"},
                           {"WIDTH=" + std::to_string(width_), "LEADS=" + std::to_string(weighted_)}),
        "check_weights");
  const bool gpu = launcher_.device().info().gpu;
  const auto blocks = static_cast<std::size_t>(tissue.blocks), leads = static_cast<std::size_t>(weighted_);
  const auto group = static_cast<std::size_t>(Tissue::block_cells);
  const cl::Buffer sums =
      launcher_.device().allocate(2 * leads * blocks * real_bytes(precision_), "sums of weights");
  launcher_(check_weights_, cl::NDRange(gpu ? blocks * group : blocks), cl::NDRange(gpu ? group : 1),
            static_cast<double>(blocks * group * leads * real_bytes(precision_)), weights, sums,
            tissue.stride, tissue.blocks);
  std::vector<std::byte> raw(2 * leads * blocks * real_bytes(precision_));
  launcher_.queue().enqueueReadBuffer(sums, CL_TRUE, 0, raw.size(), raw.data());
  const std::vector<double> host = unpack(raw, precision_);
  std::vector<double> left;
  for (std::size_t m = 0; m + 1 < tissue.first_block.size(); ++m) {
    double worst = 0;
    for (std::size_t q = 0; q < leads; ++q) {
      double net = 0, all = 0;
      for (auto b = static_cast<std::size_t>(tissue.first_block[m]);
           b < static_cast<std::size_t>(tissue.first_block[m + 1]); ++b) {
        net += host[q * blocks + b];
        all += host[(leads + q) * blocks + b];
      }
      if (all > 0) worst = std::max(worst, std::abs(net) / all);
    }
    left.push_back(worst);
  }
  return left;
}

void Recorder::start_fetch(int count) {
  std::vector<std::byte>&host = host_[half_], &checks = host_checks_[half_];
  checks.resize(static_cast<std::size_t>(members_) * check_width * real_bytes(precision_));
  launcher_.queue().enqueueReadBuffer(checks_[half_], CL_FALSE, 0, checks.size(), checks.data());
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
  const std::vector<double> checks = unpack(host_checks_[half], precision_);
  looks_.clear();
  for (std::size_t m = 0; m < checks.size(); m += check_width)
    looks_.push_back({checks[m], checks[m + 1], checks[m + 2] > 0});
  return unpack(host_[half], precision_);
}

Recorder::First Recorder::first_wild(const Tissue& tissue, std::size_t m) {
  return first(tissue, m, wild_, wild_mV_);
}
Recorder::First Recorder::first_state_beyond(const Tissue& tissue, std::size_t m) {
  return first(tissue, m, beyond_, beyond_state_);
}

Recorder::First Recorder::first(const Tissue& tissue, std::size_t m, const cl::Buffer& places,
                                const cl::Buffer& numbers) {
  const auto blocks = static_cast<std::size_t>(tissue.blocks);
  std::vector<int> host(2 * blocks);
  std::vector<std::byte> raw(blocks * real_bytes(precision_));
  launcher_.queue().enqueueReadBuffer(places, CL_TRUE, 0, host.size() * sizeof(int), host.data());
  launcher_.queue().enqueueReadBuffer(numbers, CL_TRUE, 0, raw.size(), raw.data());
  const std::vector<double> what = unpack(raw, precision_);
  First result;
  bool found = false;
  for (auto b = static_cast<std::size_t>(tissue.first_block[m]);
       b < static_cast<std::size_t>(tissue.first_block[m + 1]); ++b) {
    if (host[2 * b] < 0 || (found && host[2 * b] >= result.sample)) continue;
    found = true;
    result = {host[2 * b], static_cast<std::size_t>(host[2 * b + 1]), what[b]};
  }
  return result;
}

}  // namespace cohort
