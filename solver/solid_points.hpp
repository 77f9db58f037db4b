#pragma once

#include <array>
#include <string>
#include <vector>

#include "solver/solid.hpp"

namespace cohort {

/// Displacement of the material points of outputs.displacement, sampled on the device: no wait in the loop.
class SolidPoints {
 public:
  /// Device bytes of a batch.
  static std::size_t bytes(const Scene& scene, int members);
  SolidPoints(Launcher& launcher, const Scene& scene, const Solid& solid);

  /// Why the points cannot be recorded in member m of `solid`, which has been built; empty when they can.
  std::string defect(const Solid& solid, std::size_t m) const;
  /// Places the points in the tissue of `members` members; nothing recorded.
  void begin(const Solid& solid, std::size_t members);
  /// After each move().
  void sample(const Solid& solid);
  /// (members, points, 3, samples) mm, NaN where there is none.
  std::vector<float> series();

 private:
  Launcher& launcher_;
  const Scene& scene_;
  std::vector<std::array<double, 3>> points_;  ///< mm
  std::size_t samples_, rows_ = 0;
  cl::Buffer node_, weight_, before_, next_, series_;
  Launcher::Handle record_;
};

}  // namespace cohort
