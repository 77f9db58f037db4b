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
  options.push_back("ELECTRODES_A_PASS=" + std::to_string(electrodes_a_pass));
  for (const std::string& definition : torso_.definitions()) options.push_back(definition);
  sample_ = launcher.handle(
      device.build({"segments.clh", "lead_field.clh", "sample_leads.cl"}, options, definitions.generated),
      "sample_leads");
  options.push_back("WIDTH=" + std::to_string(width_));
  weigh_ = launcher.handle(device.build({"segments.clh", "lead_weights.cl"}, options, definitions.generated),
                           "lead_weights");
}

std::size_t LeadWeights::bytes(std::int64_t stride, Precision precision) {
  return static_cast<std::size_t>(stride) * (leads + 3 * electrodes_a_pass + 3) * real_bytes(precision);
}

void LeadWeights::assemble(const Tissue& tissue, Diffusion& diffusion, const cl::Buffer& parameters,
                           std::span<const Member> members) {
  Device& device = launcher_.device();
  const auto real = static_cast<double>(real_bytes(scene_.precision));
  if (tissue.stride > capacity_) {
    capacity_ = tissue.stride + tissue.stride / 16;
    const std::size_t row = static_cast<std::size_t>(capacity_) * real_bytes(scene_.precision);
    currents_ = device.allocate(3 * electrodes_a_pass * row, "lead currents");
    weights_ = device.allocate(leads * row, "weights");
    faces_ = device.allocate(3 * row, "faces of the source");
    // Void cells are read as neighbours and never written.
    launcher_.queue().enqueueFillBuffer(currents_, cl_uchar{0}, 0, 3 * electrodes_a_pass * row);
    launcher_.queue().enqueueFillBuffer(weights_, cl_uchar{0}, 0, leads * row);
  }
  const double dx = tissue.grid().dx_mm;
  const cl::Buffer& conductivity =
      diffusion.assemble_source(tissue, parameters, intracellular_offset_, dx * dx, faces_);

  for (size_t m = 0; m < members.size(); ++m) {
    launcher_.queue().finish();  // the torso's solver has a queue of its own while this one profiles
    const LeadFields& fields = torso_.fields(members[m].values);
    device.queue().finish();
    const std::vector<std::byte> block = pack(torso_.block(members[m].values), scene_.precision);
    if (block_() == nullptr) block_ = device.allocate(block.size(), "block");
    launcher_.queue().enqueueWriteBuffer(block_, CL_TRUE, 0, block.size(), block.data());
    const int first = Tissue::first_cell_place + tissue.first_block[m] * Tissue::block_cells;
    const int cells = (tissue.first_block[m + 1] - tissue.first_block[m]) * Tissue::block_cells;
    for (int electrode = 0; electrode < static_cast<int>(electrode_names.size());
         electrode += electrodes_a_pass) {
      launcher_(sample_, cl::NDRange(static_cast<size_t>(cells)), cl::NDRange(Tissue::group),
                (3 * electrodes_a_pass + 7) * real * cells, fields.potential, block_,
                tissue.grid().origin_and_spacing(), tissue.first_cell, tissue.region, conductivity, currents_,
                tissue.stride, first, electrode);
      launcher_(weigh_, cl::NDRange(static_cast<size_t>(cells / width_)),
                cl::NDRange(Tissue::block_cells / static_cast<size_t>(width_)),
                (3 * electrodes_a_pass + 3 + leads) * real * cells, currents_, faces_, tissue.neighbours,
                weights_, tissue.stride, first, electrode);
    }
  }
}

}  // namespace cohort
