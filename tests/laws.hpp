#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "solver/launch.hpp"
#include "solver/mechanics.hpp"
#include "tests/slab.hpp"

namespace cohort::test {

using Vector = std::array<double, 3>;
using Matrix = std::array<Vector, 3>;  ///< rows

/// A state of a point: deformation gradient, fibre and sheet.
struct PointState {
  Matrix F{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Vector f{1, 0, 0}, s{0, 1, 0};
};
/// S as xx, yy, zz, yz, xz, xy; kPa.
struct LawAnswer {
  std::array<double, 6> S;
  double W, stiffness;
};

/// A scene of one box of tissue with a law and a tension, its parameters declared.
inline Scene solid_box(const std::string& law, const std::string& tension = {},
                       const std::string& cell_model = "mitchell_schaeffer") {
  Scene scene = Slab::box(cell_model, Precision::double_);
  scene.mechanics = Mechanics{.law = law, .tension = tension, .cavities = {}, .boundary = {}};
  declare_parameters(scene);
  return scene;
}

/// The values of a member of the scene with `set` (names of the law's or tension's parameters) in the first
/// region.
inline std::vector<double> solid_values(const Scene& scene, const std::map<std::string, double>& set) {
  std::vector<double> values = scene.parameters.values();
  for (const auto& [name, value] : set)
    values[static_cast<std::size_t>(
        scene.parameters.index("mechanics.regions." + scene.regions[0].name + "." + name))] = value;
  scene.parameters.resolve(values);
  return values;
}

/// Runs `kernel` of `source` behind the scene's law and tension, over `count` things: parameters, input and
/// output are buffers of reals.
inline std::vector<double> run_solid(const Scene& scene, Precision precision, const std::string& source,
                                     const std::string& kernel, const std::vector<double>& values,
                                     const std::vector<double>& input, std::size_t outputs, int count) {
  const MechanicsText text = mechanics_text(scene);
  std::vector<std::string> files = text.files, options;
  files.push_back(source);
  if (precision == Precision::double_) options.push_back("DOUBLE");
  Launcher launcher(device(), precision);
  Launcher::Handle handle = launcher.handle(device().build(files, options, text.generated), kernel);
  const auto send = [&](const std::vector<double>& numbers) {
    const std::vector<std::byte> packed = pack(numbers, precision);
    cl::Buffer buffer = device().allocate(packed.size());
    launcher.queue().enqueueWriteBuffer(buffer, CL_TRUE, 0, packed.size(), packed.data());
    return buffer;
  };
  const cl::Buffer P = send(values), in = send(input);
  const cl::Buffer out = device().allocate(outputs * real_bytes(precision));
  launcher.counted(handle, static_cast<std::size_t>(count), 0, P, in, out);
  std::vector<std::byte> raw(outputs * real_bytes(precision));
  launcher.queue().enqueueReadBuffer(out, CL_TRUE, 0, raw.size(), raw.data());
  return unpack(raw, precision);
}

inline std::vector<LawAnswer> evaluate_law(const Scene& scene, Precision precision,
                                           const std::vector<double>& values,
                                           const std::vector<PointState>& states) {
  static const std::string source = R"(
kernel void evaluate_law(global const real *P, global const real *in, global real *out, const int count) {
  const int i = get_global_id(0);
  if (i >= count) return;
  global const real *x = in + 15 * i;
  const real3 F_x = (real3)(x[0], x[3], x[6]), F_y = (real3)(x[1], x[4], x[7]), F_z = (real3)(x[2], x[5], x[8]);
  const real3 f = (real3)(x[9], x[10], x[11]), s = (real3)(x[12], x[13], x[14]);
  const symmetric C = right_cauchy_green(F_x, F_y, F_z);
  const real J = dot(F_x, cross(F_y, F_z));
  global const real *M = P + material_first[0];
  const symmetric S = law_stress(C, J, f, s, M);
  global real *y = out + 8 * i;
  y[0] = S.xx;
  y[1] = S.yy;
  y[2] = S.zz;
  y[3] = S.yz;
  y[4] = S.xz;
  y[5] = S.xy;
  y[6] = law_energy(C, J, f, s, M);
  y[7] = law_stiffness(C, J, f, s, M);
}
)";
  std::vector<double> input;
  for (const PointState& state : states) {
    for (const Vector& row : state.F) input.insert(input.end(), row.begin(), row.end());
    input.insert(input.end(), state.f.begin(), state.f.end());
    input.insert(input.end(), state.s.begin(), state.s.end());
  }
  const std::vector<double> out = run_solid(scene, precision, source, "evaluate_law", values, input,
                                            8 * states.size(), static_cast<int>(states.size()));
  std::vector<LawAnswer> answers(states.size());
  for (std::size_t i = 0; i < states.size(); ++i) {
    const auto at = out.begin() + static_cast<std::ptrdiff_t>(8 * i);
    std::copy(at, at + 6, answers[i].S.begin());
    answers[i].W = at[6];
    answers[i].stiffness = at[7];
  }
  return answers;
}

inline Matrix times(const Matrix& a, const Matrix& b) {
  Matrix result{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k) result[i][j] += a[i][k] * b[k][j];
  return result;
}
inline Vector times(const Matrix& a, const Vector& v) {
  Vector result{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) result[i] += a[i][k] * v[k];
  return result;
}
inline Matrix transposed(const Matrix& a) {
  Matrix result{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) result[i][j] = a[j][i];
  return result;
}
inline double determinant(const Matrix& a) {
  return a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
         a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
         a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
}
/// S as a matrix.
inline Matrix full(const std::array<double, 6>& S) {
  return {{{S[0], S[5], S[4]}, {S[5], S[1], S[3]}, {S[4], S[3], S[2]}}};
}

/// Uniform over all rotations.
inline Matrix random_rotation(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  double q[4], length = 0;
  for (double& x : q) {
    x = normal(random);
    length += x * x;
  }
  for (double& x : q) x /= std::sqrt(length);
  const auto [w, x, y, z] = std::array{q[0], q[1], q[2], q[3]};
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
           {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
           {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
}

/// R1 diag(stretches) R2, the logarithms of the stretches uniform, with a random pair of fibre and sheet.
inline PointState random_state(std::mt19937_64& random, double least, double most) {
  std::uniform_real_distribution<double> logarithm(std::log(least), std::log(most));
  Matrix stretch{};
  for (std::size_t i = 0; i < 3; ++i) stretch[i][i] = std::exp(logarithm(random));
  const Matrix frame = random_rotation(random);
  return {times(random_rotation(random), times(stretch, random_rotation(random))), frame[0], frame[1]};
}

/// Largest component.
inline double largest(const std::array<double, 6>& S) {
  double result = 0;
  for (const double x : S) result = std::max(result, std::abs(x));
  return result;
}

}  // namespace cohort::test
