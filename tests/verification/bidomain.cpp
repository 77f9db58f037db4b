// Exact solutions of the bidomain equations: Pathmanathan & Gray's with and without a bath, and oblique,
// unequal anisotropy against a potential made for it.
#include "solver/bidomain.hpp"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <numbers>

#include "ensemble/config.hpp"
#include "solver/simulation.hpp"
#include "tests/slab.hpp"

namespace cohort::test {
namespace {

using std::numbers::pi;

struct Errors {
  double V, phi;  // L2
};

// Root mean squares over cells; of phi less its mean.
double norm(const std::vector<double>& error, bool less_mean) {
  double mean = 0, sum = 0;
  for (const double e : error) mean += e / static_cast<double>(error.size());
  for (const double e : error) sum += less_mean ? (e - mean) * (e - mean) : e * e;
  return std::sqrt(sum / static_cast<double>(error.size()));
}

// A slab with the bidomain solver on it.
struct Conductor {
  Conductor(Slab& slab_) : slab(slab_), bidomain(*slab.launcher, slab.scene, slab.definitions, slab.grid, 1) {
    bidomain.assemble(*slab.tissue, *slab.diffusion, *slab.monodomain, slab.parameters,
                      std::span<const Member>(&slab.member, 1));
  }
  // Couplings of constant tensors xx yy zz xy xz yz over dx^2 on the cells of `cells`.
  cl::Buffer tensors(const Tissue& cells, const std::function<std::array<double, 6>(std::size_t)>& tensor) {
    const auto stride = static_cast<std::size_t>(cells.stride);
    std::vector<double> values(6 * stride, 0.0);
    for (std::size_t i = 0; i < stride; ++i) {
      if (cells.regions[i] == 255) continue;
      const std::array<double, 6> of_cell = tensor(i);
      for (std::size_t c = 0; c < 6; ++c) values[c * stride + i] = of_cell[c];
    }
    const cl::Buffer buffer = device().allocate(values.size() * sizeof(double));
    slab.write(buffer, values);
    return buffer;
  }

