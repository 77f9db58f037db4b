#include "ensemble/random.hpp"
#include "ensemble/sampler.hpp"

namespace cohort {
namespace {

class MonteCarlo final : public Sampler {
 public:
  MonteCarlo(std::uint64_t seed, int dimensions) : seed_(seed), dimensions_(dimensions) {}

  std::vector<double> point(std::int64_t member) const override {
    std::vector<double> u(static_cast<std::size_t>(dimensions_));
    for (std::uint32_t axis = 0; axis < u.size(); ++axis)
      u[axis] = random_uniform(seed_, Stream::monte_carlo, axis, static_cast<std::uint64_t>(member));
    return u;
  }

 private:
  std::uint64_t seed_;
  int dimensions_;
};

}  // namespace

std::unique_ptr<Sampler> monte_carlo(std::uint64_t seed, int dimensions) {
  return std::make_unique<MonteCarlo>(seed, dimensions);
}

}  // namespace cohort
