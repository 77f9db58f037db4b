#include "solver/eikonal_activation.hpp"

#include "solver/electrophysiology.hpp"

namespace cohort {

std::string EikonalActivation::without_velocity(const Scene& scene, const RegionParameters& regions,
                                                std::span<const double> values) {
  for (size_t r = 0; r < scene.regions.size(); ++r) {
    if (regions.slot[r] < 0) continue;
    const auto first =
        values.begin() + regions.first + regions.slot[r] * regions.stride + regions.velocity_offset;
    if (!(first[0] > 0) || !(first[1] > 0))
      return "activation: eikonal needs velocity_longitudinal_mm_per_ms and velocity_transverse_mm_per_ms; "
             "region \"" +
             scene.regions[r].name + "\" has none";
  }
  return {};
}

EikonalActivation::EikonalActivation(Launcher& launcher, const Scene& scene, const Definitions& definitions,
                                     int members_per_batch)
    : launcher_(launcher),
      scene_(scene),
      precision_(scene.precision),
      network_(launcher, scene, definitions, members_per_batch),
      eikonal_(launcher, scene, definitions, activation_graphs(scene)) {
  const cl::Program program = definitions.build(launcher.device(), {"segments.clh", "eikonal_activation.cl"});
  speeds_ = launcher.handle(program, "region_speeds");
  recorded_ = launcher.handle(program, "recorded_arrival");
}

std::string EikonalActivation::refusal(const Scene& scene) {
  if (!scene.conduction_system) return "activation: eikonal needs electrophysiology.conduction_system";
  if (!scene.stimuli.empty())
    return "activation: eikonal starts at the nodes of the conduction system; stimuli have no effect beside "
           "it";
  if (activation_fields(scene) > 1)
    return "activation: eikonal knows one beat, and outputs.activation asks for beats";
  return {};
}

std::size_t EikonalActivation::bytes(const Scene& scene, int members, std::int64_t stride) {
  return Eikonal::bytes(stride, scene.precision) + ConductionNetwork::bytes(scene, members, stride) +
         static_cast<std::size_t>(stride) * (2 * real_bytes(scene.precision) + sizeof(float));
}

void EikonalActivation::assemble(const Tissue& tissue, const cl::Buffer& parameters,
                                 std::span<const Member> members) {
  const auto real = static_cast<double>(real_bytes(precision_));
  if (tissue.stride > capacity_) {
    capacity_ = tissue.stride + tissue.stride / 16;
    const auto n = static_cast<std::size_t>(capacity_);
    speed_ = launcher_.device().allocate(2 * n * real_bytes(precision_), "speed");
    activation_ = launcher_.device().allocate(n * sizeof(float), "activation");
  }
  const auto n = static_cast<std::size_t>(tissue.stride);
  launcher_(speeds_, cl::NDRange(n), cl::NDRange(Tissue::group), static_cast<double>(n) * (1 + 2 * real),
            parameters, tissue.member_of, tissue.region, speed_, tissue.stride);
  network_.assemble(tissue, parameters, speed_, members);
  defects_ = network_.missing();
  const RegionParameters regions = region_parameters(scene_);
  for (size_t m = 0; m < members.size(); ++m)
    if (const std::string why = without_velocity(scene_, regions, members[m].values); !why.empty())
      defects_[m] = why;
  const Eikonal::Sheet sheet = network_.sheet();
  eikonal_.solve(tissue, speed_, &sheet, nullptr, network_.sources(), &network_.fibres());
}

std::vector<float> EikonalActivation::activation(const Tissue& tissue, double end_ms) {
  const auto n = static_cast<std::size_t>(tissue.stride);
  launcher_(recorded_, cl::NDRange(n), cl::NDRange(Tissue::group), static_cast<double>(n) * 9, arrival(),
            tissue.region, activation_, Real{end_ms});
  std::vector<float> result(n);
  launcher_.queue().enqueueReadBuffer(activation_, CL_TRUE, 0, n * sizeof(float), result.data());
  return result;
}

}  // namespace cohort
