#include "solver/single_cells.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "solver/precision.hpp"

namespace cohort {

namespace {

int steps_of(double time_ms, double dt_ms) {
  return static_cast<int>(std::lround(time_ms / dt_ms));
}

}  // namespace

SingleCells::SingleCells(Launcher& launcher, Precision precision, const std::string& model, int cells)
    : launcher_(launcher),
      precision_(precision),
      model_(read_cell_model(model)),
      cells_(cells),
      width_(launcher.device().vector_width(precision == Precision::double_)) {
  padded_ = (cells + width_ - 1) / width_ * width_;
  for (int cell = 0; cell < padded_; ++cell)
    for (const Parameter& parameter : model_.parameters) parameters_.push_back(parameter.value);
  Device& device = launcher.device();
  const std::size_t real = real_bytes(precision), n = static_cast<std::size_t>(padded_);
  parameter_buffer_ = device.allocate(parameters_.size() * real, "parameter buffer");
  derived_ = device.allocate(n * model_.derived.size() * real, "derived");
  fastest_rate_ = device.allocate(n * real, "fastest rate");
  V_ = device.allocate(n * real);
  states_ = device.allocate(n * model_.states.size() * real, "states");
  const std::vector<std::string> files = {"gates.clh", "cells/" + model_.name + ".cl", "single_cells.cl"};
  std::vector<std::string> options;
  if (precision == Precision::double_) options.push_back("DOUBLE");
  const cl::Program setup = device.build(files, options, model_.macros());
  derive_ = launcher.handle(setup, "derive_single");
  initialise_ = launcher.handle(setup, "initialise_single");
  options.push_back("WIDTH=" + std::to_string(width_));
  pace_ = launcher.handle(device.build(files, options, model_.macros()), "pace_cells");
}

void SingleCells::set(int cell, const std::string& parameter, double value) {
  const auto it = std::find_if(model_.parameters.begin(), model_.parameters.end(),
                               [&](const Parameter& p) { return p.path == parameter; });
  if (it == model_.parameters.end()) throw std::out_of_range(model_.name + " has no parameter " + parameter);
  const auto k = static_cast<std::size_t>(it - model_.parameters.begin());
  parameters_[static_cast<std::size_t>(cell) * model_.parameters.size() + k] = value;
}

std::vector<double> SingleCells::read(const cl::Buffer& buffer, std::size_t count) {
  // Buffers hold padded rows; callers see rows of cells_.
  const auto row = static_cast<std::size_t>(padded_), cells = static_cast<std::size_t>(cells_);
  const std::size_t rows = count / cells, real = real_bytes(precision_);
  std::vector<std::byte> raw(rows * row * real);
  launcher_.queue().enqueueReadBuffer(buffer, CL_TRUE, 0, raw.size(), raw.data());
  const std::vector<double> all = unpack(raw, precision_);
  std::vector<double> result;
  result.reserve(count);
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t c = 0; c < cells; ++c) result.push_back(all[r * row + c]);
  return result;
}

void SingleCells::write(const std::vector<double>& V, const std::vector<double>& states) {
  const auto row = static_cast<std::size_t>(padded_), cells = static_cast<std::size_t>(cells_);
  const auto send = [&](const cl::Buffer& buffer, const std::vector<double>& numbers) {
    std::vector<double> rows;
    for (std::size_t r = 0; r < numbers.size() / cells; ++r)
      for (std::size_t c = 0; c < row; ++c) rows.push_back(numbers[r * cells + std::min(c, cells - 1)]);
    const std::vector<std::byte> raw = pack(rows, precision_);
    launcher_.queue().enqueueWriteBuffer(buffer, CL_TRUE, 0, raw.size(), raw.data());
  };
  send(V_, V);
  send(states_, states);
}

