// Fields of the deforming tissue to the device and back, and the state of its members.
#include <algorithm>

#include "solver/new_buffer.hpp"
#include "solver/precision.hpp"
#include "solver/solid.hpp"

namespace cohort {

cl::Buffer Solid::reals(const std::vector<double>& host) {
  const std::vector<std::byte> packed = pack(host, scene_.precision);
  const cl::Buffer buffer = launcher_.device().allocate(std::max<std::size_t>(8, packed.size()));
  if (!packed.empty()) launcher_.queue().enqueueWriteBuffer(buffer, CL_TRUE, 0, packed.size(), packed.data());
  return buffer;
}

cl::Buffer Solid::zeros(std::size_t count) {
  const std::size_t bytes = std::max<std::size_t>(8, count * real_bytes(scene_.precision));
  const cl::Buffer buffer = launcher_.device().allocate(bytes);
  launcher_.queue().enqueueFillBuffer(buffer, cl_uchar{0}, 0, bytes);
  return buffer;
}

std::vector<double> Solid::read(const cl::Buffer& field, std::size_t count, std::size_t first) {
  std::vector<double> result(count);
  if (scene_.precision == Precision::double_) {
    launcher_.queue().enqueueReadBuffer(field, CL_TRUE, first * sizeof(double), count * sizeof(double),
                                        result.data());
    return result;
  }
  std::vector<float> single(count);
  launcher_.queue().enqueueReadBuffer(field, CL_TRUE, first * sizeof(float), count * sizeof(float),
                                      single.data());
  std::copy(single.begin(), single.end(), result.begin());
  return result;
}

std::vector<double> Solid::state() {
  std::vector<double> result(static_cast<std::size_t>(members_) * state_size);
  if (wide_) {
    launcher_.queue().enqueueReadBuffer(state_, CL_TRUE, 0, result.size() * sizeof(double), result.data());
    return result;
  }
  std::vector<float> single(result.size());
  launcher_.queue().enqueueReadBuffer(state_, CL_TRUE, 0, single.size() * sizeof(float), single.data());
  std::copy(single.begin(), single.end(), result.begin());
  return result;
}

void Solid::set_state(const std::vector<double>& state) {
  state_ = wide_ ? upload_new(launcher_, state)
                 : upload_new(launcher_, std::vector<float>(state.begin(), state.end()));
}

std::vector<double> Solid::displacement() {
  return read(u_, 3 * static_cast<std::size_t>(mesh_.nodes));
}
std::vector<double> Solid::tensions() {
  const auto cells = static_cast<std::size_t>(mesh_.cells),
             fields = static_cast<std::size_t>(tension_fields());
  const std::vector<double> all = by_component(read(tension_, fields * cells), fields);
  const auto first = all.begin() + (tension_states_ + 1) * mesh_.cells;
  return {first, first + mesh_.cells};
}
std::vector<double> Solid::velocity() {
  return read(v_, 3 * static_cast<std::size_t>(mesh_.nodes));
}

void Solid::set_motion(const std::vector<double>& displacement, const std::vector<double>& velocity) {
  u_ = reals(displacement);
  v_ = reals(velocity);
}

std::vector<float> Solid::cavity_series() {
  std::vector<float> result(static_cast<std::size_t>(members_) * 2 * scene_.mechanics->cavities.size() *
                            samples_);
  if (!result.empty())
    launcher_.queue().enqueueReadBuffer(series_, CL_TRUE, 0, result.size() * sizeof(float), result.data());
  return result;
}

std::vector<double> Solid::by_component(const std::vector<double>& tiles, std::size_t count) const {
  const auto cells = static_cast<std::size_t>(mesh_.cells);
  std::vector<double> result(tiles.size());
  for (std::size_t k = 0; k < count; ++k)
    for (std::size_t i = 0; i < cells; ++i) result[k * cells + i] = tiles[SolidMesh::in_tile(i, k, count)];
  return result;
}

std::vector<double> Solid::directions() {
  const std::size_t cells = static_cast<std::size_t>(mesh_.cells), count = sheets_ ? 24 : 12;
  return by_component(read(direction_, cells * count), count);
}

}  // namespace cohort
