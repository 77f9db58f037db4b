#pragma once

#include <array>
#include <cstddef>

namespace cohort::test {

/// y' = rate(t, y) over h by one step of the classical Runge-Kutta method.
template <std::size_t N, typename Rate>
void advance(std::array<double, N>& y, double t, double h, const Rate& rate) {
  const auto moved = [&](const std::array<double, N>& k, double by) {
    std::array<double, N> z = y;
    for (std::size_t i = 0; i < N; ++i) z[i] += by * k[i];
    return z;
  };
  const auto a = rate(t, y), b = rate(t + h / 2, moved(a, h / 2)), c = rate(t + h / 2, moved(b, h / 2)),
             d = rate(t + h, moved(c, h));
  for (std::size_t i = 0; i < N; ++i) y[i] += h / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]);
}

}  // namespace cohort::test
