#include "solver/monodomain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "solver/heterogeneity.hpp"
#include "solver/stimulus.hpp"

namespace cohort {

namespace {

int count_fields(const std::vector<int>& field_of) {
  return static_cast<int>(
      std::count_if(field_of.begin(), field_of.end(), [](int field) { return field >= 0; }));
}

}  // namespace

Monodomain::Monodomain(Launcher& launcher, const Scene& scene, const Definitions& definitions,
                       int members_per_batch)
    : launcher_(launcher),
      scene_(scene),
      definitions_(definitions),
      models_(scene),
      regions_(region_parameters(scene)),
      members_per_batch_(members_per_batch),
      width_(launcher.device().vector_width(scene.precision == Precision::double_)),
      region_varies_(heterogeneous_regions(scene)),
      heterogeneous_(!scene.heterogeneity.parameters.empty()),
      few_states_(models_.states() <= 2),
      constants_by_value_(members_per_batch == 1 && !few_states_ &&
                          launcher.device().fits_argument(models_.derived() * real_bytes(scene.precision))) {}

// What a time loop needs.
void Monodomain::begin() {
  Device& device = launcher_.device();
  const auto members = static_cast<std::size_t>(members_per_batch_);
  const std::size_t real = real_bytes(scene_.precision);
  derived_ = device.allocate(members * models_.derived() * real, "derived");
  fastest_rate_buffer_ = device.allocate(members * real, "fastest rate buffer");
  stimuli_buffer_ = device.allocate(
      members * std::max<std::size_t>(scene_.stimuli.size(), 1) * stimulus_numbers * real, "stimuli buffer");
  if (!scene_.stimuli.empty()) {
    const cl::Program program = definitions_.build(device, {"segments.clh", "stimulus.clh", "stimulus.cl"},
                                                   {"STIMULI=" + std::to_string(scene_.stimuli.size())});
    mark_stimuli_ = launcher_.handle(program, "mark_stimuli");
  }
}

// A derived constant becomes a field where a parameter it depends on differs between the regions of any
// member, or through their walls.
std::vector<int> Monodomain::fields_of(const Scene& scene, std::span<const Member> members) {
  const CellModels models(scene);
  const RegionParameters regions = region_parameters(scene);
  const std::vector<bool> region_varies = heterogeneous_regions(scene);
  std::vector<int> field_of;
  int fields = 0;
  for (size_t m = 0; m < models.all().size(); ++m) {
    const CellModel& model = models.all()[m];
    std::vector<bool> varies(model.parameters.size(), false);
    for (size_t r = 0; r < scene.regions.size(); ++r) {
      if (models.of_region()[r] != static_cast<int>(m)) continue;
      for (size_t k = 0; k < model.parameters.size(); ++k)
        for (const Member& member : members)
          if (member.values[static_cast<size_t>(regions.cell_first[r]) + k] !=
                  member.values[static_cast<size_t>(regions.model_first[m]) + k] ||
              (region_varies[r] && has_slope(scene, model.parameters[k].path, member.values)))
            varies[k] = true;
    }
    for (const CellModel::Derived& derived : model.derived) {
      const bool field = std::any_of(derived.from.begin(), derived.from.end(),
                                     [&](int k) { return varies[static_cast<size_t>(k)]; });
      field_of.push_back(field ? fields++ : -1);
    }
  }
  return field_of;
}

void Monodomain::choose_fields(std::span<const Member> members) {
  field_of_ = fields_of(scene_, members);
  fields_ = count_fields(field_of_);
  const auto [entry, is_new] = kernels_by_fields_.try_emplace(field_of_);
  kernels_ = &entry->second;
  if (is_new) build_kernels();
}

std::string Monodomain::generated() const {
  const auto table = [](const char* type, const char* name, const auto& numbers) {
    std::string text = std::string("constant ") + type + " " + name + "[] = {";
    for (const auto number : numbers) text += std::to_string(static_cast<int>(number)) + ",";
    return text + "};\n";
  };
  return definitions_.generated + table("int", "region_model", models_.of_region()) +
         table("int", "region_cell_first", regions_.cell_first) +
         table("uchar", "region_varies", region_varies_);
}

void Monodomain::build_kernels() {
  Device& device = launcher_.device();
  const auto joined = [&](std::vector<std::string> files, const char* shared, const char* last) {
    const std::vector<std::string> cells = models_.parts(scene_, shared, field_of_);
    files.insert(files.end(), cells.begin(), cells.end());
    files.emplace_back(last);
    return files;
  };
  std::vector<std::string> setup_options = definitions_.options;
  if (activation_fields(scene_) > 0) setup_options.push_back("ACTIVATION");
  if (activation_fields(scene_) > 1) setup_options.push_back("BEATS");
  if (heterogeneous_) setup_options.push_back("HETEROGENEOUS");
  setup_options.push_back("STATES=" + std::to_string(models_.states()));
  setup_options.push_back("DERIVED_CONSTANTS=" + std::to_string(models_.derived()));
  setup_options.push_back("REGIONS=" + std::to_string(scene_.regions.size()));
  const cl::Program setup =
      device.build(joined({"segments.clh", "heterogeneity.clh"}, "cell_setup.clh", "cell_setup.cl"),
                   setup_options, generated());
  kernels_->derive = launcher_.handle(setup, "derive_members");
  kernels_->initialise = launcher_.handle(setup, "initialise_cells");
  if (heterogeneous_) kernels_->segment_rates = launcher_.handle(setup, "segment_rates");

  std::vector<std::string> options = definitions_.options;
  options.push_back("WIDTH=" + std::to_string(width_));
  options.push_back("MEMBERS=" + std::to_string(members_per_batch_));
  options.push_back("DERIVED_CONSTANTS=" + std::to_string(models_.derived()));
  if (constants_by_value_) options.push_back("DERIVED_BY_VALUE");
  if (activation_fields(scene_) > 0) options.push_back("ACTIVATION");
  if (activation_fields(scene_) > 1) options.push_back("BEATS");
  if (scene_.splitting == Splitting::strang) options.push_back("STRANG");
  if (scene_.stretch_activated) options.push_back("STRETCH_ACTIVATED");
  // Measured on an H200 with one state: 65 % of the triad with 40 registers, 62 % with what the compiler
  // takes. With the 18 states of ten Tusscher-Panfilov cells and constants from a buffer, ptxas takes 162,
  // and spills 152 bytes at 96; with constants by value it takes 80 of itself.
  if (scene_.precision == Precision::single_ && !constants_by_value_)
    for (const std::string& option : device.register_cap(few_states_ ? 40 : 96)) options.push_back(option);
  const cl::Program program =
      device.build(joined({"segments.clh", "diffusion.clh"}, "reaction.clh", "monodomain.cl"), options,
                   definitions_.generated);
  kernels_->step = launcher_.handle(program, "monodomain_step");
  kernels_->diffusion_step = launcher_.handle(program, "diffusion_step");
  if (scene_.stimuli.empty()) return;
  options.push_back("STIMULATED");
  options.push_back("STIMULI=" + std::to_string(scene_.stimuli.size()));
  kernels_->build_stimulated =
      [this, &device, options,
       files = joined({"segments.clh", "diffusion.clh", "stimulus.clh"}, "reaction.clh", "monodomain.cl")] {
        return launcher_.handle(device.build(files, options, definitions_.generated), "monodomain_step");
      };
}

std::size_t Monodomain::bytes(const Scene& scene, std::span<const Member> members, int batch,
                              std::int64_t stride) {
  const CellModels models(scene);
  const auto fields = static_cast<std::size_t>(count_fields(fields_of(scene, members)));
  const auto n = static_cast<std::size_t>(stride);
  const std::size_t real = real_bytes(scene.precision);
  const std::size_t of_member =
      (models.derived() + 1 + std::max<std::size_t>(scene.stimuli.size(), 1) * stimulus_numbers) * real;
  constexpr std::size_t perhaps_empty = 6;  // buffers
  return n * (real * (3 + models.states() + 6 + fields + (scene.stretch_activated ? 1 : 0)) +
              static_cast<std::size_t>(activation_fields(scene)) * sizeof(float) +
              (scene.stimuli.empty() ? 0 : 1) + (models.all().size() > 1 ? 1 : 0)) +
         static_cast<std::size_t>(batch) * of_member + perhaps_empty * Device::least_bytes;
}

double Monodomain::bytes_per_cell_stage() const {
  // Potential in and out, six couplings, inverse capacity; eight neighbours a segment. The base of a second
  // stage is one number more.
  return 9 * static_cast<double>(real_bytes(scene_.precision)) + 4;
}

double Monodomain::bytes_per_cell_step() const {
  const auto real = static_cast<double>(real_bytes(scene_.precision));
  // Stage, potential in and out, states in and out, six couplings, inverse capacity, fields; eight neighbours
  // a segment.
  return real * static_cast<double>(3 + 2 * models_.states() + 6 + 1 + static_cast<size_t>(fields_)) + 4 +
         (models_.all().size() > 1 ? 1 : 0);
}

void Monodomain::assemble(const Tissue& tissue, Diffusion& diffusion, const cl::Buffer& parameters,
                          std::span<const Member> members) {
  Device& device = launcher_.device();
  const std::size_t real = real_bytes(scene_.precision);
  if (derived_() == nullptr) begin();
  choose_fields(members);
  if (tissue.stride > capacity_) {
    capacity_ = tissue.stride + tissue.stride / 16;
    const auto n = static_cast<std::size_t>(capacity_);
    for (cl::Buffer& buffer : potential_) buffer = device.allocate(n * real, "potential");
    stage_ = device.allocate(n * real, "stage");
    states_ = device.allocate(n * real * models_.states(), "states");
    stencil_ = device.allocate(Diffusion::bytes(capacity_, scene_.precision), "stencil");
    activation_ = device.allocate(static_cast<std::size_t>(activation_fields(scene_)) * n * sizeof(float),
                                  "activation");
    stimulated_by_ = device.allocate(scene_.stimuli.empty() ? 0 : n, "stimulated by");
    model_of_ = device.allocate(models_.all().size() > 1 ? n : 0, "model of");
    if (scene_.stretch_activated) stretch_rate_ = device.allocate(n * real, "stretch rate");
    fields_allocated_ = -1;
  }
  if (scene_.stretch_activated)
    launcher_.queue().enqueueFillBuffer(stretch_rate_, cl_uchar{0}, 0,
                                        static_cast<std::size_t>(tissue.stride) * real);
  if (fields_ > fields_allocated_) {
    fields_allocated_ = fields_;
    derived_fields_ = device.allocate(
        static_cast<std::size_t>(capacity_) * real * static_cast<std::size_t>(fields_), "derived fields");
  }
  const int conductivity = scene_.activation_method == ActivationMethod::bidomain
                               ? regions_.intracellular_offset
                               : regions_.conductivity_offset;
  diffusion.assemble(tissue, parameters, conductivity, 1.0, Diffusion::Use::monodomain, stencil_);
  diffusion_limit_ms_.clear();
  for (const double largest : diffusion.bound(tissue, stencil_))
    diffusion_limit_ms_.push_back(largest > 0 ? 2 / largest : std::numeric_limits<double>::infinity());

  read_rates(tissue, parameters, members.size());

  stimuli_.clear();
  stimulated_by_host_.assign(static_cast<size_t>(tissue.stride), 0);
  if (scene_.stimuli.empty()) return;
  std::vector<double> blocks;
  for (const Member& member : members) {
    stimuli_.push_back(stimulus_block(scene_, member.values));
    blocks.insert(blocks.end(), stimuli_.back().begin(), stimuli_.back().end());
  }
  const std::vector<std::byte> packed = pack(blocks, scene_.precision);
  cl::CommandQueue& queue = launcher_.queue();
  queue.enqueueWriteBuffer(stimuli_buffer_, CL_TRUE, 0, packed.size(), packed.data());
  launcher_(mark_stimuli_, cl::NDRange(static_cast<size_t>(tissue.stride)), cl::NDRange(Tissue::group),
            2.0 * tissue.stride, stimuli_buffer_, tissue.grid().origin_and_spacing(), tissue.first_cell,
            tissue.member_of, tissue.region, stimulated_by_);
  queue.enqueueReadBuffer(stimulated_by_, CL_TRUE, 0, stimulated_by_host_.size(), stimulated_by_host_.data());
}

std::vector<double> Monodomain::read(const cl::Buffer& buffer, std::size_t count) {
  std::vector<std::byte> raw(count * real_bytes(scene_.precision));
  launcher_.queue().enqueueReadBuffer(buffer, CL_TRUE, 0, raw.size(), raw.data());
  return unpack(raw, scene_.precision);
}

void Monodomain::read_rates(const Tissue& tissue, const cl::Buffer& parameters, std::size_t members) {
  launcher_.counted(kernels_->derive, members, 0, parameters, derived_, fastest_rate_buffer_, Real{1});
  fastest_rate_ = read(fastest_rate_buffer_, members);
  if (!heterogeneous_) return;
  if (tissue.coordinates() == nullptr) throw std::logic_error("heterogeneity needs the tissue's coordinates");
  const auto segments = static_cast<std::size_t>(tissue.stride / Tissue::lanes);
  const std::size_t real = real_bytes(scene_.precision);
  const cl::Buffer buffer = launcher_.device().allocate(segments * real);
  launcher_(kernels_->segment_rates, cl::NDRange(segments), cl::NDRange(Tissue::group / Tissue::lanes),
            static_cast<double>(tissue.stride) * (1 + 3.0 * static_cast<double>(real)), parameters,
            tissue.member_of, tissue.region, tissue.coordinates, buffer, tissue.stride);
  const std::vector<double> rates = read(buffer, segments);
  constexpr std::size_t margin = Tissue::first_cell_place / Tissue::lanes;
  constexpr std::size_t block = Tissue::block_cells / Tissue::lanes;
  for (std::size_t m = 0; m < members; ++m)
    for (std::size_t s = margin + block * static_cast<std::size_t>(tissue.first_block[m]);
         s < margin + block * static_cast<std::size_t>(tissue.first_block[m + 1]); ++s)
      fastest_rate_[m] = std::max(fastest_rate_[m], rates[s]);
}

void Monodomain::initialise(const Tissue& tissue, const cl::Buffer& parameters, double dt_ms, int substeps) {
  dt_ms_ = dt_ms;
  substeps_ = substeps;
  current_ = 0;
  if (substeps > 1 && before_capacity_ < capacity_) {
    before_capacity_ = capacity_;
    const std::size_t bytes = static_cast<size_t>(capacity_) * real_bytes(scene_.precision);
    before_ = launcher_.device().allocate(bytes, "before");
  }
  const auto n = static_cast<std::size_t>(tissue.stride);
  // Padding is read, with zero weight, and never written: what another batch left there may be no number.
  launcher_.queue().enqueueFillBuffer(stage_, cl_uchar{0}, 0, n * real_bytes(scene_.precision));
  if (substeps > 1)
    launcher_.queue().enqueueFillBuffer(before_, cl_uchar{0}, 0, n * real_bytes(scene_.precision));
  const auto real = static_cast<double>(real_bytes(scene_.precision));
  launcher_.counted(kernels_->derive, tissue.tissue_cells.size(), 0, parameters, derived_,
                    fastest_rate_buffer_, Real{dt_ms});
  if (constants_by_value_) constants_.values = read(derived_, models_.derived());
  launcher_(kernels_->initialise, cl::NDRange(n), cl::NDRange(Tissue::group),
            static_cast<double>(n) * (5 + real * static_cast<double>(2 + models_.states())), parameters,
            tissue.member_of, tissue.region, heterogeneous_ ? tissue.coordinates : derived_fields_,
            derived_fields_, potential_[0], potential_[1], states_, activation_, model_of_, tissue.stride,
            Real{dt_ms});
}

void Monodomain::advance(const Tissue& tissue, const cl::Buffer& parameters, double time_ms, bool first) {
  const bool opens = first && scene_.splitting == Splitting::strang;
  const double dt_diffusion = (opens ? 0.5 : 1.0) * dt_ms_ / substeps_;
  const cl::Buffer* before = &potential_[current_];
  if (substeps_ > 1 && activation_fields(scene_) > 0) {
    launcher_.queue().enqueueCopyBuffer(potential_[current_], before_, 0, 0,
                                        static_cast<size_t>(tissue.stride) * real_bytes(scene_.precision));
    before = &before_;
  }
  for (int substep = 1; substep < substeps_; ++substep) {
    diffuse(tissue, potential_[current_], potential_[1 - current_], dt_diffusion);
    current_ = 1 - current_;
  }
  diffusion_stage(tissue, potential_[current_], potential_[current_], stage_, 0.5 * dt_diffusion);
  step(tissue, parameters, time_ms, stage_, potential_[current_], *before, dt_diffusion);
}

void Monodomain::react(const Tissue& tissue, const cl::Buffer& parameters, double time_ms,
                       const cl::Buffer& diffused) {
  step(tissue, parameters, time_ms, diffused, diffused, potential_[current_], 0);
}

// The second stage of diffusion and the reaction, from `base` into the potential that is not current.
void Monodomain::step(const Tissue& tissue, const cl::Buffer& parameters, double time_ms,
                      const cl::Buffer& stage, const cl::Buffer& base, const cl::Buffer& before,
                      double dt_diffusion) {
  const auto cells = static_cast<std::size_t>(tissue.blocks) * Tissue::block_cells;
  const cl::NDRange global(cells / static_cast<size_t>(width_));
  // Of a model with many registers more and smaller groups fit on a multiprocessor.
  const bool small_groups = launcher_.device().info().gpu && !few_states_;
  const cl::NDRange local(small_groups ? Tissue::group : Tissue::block_cells / static_cast<size_t>(width_));
  const auto bytes = static_cast<double>(cells);
  const double whole = std::floor(time_ms);
  const bool stimulated =
      std::any_of(stimuli_.begin(), stimuli_.end(),
                  [&](const std::vector<double>& block) { return stimulus_on(block, time_ms, dt_ms_); });
  if (stimulated && kernels_->stimulated_step.program() == nullptr)
    kernels_->stimulated_step = kernels_->build_stimulated();
  const auto step = [&](const auto& derived) {
    launcher_(stimulated ? kernels_->stimulated_step : kernels_->step, global, local,
              bytes * bytes_per_cell_step(), stage, base, before, potential_[1 - current_], states_, stencil_,
              tissue.inverse_capacity, tissue.neighbours, tissue.member_of, derived, derived_fields_,
              model_of_, activation_, stimulated_by_, stimuli_buffer_, parameters,
              scene_.stretch_activated ? stretch_rate_ : derived_fields_, tissue.stride, Real{dt_diffusion},
              Real{dt_ms_}, Real{whole}, Real{time_ms - whole});
  };
  if (constants_by_value_)
    step(constants_);
  else
    step(derived_);
  current_ = 1 - current_;
}

void Monodomain::diffusion_stage(const Tissue& tissue, const cl::Buffer& stage, const cl::Buffer& base,
                                 const cl::Buffer& to, double dt_ms) {
  const auto cells = static_cast<std::size_t>(tissue.blocks) * Tissue::block_cells;
  launcher_(kernels_->diffusion_step, cl::NDRange(cells / static_cast<size_t>(width_)),
            cl::NDRange(Tissue::block_cells / static_cast<size_t>(width_)),
            static_cast<double>(cells) * bytes_per_cell_stage(), stage, base, to, stencil_,
            tissue.inverse_capacity, tissue.neighbours, tissue.stride, Real{dt_ms});
}

void Monodomain::diffuse(const Tissue& tissue, const cl::Buffer& from, const cl::Buffer& to, double dt_ms) {
  diffusion_stage(tissue, from, from, stage_, 0.5 * dt_ms);
  diffusion_stage(tissue, stage_, from, to, dt_ms);
}

const cl::Buffer& Monodomain::closed_potential(const Tissue& tissue) {
  if (scene_.splitting == Splitting::godunov) return potential();
  const cl::Buffer* from = &potential_[current_];
  const cl::Buffer* to = &potential_[1 - current_];  // free until the next step
  const int steps = std::max(substeps_ / 2, 1);
  for (int step = 0; step < steps; ++step) {
    diffuse(tissue, *from, *to, 0.5 * dt_ms_ / steps);
    from = to;
    to = from == &before_ ? &potential_[1 - current_] : &before_;
  }
  return *from;
}

}  // namespace cohort
