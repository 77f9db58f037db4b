#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <sstream>

#include "solver/mechanics.hpp"
#include "solver/mechanics_structure.hpp"

// Tangents D = 2 dS/dC of the laws at rest, in closed form (tests/verification/laws.cpp holds them against
// the kernels), as matrices over xx, yy, zz, sqrt2 yz, sqrt2 xz, sqrt2 xy with fibres along x and sheets
// along y.
namespace cohort {

namespace {

using Tangent = std::array<std::array<double, 6>, 6>;
using Numbers = std::function<double(const std::string&)>;

// lambda I (x) I + 2 mu times the identity
Tangent isotropic(double lambda, double mu) {
  Tangent D{};
  for (std::size_t i = 0; i < 6; ++i) D[i][i] = 2 * mu;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) D[i][k] += lambda;
  return D;
}
Tangent isochoric(double mu) {
  return isotropic(-2 * mu / 3, mu);
}

// A law's tangent, and what of it its parameters give as the shear modulus where that is one number.
struct Rest {
  Tangent tangent;
  std::string shear;
};

const std::map<std::string, std::function<Rest(const Numbers&)>>& rests() {
  static const std::map<std::string, std::function<Rest(const Numbers&)>> all = {
      {"guccione",
       [](const Numbers& p) {
         Rest rest;
         const double C = p("C_kPa"), across = C * p("bt"), shear = C * p("bfs");
         const std::array<double, 6> diagonal = {C * p("bf"), across, across, across, shear, shear};
         rest.tangent = {};
         for (std::size_t i = 0; i < 6; ++i) rest.tangent[i][i] = diagonal[i];
         return rest;
       }},
      {"neo_hookean",
       [](const Numbers& p) {
         return Rest{isochoric(p("mu_kPa")), "mu_kPa"};
       }},
      {"mooney_rivlin",
       [](const Numbers& p) {
         return Rest{isochoric(2 * (p("c1_kPa") + p("c2_kPa"))), "2 (c1_kPa + c2_kPa)"};
       }},
      {"st_venant_kirchhoff",
       [](const Numbers& p) {
         return Rest{isotropic(p("lambda_kPa"), p("mu_kPa")), "mu_kPa"};
       }},
      {"ogden",
       [](const Numbers& p) {
         double mu = 0;
         for (const char* k : {"1", "2", "3"})
           mu += 0.5 * p(std::string("mu") + k + "_kPa") * p(std::string("alpha") + k);
         return Rest{isochoric(mu), "half of mu1_kPa alpha1 + mu2_kPa alpha2 + mu3_kPa alpha3"};
       }},
      {"holzapfel_ogden",
       [](const Numbers& p) {
         Rest rest{isochoric(p("a_kPa")), {}};
         // Half of the smooth step's height, at rest.
         rest.tangent[0][0] += 2 * p("a_f_kPa");
         rest.tangent[1][1] += 2 * p("a_s_kPa");
         rest.tangent[5][5] += 2 * p("a_fs_kPa");
         return rest;
       }},
  };
  return all;
}

// Smallest eigenvalue of D among strains without change of volume, by Jacobi's method.
double least_deviatoric(const Tangent& D) {
  constexpr std::size_t n = 5;
  const double a = 1 / std::sqrt(2.0), b = 1 / std::sqrt(6.0);
  const std::array<std::array<double, 6>, n> basis = {{{a, -a, 0, 0, 0, 0},
                                                       {b, b, -2 * b, 0, 0, 0},
                                                       {0, 0, 0, 1, 0, 0},
                                                       {0, 0, 0, 0, 1, 0},
                                                       {0, 0, 0, 0, 0, 1}}};
  std::array<std::array<double, n>, n> m{};
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < n; ++k)
      for (std::size_t p = 0; p < 6; ++p)
        for (std::size_t q = 0; q < 6; ++q) m[i][k] += basis[i][p] * D[p][q] * basis[k][q];
  for (int sweep = 0; sweep < 20; ++sweep)
    for (std::size_t p = 0; p < n; ++p)
      for (std::size_t q = p + 1; q < n; ++q) {
        if (m[p][q] == 0) continue;
        const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
        const double t = std::copysign(1 / (std::abs(theta) + std::hypot(theta, 1.0)), theta);
        const double c = 1 / std::hypot(t, 1.0), s = t * c;
        for (std::size_t k = 0; k < n; ++k) {
          const double mp = m[k][p], mq = m[k][q];
          m[k][p] = c * mp - s * mq;
          m[k][q] = s * mp + c * mq;
        }
        for (std::size_t k = 0; k < n; ++k) {
          const double mp = m[p][k], mq = m[q][k];
          m[p][k] = c * mp - s * mq;
          m[q][k] = s * mp + c * mq;
        }
      }
  double least = m[0][0];
  for (std::size_t i = 1; i < n; ++i) least = std::min(least, m[i][i]);
  return least;
}

// D over a change of volume alone, I : D : I / 9: what the law adds to the element's bulk modulus.
double bulk(const Tangent& D) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) sum += D[i][k];
  return sum / 9;
}

Numbers numbers_of(const Scene& scene, std::span<const double> values, const Region& region) {
  return [&scene, values, path = "mechanics.regions." + region.name + "."](const std::string& name) {
    return values[static_cast<std::size_t>(scene.parameters.index(path + name))];
  };
}

}  // namespace

double least_stiffness_at_rest(const Scene& scene, std::span<const double> values, std::size_t region) {
  const auto known = rests().find(scene.mechanics->law);
  if (known == rests().end()) return std::numeric_limits<double>::quiet_NaN();
  return least_deviatoric(known->second(numbers_of(scene, values, scene.regions[region])).tangent);
}

std::string law_defect(const Scene& scene, std::span<const double> values) {
  if (!scene.mechanics) return {};
  const std::string& law = scene.mechanics->law;
  const auto known = rests().find(law);
  for (const Region& region : scene.regions) {
    if (region.bath || !deforms(scene, region.name)) continue;
    const Numbers number = numbers_of(scene, values, region);
    std::ostringstream text;
    text << "mechanics." << law << ": region \"" << region.name << "\": the law " << law;
    const double kappa = number("bulk_modulus_kPa");
    if (!(kappa > 0)) {
      text << " has a bulk modulus of " << kappa << " kPa: it must be positive";
      return text.str();
    }
    if (known == rests().end()) continue;
    const Rest rest = known->second(number);
    const double least = least_deviatoric(rest.tangent), volume = kappa + bulk(rest.tangent);
    // Two directions of shear at the modulus mu have 2 mu.
    if (!(least > 0)) {
      text << " is unstable at rest: ";
      if (!rest.shear.empty())
        text << "its shear modulus, " << rest.shear << ", is " << least / 2 << " kPa";
      else
        text << "a change of shape meets a stiffness of " << least << " kPa";
      text << "; it must be positive";
      return text.str();
    }
    if (!(volume > 0)) {
      text << " is unstable at rest: with the bulk modulus it resists a change of volume with " << volume
           << " kPa; it must be positive";
      return text.str();
    }
  }
  return {};
}

}  // namespace cohort