  Slab& slab;
  Bidomain bidomain;
};

constexpr double chi = 3, Cm = 2, k = 1 / std::numbers::sqrt2;

// States at t = 0 of the exact solution V = sqrt(1+t) F + `shift`, then steps to t = 1.
template <typename F, typename G, typename Shift>
std::vector<double> run_to_1(Slab& slab, Bidomain& bidomain, double dt, const F& f, const G& g,
                             const Shift& shift) {
  const auto stride = static_cast<size_t>(slab.tissue->stride);
  slab.monodomain->initialise(*slab.tissue, slab.parameters, dt, 1);
  bidomain.initialise();
  slab.write(slab.monodomain->potential(), slab.field([&](auto... p) { return f(p...) + shift(p...); }));
  slab.write(slab.monodomain->states(), slab.field([&](auto... p) { return g(p...) + f(p...); }, 1));
  slab.write(slab.monodomain->states(), slab.field([&](auto... p) { return 1 / std::sqrt(g(p...)); }, 1),
             stride);
  slab.write(slab.monodomain->states(), slab.field(shift), 2 * stride);  // u3 = V - sqrt(1+t) F
  const auto steps = static_cast<int>(std::lround(1 / dt));
  for (int step = 0; step < steps; ++step)
    bidomain.advance(*slab.tissue, *slab.monodomain, slab.parameters, step * dt, step == 0);
  return slab.read(bidomain.closed_potential(*slab.tissue, *slab.monodomain, 1), stride);
}

Errors pathmanathan_gray(int dimensions, double N, double& iterations) {
  const double h = 0.1 * N, dt = 0.1 * N * N;
  const double betas[] = {-1.1, -5.9, -8.6}, sigma[] = {1.1 / (pi * pi), 1.2 / (pi * pi), 0.3 / (pi * pi)};
  const auto F = [&](double x, double y, double z) {
    return std::cos(pi * x) * (dimensions > 1 ? std::cos(2 * pi * y) : 1) *
           (dimensions > 2 ? std::cos(3 * pi * z) : 1);
  };
  const auto G = [&](double x, double y, double z) {
    return 1 + x * (dimensions > 1 ? y * y : 1) * (dimensions > 2 ? z * z * z : 1);
  };
  Slab slab({1, dimensions > 1 ? 1 : h, dimensions > 2 ? 1 : h}, h, Precision::double_, "pathmanathan_gray",
            {{"electrophysiology.surface_to_volume_per_mm", chi},
             {"electrophysiology.capacitance_uF_per_mm2", Cm},
             {"electrophysiology.elliptic_tolerance", 1e-6},
             {"electrophysiology.pathmanathan_gray.beta", betas[dimensions - 1] * (1 - k)},
             {"electrophysiology.pathmanathan_gray.chi_times_capacitance", chi * Cm}},
            {}, ActivationMethod::bidomain);
  Conductor conductor(slab);
  Bidomain& bidomain = conductor.bidomain;
  const auto tensor = [&](double factor) {
    return [=](std::size_t) {
      const double scale = factor / (chi * Cm * h * h);
      return std::array<double, 6>{sigma[0] * scale, sigma[1] * scale, sigma[2] * scale, 0, 0, 0};
    };
  };
  slab.diffusion->assemble_tensors(*slab.tissue, conductor.tensors(*slab.tissue, tensor(1)),
                                   Diffusion::Use::monodomain, slab.monodomain->stencil());
  slab.diffusion->assemble_tensors(bidomain.conductor(),
                                   conductor.tensors(bidomain.conductor(), tensor((1 - k) / k)),
                                   Diffusion::Use::layered, bidomain.conductor_stencil());
  bidomain.build_operators(*slab.tissue, slab.monodomain->stencil());

  const auto none = [](double, double, double) { return 0.0; };
  const std::vector<double> V = run_to_1(slab, bidomain, dt, F, G, none);
  iterations = static_cast<double>(bidomain.iterations()) / static_cast<double>(bidomain.solves());
  const cl::Buffer closed = device().allocate(V.size() * sizeof(double));
  slab.write(closed, V);
  const std::vector<double> phi =
      slab.read(bidomain.extracellular(*slab.tissue, *slab.monodomain, closed, 1), V.size());
  std::vector<double> of_V, of_phi;
  slab.each_cell([&](std::size_t i, const std::array<double, 3>& p) {
    const double exact = std::numbers::sqrt2 * F(p[0], p[1], p[2]);
    of_V.push_back(V[i] - exact);
    of_phi.push_back(phi[i] + k * exact);
  });
  EXPECT_LE(bidomain.worst_residual()[0], 1e-6);
  return {norm(of_V, false), norm(of_phi, true)};
}

void expect_second_order(const std::string& name, const std::vector<Errors>& errors,
                         const std::vector<double>& refinements) {
  for (std::size_t n = 0; n < errors.size(); ++n) {
    std::printf("%s  N 1/%g  error V %.3e  phi_e %.3e", name.c_str(), refinements[n], errors[n].V,
                errors[n].phi);
    if (n > 0) {
      const double ratio = std::log(refinements[n] / refinements[n - 1]);
      std::printf("  order %.2f %.2f", std::log(errors[n - 1].V / errors[n].V) / ratio,
                  std::log(errors[n - 1].phi / errors[n].phi) / ratio);
    }
    std::printf("\n");
  }
  const std::size_t last = errors.size() - 1;
  const double ratio = std::log(refinements[last] / refinements[last - 1]);
  EXPECT_GE(std::log(errors[last - 1].V / errors[last].V) / ratio, 1.9) << name;
  EXPECT_GE(std::log(errors[last - 1].phi / errors[last].phi) / ratio, 1.9) << name;
}

class PathmanathanGrayBidomain : public testing::TestWithParam<int> {};

TEST_P(PathmanathanGrayBidomain, ConvergesWithSecondOrder) {
  const int dimensions = GetParam();
  std::vector<double> refinements = {1, 2, 4};
  if (dimensions < 3) refinements.push_back(8);
  std::vector<Errors> errors;
  for (const double refinement : refinements) {
    double iterations = 0;
    errors.push_back(pathmanathan_gray(dimensions, 1 / refinement, iterations));
    std::printf("%d D  N 1/%g  V-cycles a step %.2f\n", dimensions, refinement, iterations);
  }
  expect_second_order(std::to_string(dimensions) + " D", errors, refinements);
}
INSTANTIATE_TEST_SUITE_P(Dimensions, PathmanathanGrayBidomain, testing::Values(1, 2, 3));

// Tissue in the middle third of [-1, 2], baths at its sides, a current through the ends.
Errors pathmanathan_gray_with_bath(double N, double& iterations) {
  const double h = 0.1 * N, dt = 0.1 * N * N, alpha = 0.01;
  const double along = 1.1 / (pi * pi), across = 1.2 / (pi * pi), s_e = (1 - k) / k * along, s_b = s_e / 2;
  Scene structure;
  structure.geometry = GeometryKind::shapes;
  structure.cell_model = "pathmanathan_gray";
  structure.precision = Precision::double_;
  structure.activation_method = ActivationMethod::bidomain;
  structure.shapes = {{"square", Shape::Kind::box, {}}, {"all", Shape::Kind::box, {}}};
  structure.regions = {{.name = "tissue", .shape = "square", .fibres = Region::Fibres::constant},
                       {.name = "baths", .shape = "all", .excitable = false, .bath = true}};
  const std::string ep = "electrophysiology.", square = "geometry.shapes.square.box.",
                    all = "geometry.shapes.all.box.";
  Slab slab(structure, {{"grid.dx_mm", h},
                        {square + "centre_mm.x", 0.5},
                        {square + "centre_mm.y", 0.5},
                        {square + "centre_mm.z", h / 2},
                        {square + "size_mm.x", 1},
                        {square + "size_mm.y", 1},
                        {square + "size_mm.z", h},
                        {all + "centre_mm.x", 0.5},
                        {all + "centre_mm.y", 0.5},
                        {all + "centre_mm.z", h / 2},
                        {all + "size_mm.x", 3},
                        {all + "size_mm.y", 1},
                        {all + "size_mm.z", h},
                        {ep + "surface_to_volume_per_mm", chi},
                        {ep + "capacitance_uF_per_mm2", Cm},
                        {ep + "intracellular_longitudinal_mS_per_mm", along},
                        {ep + "intracellular_transverse_mS_per_mm", across},
                        {ep + "extracellular_longitudinal_mS_per_mm", (1 - k) / k * along},
                        {ep + "extracellular_transverse_mS_per_mm", (1 - k) / k * across},
                        {ep + "regions.baths.bath_conductivity_mS_per_mm", s_b},
                        {ep + "boundary_current_uA_per_mm2.x", -alpha},
                        {ep + "boundary_current_duration_ms", 1000},
                        {ep + "elliptic_tolerance", 1e-6},
                        {ep + "pathmanathan_gray.beta", -1.1 * (1 - k)},
                        {ep + "pathmanathan_gray.chi_times_capacitance", chi * Cm}});
  Conductor conductor(slab);
  Bidomain& bidomain = conductor.bidomain;
  const auto F = [](double x, double, double) { return std::cos(pi * x); };
  const auto G = [](double x, double y, double) { return 1 + x * y * y; };
  const auto shift = [=](double x, double, double) { return -alpha * x / s_e; };
  const std::vector<double> V = run_to_1(slab, bidomain, dt, F, G, shift);
  iterations = static_cast<double>(bidomain.iterations()) / static_cast<double>(bidomain.solves());
  std::vector<double> of_V, of_phi;
  slab.each_cell([&](std::size_t i, const std::array<double, 3>& p) {
    of_V.push_back(V[i] - std::numbers::sqrt2 * F(p[0], 0, 0) - shift(p[0], 0, 0));
  });
  const cl::Buffer closed = device().allocate(V.size() * sizeof(double));
  slab.write(closed, V);
  bidomain.extracellular(*slab.tissue, *slab.monodomain, closed, 1);
  const std::vector<double> phi = bidomain.potential_of_conductor(0);
  const Tissue& cells = bidomain.conductor();
  std::size_t next = 0;
  for (std::size_t i = 0; i < cells.regions.size(); ++i) {
    if (cells.regions[i] == 255) continue;
    const double x = cells.centre(i)[0], kV = k * std::numbers::sqrt2;
    const double exact = x < 0   ? -kV + alpha * x / s_b
                         : x > 1 ? kV + alpha / s_e + alpha * (x - 1) / s_b
                                 : -kV * std::cos(pi * x) + alpha * x / s_e;
    of_phi.push_back(phi[next++] - exact);
  }
  EXPECT_EQ(next, phi.size());
  EXPECT_LE(bidomain.worst_residual()[0], 1e-6);
  return {norm(of_V, false), norm(of_phi, true)};
}

TEST(PathmanathanGrayBath, ConvergesWithSecondOrder) {
  const std::vector<double> refinements = {1, 2, 4, 8};
  std::vector<Errors> errors;
  for (const double refinement : refinements) {
    double iterations = 0;
    errors.push_back(pathmanathan_gray_with_bath(1 / refinement, iterations));
    std::printf("bath  N 1/%g  V-cycles a step %.2f\n", refinement, iterations);
  }
  expect_second_order("bath", errors, refinements);
}

// phi = B and V = 2 B', bumps whose gradients vanish on the faces of the unit cube, in tensors of unequal
// anisotropy along (1, 1, 1) and (1, -1, 2): the current that they need is injected. div(sigma grad B) is
// exact.
TEST(UnequalAnisotropy, ExtracellularPotentialIsSecondOrder) {
  using Tensor = std::array<double, 6>;
  const auto tensor = [](double along, double across, std::array<double, 3> f) {
    const double length = std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
    for (double& component : f) component /= length;
    const double d = along - across;
    return Tensor{across + d * f[0] * f[0], across + d * f[1] * f[1], across + d * f[2] * f[2],
                  d * f[0] * f[1],          d * f[0] * f[2],          d * f[1] * f[2]};
  };
  const Tensor sigma_i = tensor(0.17, 0.019, {1, 1, 1}), sigma_e = tensor(0.62, 0.24, {1, -1, 2});
  // Product of sin^2(n_a pi x_a), and div(D grad) of it.
  const auto bump = [](const std::array<double, 3>& p, const std::array<double, 3>& n) {
    double product = 1;
    for (std::size_t a = 0; a < 3; ++a) product *= std::pow(std::sin(n[a] * pi * p[a]), 2);
    return product;
  };
  const auto diffused = [](const Tensor& D, const std::array<double, 3>& p, const std::array<double, 3>& n) {
    std::array<double, 3> s{}, first{}, second{};
    for (std::size_t a = 0; a < 3; ++a) {
      s[a] = std::pow(std::sin(n[a] * pi * p[a]), 2);
      first[a] = n[a] * pi * std::sin(2 * n[a] * pi * p[a]);
      second[a] = 2 * n[a] * n[a] * pi * pi * std::cos(2 * n[a] * pi * p[a]);
    }
    return D[0] * second[0] * s[1] * s[2] + D[1] * s[0] * second[1] * s[2] + D[2] * s[0] * s[1] * second[2] +
           2 * (D[3] * first[0] * first[1] * s[2] + D[4] * first[0] * s[1] * first[2] +
                D[5] * s[0] * first[1] * first[2]);
  };
  const std::array<double, 3> of_phi = {1, 1, 1}, of_V = {1, 2, 1};
  double before = 0;
  for (const int cells : {12, 24, 48}) {
    const double h = 1.0 / cells;
    Slab slab({1, 1, 1}, h, Precision::double_, "pathmanathan_gray",
              {{"electrophysiology.elliptic_tolerance", 1e-8},
               {"electrophysiology.boundary_current_duration_ms", 1}},
              {}, ActivationMethod::bidomain);
    Conductor conductor(slab);
    Bidomain& bidomain = conductor.bidomain;
    const auto scaled = [&](const Tensor& D) {
      return [=](std::size_t) {
        Tensor result = D;
        for (double& component : result) component /= h * h;
        return result;
      };
    };
    slab.diffusion->assemble_tensors(*slab.tissue, conductor.tensors(*slab.tissue, scaled(sigma_i)),
                                     Diffusion::Use::monodomain, slab.monodomain->stencil());
    slab.diffusion->assemble_tensors(bidomain.conductor(),
                                     conductor.tensors(bidomain.conductor(), scaled(sigma_e)),
                                     Diffusion::Use::layered, bidomain.conductor_stencil());
    bidomain.build_operators(*slab.tissue, slab.monodomain->stencil());
    std::vector<double> current(static_cast<std::size_t>(bidomain.conductor().stride), 0.0);
    for (std::size_t i = 0; i < current.size(); ++i) {
      if (bidomain.conductor().regions[i] == 255) continue;
      const std::array<double, 3> p = bidomain.conductor().centre(i);
      current[i] =
          -diffused(sigma_i, p, of_phi) - diffused(sigma_e, p, of_phi) - 2 * diffused(sigma_i, p, of_V);
    }
    bidomain.inject(current);
    const cl::Buffer V = device().allocate(static_cast<std::size_t>(slab.tissue->stride) * sizeof(double));
    slab.write(V, slab.field([&](double x, double y, double z) { return 2 * bump({x, y, z}, of_V); }));
    const std::vector<double> phi = slab.read(bidomain.extracellular(*slab.tissue, *slab.monodomain, V, 0.5),
                                              static_cast<std::size_t>(slab.tissue->stride));
    std::vector<double> errors;
    slab.each_cell(
        [&](std::size_t i, const std::array<double, 3>& p) { errors.push_back(phi[i] - bump(p, of_phi)); });
    const double error = norm(errors, true);
    std::printf("oblique  1/%d  error %.3e  V-cycles %lld", cells, error,
                static_cast<long long>(bidomain.iterations()));
    if (before > 0) std::printf("  order %.2f", std::log2(before / error));
    std::printf("\n");
    if (cells == 48) {
      EXPECT_GE(std::log2(before / error), 1.9);
      EXPECT_LT(error, 2e-3);
    }
    EXPECT_LE(bidomain.worst_residual()[0], 1e-8);
    before = error;
  }
}

std::vector<Recording> run(const Scene& scene, const std::vector<Member>& members, int batch) {
  PlanOptions options;
  options.members_per_device = batch;
  const Plan plan = make_plan(device(), scene, members, options);
  Simulation simulation(device(), scene, plan);
  std::vector<Recording> recordings;
  for (size_t first = 0; first < members.size(); first += static_cast<size_t>(batch))
    for (Recording& recording :
         simulation.run(std::span(members).subspan(first, static_cast<size_t>(batch)), 600))
      recordings.push_back(std::move(recording));
  return recordings;
}

// The charge that a boundary current brings follows its duration, within steps too.
TEST(BoundaryCurrent, BringsItsChargeWhateverTheSteps) {
  const auto change = [](double start, double duration) {
    const std::string ep = "electrophysiology.";
    Slab slab({4, 0.5, 0.5}, 0.5, Precision::double_, "mitchell_schaeffer",
              {{ep + "boundary_current_uA_per_mm2.x", 1e-3},
               {ep + "boundary_current_start_ms", start},
               {ep + "boundary_current_duration_ms", duration},
               {ep + "elliptic_tolerance", 1e-9}},
              {}, ActivationMethod::bidomain);
    Conductor conductor(slab);
    constexpr double dt = 0.05;
    constexpr int steps = 8;
    slab.monodomain->initialise(*slab.tissue, slab.parameters, dt, 1);
    conductor.bidomain.initialise();
    const auto cells = static_cast<std::size_t>(slab.tissue->stride);
    std::vector<double> before = slab.read(slab.monodomain->potential(), cells);
    for (int step = 0; step < steps; ++step)
      conductor.bidomain.advance(*slab.tissue, *slab.monodomain, slab.parameters, step * dt, step == 0);
    const std::vector<double> after = slab.read(slab.monodomain->potential(), cells);
    double largest = 0;
    for (std::size_t i = 0; i < cells; ++i)
      if (slab.tissue->regions[i] != 255) largest = std::max(largest, std::abs(after[i] - before[i]));
    return largest;
  };
  const double whole = change(0.1, 0.1);
  EXPECT_GT(whole, 0);
  EXPECT_NEAR(change(0.1, 0.12) / whole, 1.2, 0.02);
  EXPECT_NEAR(change(0.1, 0.14) / whole, 1.4, 0.03);
}

// With sigma_e = 2 sigma_i and insulated, the bidomain equations are the monodomain equation of
// sigma_i sigma_e / (sigma_i + sigma_e) (Keener & Sneyd, section 12.2): whole scenes in single precision.
TEST(EqualAnisotropy, IsTheMonodomain) {
  const std::string scene =
      "scene:\n  geometry: {box: {size_mm: [10, 4, 2]}, fibres: {direction: [1, 0.5, 0]}}\n"
      "  grid: {dx_mm: 0.5}\n  time: {end_ms: 60}\n"
      "  stimuli: {corner: {shape: box, upper_mm: [1.5, 1.5, 1.5]}}\n"
      "outputs: {activation: {probes: {far_mm: [10, 4, 2], near_mm: [4, 2, 1]}}}\n";
  const std::string ep = "electrophysiology.";
  const auto last_activations = [&](std::vector<std::string> changes) {
    const Campaign campaign = parse_campaign(scene, "equal.yaml", changes);
    Member member{0, campaign.scene.parameters.values()};
    campaign.scene.parameters.resolve(member.values);
    const Recording recording = run(campaign.scene, {member}, 1).front();
    EXPECT_EQ(recording.outcome, Outcome::done) << recording.reason;
    return recording.features;
  };
  const std::vector<float> bidomain = last_activations(
      {ep + "activation=bidomain", ep + "intracellular_longitudinal_mS_per_mm=0.18",
       ep + "intracellular_transverse_mS_per_mm=0.03", ep + "extracellular_longitudinal_mS_per_mm=0.36",
       ep + "extracellular_transverse_mS_per_mm=0.06"});
  const std::vector<float> monodomain =
      last_activations({ep + "activation=monodomain", ep + "conductivity_longitudinal_mS_per_mm=0.12",
                        ep + "conductivity_transverse_mS_per_mm=0.02"});
  ASSERT_EQ(bidomain.size(), monodomain.size());
  double latest = 0;
  for (std::size_t n = 0; n < bidomain.size(); ++n) {
    EXPECT_NEAR(bidomain[n], monodomain[n], 5e-4 * std::max(1.0f, std::abs(monodomain[n])))
        << "feature " << n;
    latest = std::max<double>(latest, monodomain[n]);
  }
  std::printf("features of bidomain and monodomain:");
  for (std::size_t n = 0; n < bidomain.size(); ++n) std::printf("  %.4f %.4f", bidomain[n], monodomain[n]);
  std::printf("\n");
  EXPECT_GT(latest, 10);  // ms: the front has crossed the slab
}

TEST(BidomainBatch, AMembersBytesDoNotDependOnItsNeighbours) {
  const Campaign campaign =
      read_campaign(COHORT_SOURCE_DIR "/configs/bidomain.yaml",
                    {"grid.dx_mm=1", "time.end_ms=8", "outputs.ecg.method=forward", "torso.dx_mm=20"});
  std::vector<Member> members;
  for (const double along : {0.17, 0.3}) {
    Member member{static_cast<std::int64_t>(members.size()), campaign.scene.parameters.values()};
    member.values[static_cast<std::size_t>(
        campaign.scene.parameters.index("electrophysiology.intracellular_longitudinal_mS_per_mm"))] = along;
    campaign.scene.parameters.resolve(member.values);
    members.push_back(member);
  }
  const std::vector<Recording> alone = run(campaign.scene, members, 1),
                               together = run(campaign.scene, members, 2);
  for (std::size_t m = 0; m < members.size(); ++m) {
    EXPECT_EQ(alone[m].outcome, Outcome::done) << alone[m].reason;
    EXPECT_EQ(alone[m].ecg, together[m].ecg);
    ASSERT_EQ(alone[m].features.size(), together[m].features.size());  // NaN where nothing is activated yet
    EXPECT_EQ(std::memcmp(alone[m].features.data(), together[m].features.data(),
                          alone[m].features.size() * sizeof(float)),
              0);
  }
  EXPECT_NE(alone[0].ecg, alone[1].ecg);
}

}  // namespace
}  // namespace cohort::test
