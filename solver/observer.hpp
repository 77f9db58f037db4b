#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "solver/monodomain.hpp"

namespace cohort {

/// The n tissue cells of a member and what they are.
struct TissueFields {
  std::array<int, 3> cells;  ///< of the box around them
  std::array<double, 3> origin_mm;
  double dx_mm;
  std::vector<std::int64_t> cell;    ///< (n) place in the box, x fastest
  std::vector<std::uint8_t> region;  ///< (n) index of Scene::regions
  std::vector<float> fraction;       ///< (n) share of the cell that is tissue
  std::vector<float> fibre;          ///< (n, 3) unit vectors, or zero
};

/// Who looks at a member while it is simulated; what is empty costs nothing. Spans are (n), in the order of
/// TissueFields::cell, and live until the function returns.
struct Observer {
  double interval_ms = 0;  ///< between two potentials: a multiple of the sampling interval; 0: none
  std::function<void(const TissueFields&)> tissue;                        ///< before the time loop
  std::function<void(double time_ms, std::span<const float>)> potential;  ///< mV
  std::function<void(std::span<const float>)> activation;                 ///< ms, NaN where there is none
};

/// Reads the fields of the first member of a batch from the device for an Observer.
class Observation {
 public:
  /// Throws std::invalid_argument where the observer's interval is no multiple of sampling_interval_ms.
  Observation(Observer observer, Precision precision, double sampling_interval_ms);

  void begin(Launcher& launcher, const Tissue& tissue);
  /// At sample number `sample`, taken at time_ms. Waits for the device where it is one to be shown. closed:
  /// the closed potential where there is one already, else null.
  void sample(Launcher& launcher, const Tissue& tissue, Monodomain& monodomain, const cl::Buffer* closed,
              std::int64_t sample, double time_ms);
  /// activation: (stride) ms, negative where there is none.
  void end(std::span<const float> activation);

 private:
  std::vector<float> gathered(Launcher& launcher, const Tissue& tissue, const cl::Buffer& field,
                              int component);

  Observer observer_;
  Precision precision_;
  std::int64_t samples_between_ = 0;
  std::vector<std::size_t> places_;  // in the compact fields
};

}  // namespace cohort
