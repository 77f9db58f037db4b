#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "solver/scene.hpp"

namespace cohort {

/// Whether the energy of the scene's deforming tissue is balanced: it moves, and pressure and volume are
/// recorded.
bool balances_energy(const Scene& scene);

/// Names and units of the balance, the last of layout()'s features; none where it is not taken. From the
/// first look at the cells in the recorded beat (without a circulation: of all) to the last: the work of
/// active tension, of each cavity's wall on its blood (- integral of p dV), the change of kinetic, strain and
/// springs' energy, what damping of the mass, dashpots and viscosity dissipate, and what is left of the work
/// without them, over the work of active tension, or over the largest of these where there is none.
std::vector<std::pair<std::string, std::string>> energy_names(const Scene& scene);

/// The balance of a member with this state of its tissue (Solid::state()).
std::vector<float> energy_balance(const Scene& scene, std::span<const double> tissue);

/// What is left over of a member's balance, over the largest of its terms: a motion that is not resolved in
/// time, or that runs away, makes or loses energy. Where hardly anything moves, over a hundredth of the
/// energy stored.
double energy_left(const Scene& scene, std::span<const double> tissue);

/// With more left over a member ends as unstable.
inline constexpr double largest_energy_left = 0.02;

}  // namespace cohort
