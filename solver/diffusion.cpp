#include "solver/diffusion.hpp"

#include <algorithm>

namespace cohort {

Diffusion::Diffusion(Launcher& launcher, const Scene& scene, const Definitions& definitions)
    : launcher_(launcher),
      definitions_(definitions),
      precision_(scene.precision),
      width_(launcher.device().vector_width(scene.precision == Precision::double_)) {}

void Diffusion::reserve(const Tissue& tissue) {
  if (tissue.stride <= capacity_) return;
  capacity_ = tissue.stride + tissue.stride / 16;
  const auto cells = static_cast<std::size_t>(capacity_);
  conductivity_ = launcher_.device().allocate(6 * cells * real_bytes(precision_), "conductivity");
  block_bound_ =
      launcher_.device().allocate((cells / Tissue::block_cells + 1) * real_bytes(precision_), "block bound");
}

void Diffusion::compile() {
  if (assemble_.program() != nullptr) return;
  const cl::Program program =
      definitions_.build(launcher_.device(), {"segments.clh", "conductivity.cl", "stencil.cl"});
  tensor_ = launcher_.handle(program, "conductivity_tensor");
  assemble_ = launcher_.handle(program, "assemble_stencil");
}

void Diffusion::conductivities(Launcher::Handle& kernel, const Tissue& tissue, const cl::Buffer& parameters,
                               int offset, double scale, bool membrane) {
  reserve(tissue);
  const auto n = static_cast<std::size_t>(tissue.stride);
  launcher_(kernel, cl::NDRange(n), cl::NDRange(Tissue::group),
            9 * static_cast<double>(n * real_bytes(precision_)), parameters, tissue.member_of, tissue.region,
            tissue.fibre, conductivity_, tissue.stride, offset, Real{scale}, membrane ? 1 : 0);
}

void Diffusion::assemble(const Tissue& tissue, const cl::Buffer& parameters, int offset, double scale,
                         Use use, const cl::Buffer& stencil) {
  const double dx = tissue.grid().dx_mm;
  compile();
  conductivities(tensor_, tissue, parameters, offset, scale / (dx * dx), true);
  assemble_tensors(tissue, conductivity_, use, stencil);
}

void Diffusion::assemble_tensors(const Tissue& tissue, const cl::Buffer& tensors, Use use,
                                 const cl::Buffer& stencil) {
  compile();
  reserve(tissue);
  const auto n = static_cast<std::size_t>(tissue.stride);
  launcher_(assemble_, cl::NDRange(n), cl::NDRange(Tissue::group),
            13 * static_cast<double>(n * real_bytes(precision_)), tissue.first_cell, tissue.place,
            tissue.capacity, tensors, stencil, tissue.stride, static_cast<int>(use),
            static_cast<int>(tissue.places.size()) * Tissue::lanes);
}

const cl::Buffer& Diffusion::assemble_source(const Tissue& tissue, const cl::Buffer& parameters, int offset,
                                             double scale, const cl::Buffer& faces) {
  if (faces_.program() == nullptr) {
    const cl::Program program =
        definitions_.build(launcher_.device(), {"segments.clh", "conductivity.cl", "source_faces.cl"});
    source_tensor_ = launcher_.handle(program, "conductivity_tensor");
    faces_ = launcher_.handle(program, "source_faces");
  }
  conductivities(source_tensor_, tissue, parameters, offset, scale, false);
  const auto n = static_cast<std::size_t>(tissue.stride);
  launcher_(faces_, cl::NDRange(n), cl::NDRange(Tissue::group),
            5 * static_cast<double>(n * real_bytes(precision_)), tissue.first_cell, tissue.place,
            tissue.capacity, faces, tissue.stride, static_cast<int>(tissue.places.size()) * Tissue::lanes);
  return conductivity_;
}

std::vector<double> Diffusion::bound(const Tissue& tissue, const cl::Buffer& stencil) {
  const auto blocks = static_cast<std::size_t>(tissue.blocks);
  if (bound_.program() == nullptr)
    bound_ = launcher_.handle(
        definitions_.build(launcher_.device(), {"segments.clh", "diffusion.clh", "diffusion_bound.cl"},
                           {"WIDTH=" + std::to_string(width_)}),
        "diffusion_bound");
  launcher_.counted(bound_, blocks,
                    8.0 * static_cast<double>(tissue.stride) * static_cast<double>(real_bytes(precision_)),
                    stencil, tissue.inverse_capacity, tissue.neighbours, block_bound_, tissue.stride);
  std::vector<std::byte> raw(blocks * real_bytes(precision_));
  launcher_.queue().enqueueReadBuffer(block_bound_, CL_TRUE, 0, raw.size(), raw.data());
  const std::vector<double> by_block = unpack(raw, precision_);
  std::vector<double> result;
  for (size_t m = 0; m + 1 < tissue.first_block.size(); ++m)
    result.push_back(*std::max_element(by_block.begin() + tissue.first_block[m],
                                       by_block.begin() + tissue.first_block[m + 1]));
  return result;
}

}  // namespace cohort
