#include "solver/solid_points.hpp"

#include <spdlog/fmt/fmt.h>

#include <limits>

#include "solver/precision.hpp"
#include "solver/pv_output.hpp"

namespace cohort {

namespace {

template <typename T>
cl::Buffer uploaded(Launcher& launcher, const std::vector<T>& host) {
  const cl::Buffer buffer = launcher.device().allocate(host.size() * sizeof(T));
  launcher.queue().enqueueWriteBuffer(buffer, CL_TRUE, 0, host.size() * sizeof(T), host.data());
  return buffer;
}

}  // namespace

SolidPoints::SolidPoints(Launcher& launcher, const Scene& scene, const Solid& solid)
    : launcher_(launcher),
      scene_(scene),
      samples_(displacement_times_ms(scene).size()),
      record_(launcher.handle(solid.program(), "solid_record")) {
  for (const std::string& name : scene.displacement->points) {
    const std::string path = "outputs.displacement.points." + name + "_mm.";
    points_.push_back({scene.parameters.value(path + "x"), scene.parameters.value(path + "y"),
                       scene.parameters.value(path + "z")});
  }
}

std::size_t SolidPoints::bytes(const Scene& scene, int members) {
  const std::size_t points = static_cast<std::size_t>(members) * scene.displacement->points.size();
  return points * 8 * (sizeof(int) + real_bytes(scene.precision)) +
         3 * points *
             (2 * sizeof(double) + sizeof(int) + displacement_times_ms(scene).size() * sizeof(float));
}

std::string SolidPoints::defect(const Solid& solid, std::size_t m) const {
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const double beyond = solid.place_of(m, points_[k]).beyond_mm;
    // Half a cell: the surface itself may lie in a cell with too little tissue to be one.
    if (beyond > 0.5 * solid.grid().dx_mm)
      return fmt::format("outputs.displacement: the point \"{}\" lies {:.3g} mm outside the tissue",
                         scene_.displacement->points[k], beyond);
  }
  return {};
}

void SolidPoints::begin(const Solid& solid, std::size_t members) {
  rows_ = members * points_.size() * 3;
  std::vector<int> nodes;
  std::vector<double> weights;
  for (std::size_t m = 0; m < members; ++m)
    for (const std::array<double, 3>& point : points_) {
      const Solid::Place place = solid.place_of(m, point);
      nodes.insert(nodes.end(), place.nodes.begin(), place.nodes.end());
      weights.insert(weights.end(), place.weights.begin(), place.weights.end());
    }
  node_ = uploaded(launcher_, nodes);
  weight_ = uploaded(launcher_, pack(weights, scene_.precision));
  const std::vector<double> before(2 * rows_, -1);
  before_ = launcher_.device().has_double()
                ? uploaded(launcher_, before)
                : uploaded(launcher_, std::vector<float>(before.begin(), before.end()));
  next_ = uploaded(launcher_, std::vector<int>(rows_, 0));
  series_ =
      uploaded(launcher_, std::vector<float>(rows_ * samples_, std::numeric_limits<float>::quiet_NaN()));
}

void SolidPoints::sample(const Solid& solid) {
  const auto count = static_cast<double>(rows_);
  launcher_(record_, cl::NDRange(rows_), cl::NDRange(3),
            count * (8 * (4 + 2 * static_cast<double>(real_bytes(scene_.precision))) + 36), solid.states(),
            node_, weight_, solid.displacements(), before_, next_, series_, solid.mesh().nodes,
            static_cast<int>(points_.size()), static_cast<int>(samples_),
            Real{1000 / scene_.parameters.value("outputs.displacement.rate_hz")},
            scene_.mechanics->quasi_static ? 1 : 0, scene_.beats ? 1 : 0);
}

std::vector<float> SolidPoints::series() {
  std::vector<float> result(rows_ * samples_);
  if (!result.empty())
    launcher_.queue().enqueueReadBuffer(series_, CL_TRUE, 0, result.size() * sizeof(float), result.data());
  return result;
}

}  // namespace cohort
