#include "solver/lead_weights.hpp"

#include "solver/electrophysiology.hpp"

namespace cohort {

LeadWeights::LeadWeights(Launcher& launcher, const Scene& scene, const Definitions& definitions, int)
    : launcher_(launcher),
      scene_(scene),
      torso_(launcher.device(), scene),
      intracellular_offset_(region_parameters(scene).intracellular_offset),
      width_(launcher.device().vector_width(scene.precision == Precision::double_)) {
  Device& device = launcher.device();
  std::vector<std::string> options = definitions.options;
  options.push_back("LEADS=" + std::to_string(leads));
  for (const std::string& definition : torso_.definitions()) options.push_back(definition);
  sample_ = launcher.handle(
      device.build({"segments.clh", "lead_field.clh", "sample_leads.cl"}, options, definitions.generated),
      "sample_leads");
  options.push_back("WIDTH=" + std::to_string(width_));
  weigh_ = launcher.handle(
      device.build({"segments.clh", "diffusion.clh", "lead_weights.cl"}, options, definitions.generated),
      "lead_weights");
}

std::size_t LeadWeights::bytes(std::int64_t stride, Precision precision) {
  return static_cast<std::size_t>(stride) * (2 * leads + 6) * real_bytes(precision);
}

void LeadWeights::assemble(const Tissue& tissue, Diffusion& diffusion, const cl::Buffer& parameters,
                           std::span<const Member> members) {
  Device& device = launcher_.device();
  const std::size_t real = real_bytes(scene_.precision);
  if (tissue.stride > capacity_) {
    capacity_ = tissue.stride + tissue.stride / 16;
    const auto n = static_cast<std::size_t>(capacity_);
    potentials_ = device.allocate(n * leads * real, "potentials");
    weights_ = device.allocate(n * leads * real, "weights");
    stencil_ = device.allocate(Diffusion::bytes(capacity_, scene_.precision), "stencil");
    // Void cells are read as neighbours and never written.
    launcher_.queue().enqueueFillBuffer(potentials_, cl_uchar{0}, 0, n * leads * real);
  }
  // sigma_i / dx^2 times the volume dx^3 of a cell.
  const double dx = tissue.grid().dx_mm;
  diffusion.assemble(tissue, parameters, intracellular_offset_, dx * dx * dx, Diffusion::Use::ecg_source,
                     stencil_);

  for (size_t m = 0; m < members.size(); ++m) {
    launcher_.queue().finish();  // the torso's solver has a queue of its own while this one profiles
    const LeadFields& fields = torso_.fields(members[m].values);
    device.queue().finish();
    const std::vector<std::byte> block = pack(torso_.block(members[m].values), scene_.precision);
    if (block_() == nullptr) block_ = device.allocate(block.size(), "block");
    launcher_.queue().enqueueWriteBuffer(block_, CL_TRUE, 0, block.size(), block.data());
    const int first = Tissue::first_cell_place + tissue.first_block[m] * Tissue::block_cells;
    const int count = (tissue.first_block[m + 1] - tissue.first_block[m]) * Tissue::block_cells;
    launcher_(sample_, cl::NDRange(static_cast<size_t>(count)), cl::NDRange(Tissue::group), 40.0 * count,
              fields.potential, block_, tissue.grid().origin_and_spacing(), tissue.first_cell, tissue.region,
              potentials_, tissue.stride, first);
  }
  const auto cells = static_cast<std::size_t>(tissue.blocks) * Tissue::block_cells;
  launcher_(weigh_, cl::NDRange(cells / static_cast<size_t>(width_)),
            cl::NDRange(Tissue::block_cells / static_cast<size_t>(width_)),
            static_cast<double>(cells * real) * (2 * leads + 6), potentials_, stencil_, tissue.neighbours,
            weights_, tissue.stride);
}

}  // namespace cohort
