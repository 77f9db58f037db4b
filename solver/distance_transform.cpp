#include "solver/distance_transform.hpp"

#include <algorithm>
#include <cmath>

namespace cohort {

namespace {

constexpr float far = 1e18f;  // squared distance where there is no seed yet

/// Scratch of one line: the lower envelope of parabolas.
struct Envelope {
  explicit Envelope(std::size_t length) : f(length), d(length), vertex(length), bound(length + 1) {}
  std::vector<float> f, d;
  std::vector<std::int32_t> from, to;  ///< the nearest seed, before and after; empty where nobody asks
  std::vector<int> vertex;
  std::vector<float> bound;

  /// d[q] = min over p of (q - p)^2 + f[p], equation 2.
  void transform(int n) {
    int k = -1;
    for (int q = 0; q < n; ++q) {
      if (f[static_cast<size_t>(q)] >= far) continue;
      float s = -far;
      while (k >= 0) {
        const int v = vertex[static_cast<size_t>(k)];
        // Where the parabolas of q and v meet.
        s = 0.5f * ((f[static_cast<size_t>(q)] - f[static_cast<size_t>(v)]) / static_cast<float>(q - v) +
                    static_cast<float>(q + v));
        if (s > bound[static_cast<size_t>(k)]) break;
        --k;
      }
      if (k < 0) s = -far;
      ++k;
      vertex[static_cast<size_t>(k)] = q;
      bound[static_cast<size_t>(k)] = s;
    }
    if (k < 0) {
      std::fill(d.begin(), d.begin() + n, far);
      if (!from.empty()) to = from;
      return;
    }
    int j = 0;
    for (int q = 0; q < n; ++q) {
      while (j < k && bound[static_cast<size_t>(j + 1)] < static_cast<float>(q)) ++j;
      const int v = vertex[static_cast<size_t>(j)];
      d[static_cast<size_t>(q)] = static_cast<float>((q - v) * (q - v)) + f[static_cast<size_t>(v)];
      if (!from.empty()) to[static_cast<size_t>(q)] = from[static_cast<size_t>(v)];
    }
  }
};

}  // namespace

std::vector<float> distance_transform(const std::vector<std::uint8_t>& seed, const std::array<int, 3>& cells,
                                      std::vector<std::int32_t>* nearest) {
  const auto nx = static_cast<size_t>(cells[0]), ny = static_cast<size_t>(cells[1]),
             nz = static_cast<size_t>(cells[2]);
  std::vector<float> squared(seed.size());
  if (nearest) nearest->assign(seed.size(), -1);
  // Along x: distance to the last seed met, from both ends.
  for (std::size_t row = 0; row < ny * nz; ++row) {
    const std::uint8_t* in = &seed[row * nx];
    float* out = &squared[row * nx];
    float steps = far;
    for (std::size_t x = 0; x < nx; ++x) out[x] = steps = in[x] ? 0 : std::min(far, steps + 1);
    steps = far;
    for (std::size_t x = nx; x-- > 0;) {
      steps = in[x] ? 0 : std::min(far, steps + 1);
      const float least = std::min(out[x], steps);
      if (nearest && least < 1e8f)
        (*nearest)[row * nx + x] =
            static_cast<std::int32_t>(row * nx + x) +
            (steps < out[x] ? static_cast<std::int32_t>(steps) : -static_cast<std::int32_t>(out[x]));
      out[x] = least >= 1e8f ? far : least * least;
    }
  }
  Envelope line(std::max(ny, nz));
  if (nearest) {
    line.from.resize(std::max(ny, nz));
    line.to.resize(std::max(ny, nz));
  }
  const auto along = [&](std::size_t first, std::size_t stride, std::size_t n) {
    for (std::size_t q = 0; q < n; ++q) line.f[q] = squared[first + q * stride];
    if (nearest)
      for (std::size_t q = 0; q < n; ++q) line.from[q] = (*nearest)[first + q * stride];
    line.transform(static_cast<int>(n));
    for (std::size_t q = 0; q < n; ++q) squared[first + q * stride] = line.d[q];
    if (nearest)
      for (std::size_t q = 0; q < n; ++q) (*nearest)[first + q * stride] = line.to[q];
  };
  for (std::size_t z = 0; z < nz; ++z)
    for (std::size_t x = 0; x < nx; ++x) along(x + nx * ny * z, nx, ny);
  for (std::size_t y = 0; y < ny; ++y)
    for (std::size_t x = 0; x < nx; ++x) along(x + nx * y, nx * ny, nz);
  for (float& d : squared) d = d >= far ? no_seed : std::sqrt(d);
  return squared;
}

}  // namespace cohort
