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

namespace {

// uJ: of active tension, on the blood of each cavity, stored, dissipated.
struct Balance {
  double active, stored, dissipated;
  std::vector<double> on_blood;
  double left() const {
    double result = active - stored - dissipated;
    for (const double work : on_blood) result -= work;
    return result;
  }
  double most() const {
    double result = std::max({std::abs(active), std::abs(stored), dissipated});
    for (const double work : on_blood) result = std::max(result, std::abs(work));
    return result;
  }
};

Balance balance_of(const Scene& scene, std::span<const double> tissue) {
  Balance balance = {tissue[Solid::active_work], tissue[Solid::stored_change], tissue[Solid::dissipated], {}};
  for (std::size_t q = 0; q < scene.mechanics->cavities.size(); ++q)
    balance.on_blood.push_back(-tissue[static_cast<std::size_t>(Solid::balanced_work) + q]);
  return balance;
}

}  // namespace

std::vector<float> energy_balance(const Scene& scene, std::span<const double> tissue) {
  if (!balances_energy(scene)) return {};
  constexpr double mJ_per_uJ = 1e-3;
  const Balance balance = balance_of(scene, tissue);
  std::vector<float> features = {static_cast<float>(mJ_per_uJ * balance.active)};
  for (const double work : balance.on_blood) features.push_back(static_cast<float>(mJ_per_uJ * work));
  for (const double energy : {balance.stored, balance.dissipated})
    features.push_back(static_cast<float>(mJ_per_uJ * energy));
  features.push_back(
      static_cast<float>(balance.left() / (balance.active != 0 ? std::abs(balance.active) : balance.most())));
  return features;
}

double energy_left(const Scene& scene, std::span<const double> tissue) {
  if (!balances_energy(scene)) return 0;
  constexpr double share_of_stored = 0.01;
  const Balance balance = balance_of(scene, tissue);
  const double scale = std::max(balance.most(), share_of_stored * tissue[Solid::strain_energy]);
  return scale > 0 ? balance.left() / scale : 0;
}

}  // namespace cohort