void SingleCells::derive(double dt_ms) {
  const std::vector<std::byte> raw = pack(parameters_, precision_);
  launcher_.queue().enqueueWriteBuffer(parameter_buffer_, CL_TRUE, 0, raw.size(), raw.data());
  launcher_.counted(derive_, static_cast<std::size_t>(padded_), 0, parameter_buffer_, derived_, fastest_rate_,
                    Real{dt_ms});
}

double SingleCells::fastest_rate() {
  derive(1);
  const std::vector<double> rates = read(fastest_rate_, static_cast<std::size_t>(cells_));
  return *std::max_element(rates.begin(), rates.end());
}

void SingleCells::initialise() {
  derive(1);
  launcher_.counted(initialise_, static_cast<std::size_t>(padded_), 0, parameter_buffer_, V_, states_);
}

SingleCells::Trace SingleCells::pace(const std::vector<Pacing>& pacing, const Stimulus& stimulus,
                                     double length_ms, double dt_ms, double interval_ms,
                                     const std::vector<std::string>& record) {
  derive(dt_ms);
  const auto row = static_cast<std::size_t>(padded_), cells = static_cast<std::size_t>(cells_);
  std::vector<double> protocol(3 * row);
  for (std::size_t c = 0; c < row; ++c) {
    const Pacing& p = pacing.at(std::min(c, cells - 1));
    protocol[c] = steps_of(p.period_ms, dt_ms);
    protocol[row + c] = p.pulses;
    protocol[2 * row + c] = steps_of(p.extra_ms, dt_ms);
  }
  std::vector<int> indices;
  for (const std::string& name : record) {
    const auto it = std::find_if(model_.states.begin(), model_.states.end(),
                                 [&](const auto& s) { return s.name == name; });
    if (it == model_.states.end()) throw std::out_of_range(model_.name + " has no state " + name);
    indices.push_back(static_cast<int>(it - model_.states.begin()));
  }
  const int recorded = static_cast<int>(indices.size());
  indices.resize(std::max<std::size_t>(indices.size(), 1));
  const int steps = steps_of(length_ms, dt_ms), sample = std::max(steps_of(interval_ms, dt_ms), 1);
  const auto samples = static_cast<std::size_t>(steps / sample + 1),
             columns = static_cast<std::size_t>(1 + recorded);

  Device& device = launcher_.device();
  const std::vector<std::byte> raw = pack(protocol, precision_);
  cl::Buffer protocol_buffer = device.allocate(raw.size(), "protocol buffer"),
             index_buffer = device.allocate(indices.size() * sizeof(int), "index buffer"),
             trace_buffer = device.allocate(samples * columns * row * real_bytes(precision_), "trace buffer");
  cl::CommandQueue& queue = launcher_.queue();
  queue.enqueueWriteBuffer(protocol_buffer, CL_TRUE, 0, raw.size(), raw.data());
  queue.enqueueWriteBuffer(index_buffer, CL_TRUE, 0, indices.size() * sizeof(int), indices.data());
  launcher_.counted(pace_, row / static_cast<std::size_t>(width_), 0, derived_, V_, states_, protocol_buffer,
                    trace_buffer, index_buffer, recorded, padded_, steps, sample,
                    std::max(steps_of(stimulus.duration_ms, dt_ms), 1), Real{stimulus.amplitude_mV_per_ms},
                    Real{dt_ms});
  const std::vector<double> all = read(trace_buffer, samples * columns * cells);

  Trace trace;
  trace.interval_ms = sample * dt_ms;
  trace.V.assign(cells, std::vector<double>(samples));
  trace.states.assign(cells, std::vector<std::vector<double>>(columns - 1, std::vector<double>(samples)));
  for (std::size_t t = 0; t < samples; ++t)
    for (std::size_t c = 0; c < cells; ++c) {
      trace.V[c][t] = all[t * columns * cells + c];
      for (std::size_t k = 0; k + 1 < columns; ++k)
        trace.states[c][k][t] = all[(t * columns + 1 + k) * cells + c];
    }
  return trace;
}

}  // namespace cohort
