#include "solver/observer.hpp"

#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace cohort {

Observation::Observation(Observer observer, Precision precision, double sampling_interval_ms)
    : observer_(std::move(observer)), precision_(precision) {
  if (observer_.interval_ms <= 0 || !observer_.potential) return;
  const double ratio = observer_.interval_ms / sampling_interval_ms;
  constexpr double tolerance = 1e-6;
  samples_between_ = std::llround(ratio);
  if (samples_between_ < 1 || std::abs(ratio - std::round(ratio)) > tolerance * ratio) {
    std::ostringstream text;
    text << "potentials every " << observer_.interval_ms << " ms: the interval must be a multiple of "
         << sampling_interval_ms << " ms, the sampling interval";
    throw std::invalid_argument(text.str());
  }
}

std::vector<float> Observation::gathered(Launcher& launcher, const Tissue& tissue, const cl::Buffer& field,
                                         int component) {
  const auto stride = static_cast<std::size_t>(tissue.stride), real = real_bytes(precision_);
  std::vector<std::byte> raw(stride * real);
  launcher.queue().enqueueReadBuffer(field, CL_TRUE, static_cast<std::size_t>(component) * raw.size(),
                                     raw.size(), raw.data());
  const std::vector<double> all = unpack(raw, precision_);
  std::vector<float> result;
  result.reserve(places_.size());
  for (const std::size_t i : places_) result.push_back(static_cast<float>(all[i]));
  return result;
}

void Observation::begin(Launcher& launcher, const Tissue& tissue) {
  const Grid& grid = tissue.grid();
  TissueFields fields{grid.cells, grid.origin_mm, grid.dx_mm, {}, {}, {}, {}};
  places_.clear();
  for (std::size_t i = 0; i < tissue.regions.size(); ++i) {
    if (tissue.regions[i] == 255) continue;
    const std::int64_t cell =
        tissue.first_cells[i / Tissue::lanes] + static_cast<std::int64_t>(i % Tissue::lanes);
    if (cell >= grid.size()) break;  // the next member's
    places_.push_back(i);
    fields.cell.push_back(cell);
    fields.region.push_back(tissue.regions[i]);
  }
  if (!observer_.tissue) return;
  fields.fraction = gathered(launcher, tissue, tissue.capacity, 0);
  fields.fibre.resize(3 * places_.size());
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<float> component = gathered(launcher, tissue, tissue.fibre, axis);
    for (std::size_t k = 0; k < component.size(); ++k)
      fields.fibre[3 * k + static_cast<std::size_t>(axis)] = component[k];
  }
  observer_.tissue(fields);
}

void Observation::sample(Launcher& launcher, const Tissue& tissue, Monodomain& monodomain,
                         const cl::Buffer* closed, std::int64_t sample, double time_ms) {
  if (samples_between_ == 0 || sample % samples_between_ != 0) return;
  const cl::Buffer& potential = closed != nullptr ? *closed : monodomain.closed_potential(tissue);
  observer_.potential(time_ms, gathered(launcher, tissue, potential, 0));
}

void Observation::end(std::span<const float> activation) {
  if (!observer_.activation) return;
  std::vector<float> times;
  times.reserve(places_.size());
  for (const std::size_t i : places_)
    times.push_back(activation[i] < 0 ? std::numeric_limits<float>::quiet_NaN() : activation[i]);
  observer_.activation(times);
}

}  // namespace cohort
