#include "solver/energy_balance.hpp"

#include <algorithm>
#include <cmath>

#include "solver/solid.hpp"

namespace cohort {

bool balances_energy(const Scene& scene) {
  return scene.mechanics && scene.pv && !scene.mechanics->quasi_static;
}

std::vector<std::pair<std::string, std::string>> energy_names(const Scene& scene) {
  if (!balances_energy(scene)) return {};
  std::vector<std::pair<std::string, std::string>> names = {{"active_work_mJ", "mJ"}};
  for (const Mechanics::Cavity& cavity : scene.mechanics->cavities)
    names.emplace_back(cavity.name + "_work_on_blood_mJ", "mJ");
  names.insert(names.end(),
               {{"stored_energy_change_mJ", "mJ"}, {"dissipated_energy_mJ", "mJ"}, {"energy_residual", "1"}});
  return names;
}

std::vector<float> energy_balance(const Scene& scene, std::span<const double> tissue) {
  if (!balances_energy(scene)) return {};
  constexpr double mJ_per_uJ = 1e-3;
  const auto mJ = [&](int slot) { return mJ_per_uJ * tissue[static_cast<std::size_t>(slot)]; };
  const double active = mJ(Solid::active_work), stored = mJ(Solid::stored_change),
               dissipated = mJ(Solid::dissipated);
  std::vector<double> balance = {active};
  double left = active - stored - dissipated,
         most = std::max({std::abs(active), std::abs(stored), dissipated});
  for (std::size_t q = 0; q < scene.mechanics->cavities.size(); ++q) {
    const double on_blood = -mJ(Solid::balanced_work + static_cast<int>(q));
    balance.push_back(on_blood);
    left -= on_blood;
    most = std::max(most, std::abs(on_blood));
  }
  balance.insert(balance.end(), {stored, dissipated, left / (active != 0 ? std::abs(active) : most)});
  return {balance.begin(), balance.end()};
}

}  // namespace cohort
