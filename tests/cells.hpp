#pragma once

#include <map>
#include <string>
#include <vector>

#include "solver/single_cells.hpp"
#include "solver/time_steps.hpp"
#include "tests/slab.hpp"

namespace cohort::test {

using CellParameters = std::map<std::string, double>;

/// Parameters of the layers, as the heads of the model files list them.
inline CellParameters layer_parameters(const std::string& model, const std::string& layer) {
  if (model == "ten_tusscher_panfilov" && layer == "endo") return {{"gto", 0.073}, {"endocardial", 1}};
  if (model == "ten_tusscher_panfilov" && layer == "mid") return {{"gKs", 0.098}};
  if (model == "bueno_orovio" && layer == "endo")
    return {{"u_u", 1.56},           {"theta_v_minus", 0.2},
            {"tau_v1_minus_ms", 75}, {"tau_v2_minus_ms", 10},
            {"tau_w1_minus_ms", 6},  {"tau_w2_minus_ms", 140},
            {"k_w_minus", 200},      {"u_w_minus", 0.016},
            {"tau_w_plus_ms", 280},  {"tau_fi_ms", 0.1},
            {"tau_o1_ms", 470},      {"tau_so1_ms", 40},
            {"tau_so2_ms", 1.2},     {"k_so", 2},
            {"tau_s2_ms", 2},        {"tau_si_ms", 2.9013},
            {"tau_w_inf", 0.0273},   {"w_inf_star", 0.78}};
  if (model == "bueno_orovio" && layer == "mid")
    return {{"u_u", 1.61},
            {"theta_v_minus", 0.1},
            {"theta_o", 0.005},
            {"tau_v1_minus_ms", 80},
            {"tau_v2_minus_ms", 1.4506},
            {"tau_w1_minus_ms", 70},
            {"tau_w2_minus_ms", 8},
            {"k_w_minus", 200},
            {"u_w_minus", 0.016},
            {"tau_w_plus_ms", 280},
            {"tau_fi_ms", 0.078},
            {"tau_o1_ms", 410},
            {"tau_o2_ms", 7},
            {"tau_so1_ms", 91},
            {"tau_so2_ms", 0.8},
            {"k_so", 2.1},
            {"u_so", 0.6},
            {"tau_s2_ms", 4},
            {"tau_si_ms", 3.3849},
            {"tau_w_inf", 0.01},
            {"w_inf_star", 0.5}};
  return {};
}

/// The stimulus of tests/reference/make_cells.py.
inline SingleCells::Stimulus stimulus_of(const std::string& model) {
  if (model == "fitzhugh_nagumo") return {2, 40};
  if (model == "bueno_orovio") return {1, 40};
  if (model == "ten_tusscher_panfilov") return {1, 38};
  return {2, 20};
}

/// The step that a scene of this model takes by itself, ms.
inline double automatic_step(SingleCells& cells) {
  Scene scene;
  scene.cell_model = cells.model().name;
  declare_parameters(scene);
  return choose_steps(scene, cells.fastest_rate(), 1e9).dt_ms;
}

/// Time from the upward to the downward crossing of `level` in [first, last), ms; -1 where there is none.
inline double duration(const std::vector<double>& V, std::size_t first, std::size_t last, double level,
                       double interval) {
  const auto cross = [&](std::size_t i) {
    return (static_cast<double>(i - 1) + (level - V[i - 1]) / (V[i] - V[i - 1])) * interval;
  };
  std::size_t up = first;
  while (up < last && V[up] <= level) ++up;
  std::size_t down = up;
  while (down < last && V[down] >= level) ++down;
  if (down >= last) return -1;
  return cross(down) - (up > first ? cross(up) : static_cast<double>(first) * interval);
}

}  // namespace cohort::test
