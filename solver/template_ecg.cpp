#include "solver/template_ecg.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "solver/geometry.hpp"
#include "solver/heterogeneity.hpp"
#include "solver/time_steps.hpp"

namespace cohort {

namespace {

// tests/unit/eikonal_activation.cpp measures what it costs in accuracy.
constexpr double longest_spacing_ms = 0.25;
constexpr double foot_ms = 6;  ///< of the upstroke below the threshold

template <typename T>
void upload_ints(cl::CommandQueue& queue, const cl::Buffer& buffer, const std::vector<T>& numbers) {
  queue.enqueueWriteBuffer(buffer, CL_TRUE, 0, numbers.size() * sizeof(T), numbers.data());
}

}  // namespace

std::string TemplateEcg::refusal(const Scene& scene) {
  const CellModels models(scene);
  for (const CellModel& model : models.all())
    if (scene.heterogeneity.parameters == std::vector{model.parameters[static_cast<size_t>(model.rest)].path})
      return "activation: eikonal takes action potential templates, which need one resting potential in a "
             "region";
  if (scene.heterogeneity.parameters.size() <= 1) return {};
  return "activation: eikonal takes action potential templates, which are tabulated over one cell parameter "
         "that varies through walls, and here are " +
         std::to_string(scene.heterogeneity.parameters.size()) + "; reaction_eikonal takes any number";
}

TemplateEcg::Extents TemplateEcg::extents_of(const Device& device, const Scene& scene) {
  Extents result{};
  const double interval_ms = sampling_interval_ms(scene);
  result.group = device.info().gpu ? 64 : 4;
  result.samples = static_cast<int>(layout(scene).ecg_ms.size());
  result.phases = std::max(1, static_cast<int>(std::ceil(interval_ms / longest_spacing_ms - 1e-9)));
  result.foot = static_cast<int>(std::ceil(foot_ms / interval_ms));
  // Work-items of a group times their samples.
  const int step =
      static_cast<int>(result.group) * device.vector_width(scene.precision == Precision::double_);
  result.row = (result.samples + step - 1) / step * step + result.foot + 2 * Tissue::lanes;
  return result;
}

TemplateEcg::TemplateEcg(Launcher& launcher, const Scene& scene, const Definitions& definitions,
                         int members_per_batch)
    : launcher_(launcher),
      scene_(scene),
      models_(scene),
      regions_(region_parameters(scene)),
      members_per_batch_(members_per_batch),
      width_(launcher.device().vector_width(scene.precision == Precision::double_)),
      group_(extents_of(launcher.device(), scene).group),
      interval_ms_(sampling_interval_ms(scene)) {
  if (const std::string why = refusal(scene); !why.empty()) throw std::invalid_argument(why);
  Device& device = launcher.device();
  columns_ = template_columns(scene);
  const Extents extents = extents_of(device, scene);
  samples_ = extents.samples;
  phases_ = extents.phases;
  const int foot = extents.foot;
  row_ = extents.row;

  std::vector<std::string> options = {"FOOT=" + std::to_string(foot), "PHASES=" + std::to_string(phases_),
                                      "ROW=" + std::to_string(row_)};
  if (scene.precision == Precision::double_) options.push_back("DOUBLE");
  options.push_back("LANES=" + std::to_string(Tissue::lanes));
  const std::size_t real = real_bytes(scene.precision);
  const auto members = static_cast<std::size_t>(members_per_batch);
  for (size_t k = 0; k < models_.all().size(); ++k) {
    const CellModel& model = models_.all()[k];
    std::size_t cells = 0;
    for (size_t r = 0; r < scene.regions.size(); ++r)
      if (models_.of_region()[r] == static_cast<int>(k)) cells += static_cast<std::size_t>(columns_.count[r]);
    cells *= members;
    const cl::Program program =
        device.build({"gates.clh", "cells/" + model.name + ".cl", "template_cell.clh", "template_cells.cl"},
                     options, model.macros());
    runs_.push_back({device.allocate(cells * model.parameters.size() * real),
                     device.allocate(cells * sizeof(int)), device.allocate(cells * real),
                     device.allocate(cells * real), device.allocate(cells * real),
                     device.allocate(cells * sizeof(int)), launcher.handle(program, "run_templates")});
  }

  options = definitions.options;
  for (const auto& [name, value] : std::map<std::string, int>{{"FOOT", foot},
                                                              {"PHASES", phases_},
                                                              {"ROW", row_},
                                                              {"SAMPLES", samples_},
                                                              {"COLUMNS", columns_.total},
                                                              {"LEADS", LeadWeights::leads},
                                                              {"WIDTH", width_}})
    options.push_back(name + "=" + std::to_string(value));
  const cl::Program program = device.build({"segments.clh", "templates.cl"}, options, definitions.generated);
  places_ = launcher.handle(program, "template_places");
  project_ = launcher.handle(program, "project_blocks");
  totals_ = launcher.handle(program, "project_totals");

  const auto regions = scene.regions.size();
  table_ = device.allocate(members * static_cast<std::size_t>(columns_.total * (phases_ + 1) * row_) * real,
                           "table");
  column_first_ = device.allocate(regions * sizeof(int), "column first");
  column_count_ = device.allocate(regions * sizeof(int), "column count");
  upload_ints(launcher.queue(), column_first_, columns_.first);
  upload_ints(launcher.queue(), column_count_, columns_.count);
  first_block_ = device.allocate((members + 1) * sizeof(int), "first block");
  series_ = device.allocate(static_cast<std::size_t>(samples_) * members * (LeadWeights::leads + 1) * real,
                            "series");

  if (scene.heterogeneity.parameters.empty()) return;
  range_ = device.allocate(members * regions * 2 * real, "range");
  columns_kernel_ = template_columns_kernel(launcher, scene, definitions);
}

std::size_t TemplateEcg::bytes(const Device& device, const Scene& scene, int members, std::int64_t stride) {
  const std::size_t real = real_bytes(scene.precision), hearts = static_cast<std::size_t>(members);
  const auto n = static_cast<std::size_t>(stride);
  const Extents extents = extents_of(device, scene);
  const auto row = static_cast<std::size_t>(extents.row);
  const TemplateColumns columns = template_columns(scene);
  const CellModels models(scene);
  std::size_t runs = 0;  // parameters of the cells that are run
  for (std::size_t r = 0; r < scene.regions.size(); ++r)
    if (columns.count[r] > 0)
      runs += static_cast<std::size_t>(columns.count[r]) *
              (models.all()[static_cast<std::size_t>(models.of_region()[r])].parameters.size() + 5);
  return hearts * real *
             (static_cast<std::size_t>(columns.total * (extents.phases + 1)) * row + runs +
              static_cast<std::size_t>(extents.samples) * (LeadWeights::leads + 1)) +
         n * (2 * sizeof(int) + 4 * real) +
         (n / Tissue::block_cells + 1) * (LeadWeights::leads + 1) * row * real;
}

// The table, unless it is that of the last batch: cells whose parameters differ between regions and columns.
void TemplateEcg::run_cells(std::span<const Member> members) {
  std::vector<double> ranges, all;
  const std::vector<TemplateCells> batches =
      template_cells(scene_, models_, regions_, columns_, members, ranges);
  for (const TemplateCells& batch : batches) {
    all.insert(all.end(), batch.parameters.begin(), batch.parameters.end());
    all.insert(all.end(), batch.threshold.begin(), batch.threshold.end());
    all.insert(all.end(), batch.step_factor.begin(), batch.step_factor.end());
  }
  cl::CommandQueue& queue = launcher_.queue();
  if (!scene_.heterogeneity.parameters.empty()) {
    const std::vector<std::byte> packed = pack(ranges, scene_.precision);
    queue.enqueueWriteBuffer(range_, CL_TRUE, 0, packed.size(), packed.data());
  }
  if (all == last_cells_) return;
  silent_.assign(members.size(), {});
  for (size_t k = 0; k < batches.size(); ++k) {
    const TemplateCells& batch = batches[k];
    Runs& runs = runs_[k];
    for (const auto& [buffer, numbers] :
         {std::pair{&runs.parameters, &batch.parameters}, std::pair{&runs.threshold, &batch.threshold},
          std::pair{&runs.reference, &batch.reference}, std::pair{&runs.step_factor, &batch.step_factor}}) {
      const std::vector<std::byte> packed = pack(*numbers, scene_.precision);
      queue.enqueueWriteBuffer(*buffer, CL_TRUE, 0, packed.size(), packed.data());
    }
    upload_ints(queue, runs.columns, batch.columns);
    launcher_.counted(runs.run, batch.columns.size(),
                      static_cast<double>(batch.columns.size()) * (phases_ + 1) * row_ *
                          static_cast<double>(real_bytes(scene_.precision)),
                      runs.parameters, runs.columns, runs.threshold, runs.reference, runs.step_factor, table_,
                      runs.silent, Real{interval_ms_});
    std::vector<int> silent(batch.columns.size());
    queue.enqueueReadBuffer(runs.silent, CL_TRUE, 0, silent.size() * sizeof(int), silent.data());
    for (size_t c = 0; c < silent.size(); ++c) {
      if (silent[c] == 0) continue;
      const auto m = static_cast<size_t>(batch.columns[c] / columns_.total);
      const int column = batch.columns[c] % columns_.total;
      silent_[m] = silent_column(scene_, columns_, column, batch.threshold[c]);
    }
  }
  last_cells_ = std::move(all);
}

void TemplateEcg::place_cells(const Tissue& tissue, const cl::Buffer& parameters, const cl::Buffer& arrival) {
  Device& device = launcher_.device();
  const std::size_t real = real_bytes(scene_.precision);
  if (tissue.stride > capacity_) {
    capacity_ = tissue.stride + tissue.stride / 16;
    const auto n = static_cast<std::size_t>(capacity_);
    column_of_ = device.allocate(n * real, "column of");
    place_ = device.allocate(n * sizeof(int), "place");
    start_ = device.allocate(n * sizeof(int), "start");
    share_ = device.allocate(3 * n * real, "share");
  }
  if (tissue.blocks > capacity_blocks_) {
    capacity_blocks_ = tissue.blocks + tissue.blocks / 16 + 1;
    partial_ = device.allocate(static_cast<std::size_t>(capacity_blocks_) *
                                   static_cast<std::size_t>((LeadWeights::leads + 1) * row_) * real,
                               "partial");
  }
  const auto n = static_cast<std::size_t>(tissue.stride);
  const double cells = static_cast<double>(n), bytes = static_cast<double>(real);
  const cl::NDRange global(n), local(Tissue::group);
  if (!scene_.heterogeneity.parameters.empty())
    launcher_(columns_kernel_, global, local, cells * (1 + 4 * bytes), parameters, tissue.member_of,
              tissue.region, tissue.coordinates, range_, column_of_, tissue.stride);
  launcher_(places_, global, local, cells * (9 + 4 * bytes), arrival, tissue.member_of, tissue.region,
            column_first_, column_count_, column_of_, table_, place_, start_, share_, tissue.stride,
            Real{interval_ms_});
}

std::vector<double> TemplateEcg::series(const Tissue& tissue, const cl::Buffer& parameters,
                                        const cl::Buffer& arrival, const cl::Buffer& weights,
                                        std::span<const Member> members) {
  run_cells(members);
  place_cells(tissue, parameters, arrival);
  cl::CommandQueue& queue = launcher_.queue();
  upload_ints(queue, first_block_, tissue.first_block);
  const std::size_t real = real_bytes(scene_.precision);
  const auto blocks = static_cast<std::size_t>(tissue.blocks), samples = static_cast<std::size_t>(samples_);
  const std::size_t group = group_;
  const std::size_t per_item = group * static_cast<std::size_t>(width_);
  const std::size_t items = (samples + per_item - 1) / per_item * group;
  const double bytes = static_cast<double>(real);
  launcher_(project_, cl::NDRange(items, blocks), cl::NDRange(group, 1),
            static_cast<double>(blocks) *
                (Tissue::block_cells * (11 * bytes + 8) + (LeadWeights::leads + 1) * row_ * bytes),
            table_, place_, start_, share_, tissue.inverse_capacity, weights, partial_, tissue.stride,
            tissue.blocks);
  const std::size_t rows = members.size() * (LeadWeights::leads + 1);
  launcher_(totals_, cl::NDRange((samples + group - 1) / group * group, rows), cl::NDRange(group, 1),
            static_cast<double>(blocks * samples) * (LeadWeights::leads + 1) * bytes, partial_, first_block_,
            series_, tissue.blocks, static_cast<int>(members.size()));
  std::vector<std::byte> host(samples * rows * real);
  queue.enqueueReadBuffer(series_, CL_TRUE, 0, host.size(), host.data());
  return unpack(host, scene_.precision);
}

}  // namespace cohort
