#include "solver/eikonal.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "solver/precision.hpp"

namespace cohort {

namespace {

constexpr int most_sweeps = 100'000;
constexpr double source_radius_mm = 6;  // of the cells about a source that get the exact time
constexpr double least_source_cells = 2;

}  // namespace

Eikonal::Eikonal(Launcher& launcher, const Scene& scene, const Definitions& definitions,
                 std::vector<std::uint8_t> graph_of_region)
    : launcher_(launcher),
      definitions_(definitions),
      precision_(scene.precision),
      width_(launcher.device().vector_width(scene.precision == Precision::double_)) {
  Device& device = launcher.device();
  const std::string width = "WIDTH=" + std::to_string(width_);
  const cl::Program program = definitions.build(
      device, {"segments.clh", "field_gradient.clh", "eikonal.clh", "eikonal.cl", "eikonal_sources.cl"},
      {width});
  link_ = launcher.handle(program, "eikonal_link");
  normals_ = launcher.handle(program, "eikonal_normals");
  sheet_metric_kernel_ = launcher.handle(program, "eikonal_sheet_metric");
  metric_kernel_ = launcher.handle(program, "eikonal_metric");
  start_kernel_ = launcher.handle(program, "eikonal_start");
  trigger_kernel_ = launcher.handle(program, "eikonal_trigger");
  fire_ = launcher.handle(program, "eikonal_fire");
  second_differences_ = launcher.handle(program, "eikonal_second_differences");
  correction_kernel_ = launcher.handle(program, "eikonal_correction");
  slow_ = launcher.handle(program, "eikonal_slow");

  graph_of_region.resize(255, 1);
  graph_of_region_ = device.allocate(graph_of_region.size(), "graph of region");
  launcher.queue().enqueueWriteBuffer(graph_of_region_, CL_TRUE, 0, graph_of_region.size(),
                                      graph_of_region.data());
  last_change_ = device.allocate(sizeof(int), "last change");
}

std::size_t Eikonal::bytes(std::int64_t stride, Precision precision) {
  return static_cast<std::size_t>(stride) * (15 * real_bytes(precision) + 2 * sizeof(int)) +
         2 * (static_cast<std::size_t>(stride) / Tissue::lanes + 1) * sizeof(int);
}

void Eikonal::reserve(const Tissue& tissue) {
  if (tissue.stride <= capacity_ && with_sheet_ <= sheet_capacity_) return;
  Device& device = launcher_.device();
  sheet_capacity_ = with_sheet_;
  capacity_ = tissue.stride + tissue.stride / 16;
  const auto cells = static_cast<std::size_t>(capacity_);
  const std::size_t real = real_bytes(precision_);
  for (cl::Buffer& buffer : arrival_)
    buffer = device.allocate((with_sheet_ ? 2 : 1) * cells * real, "arrival");
  if (with_sheet_) {
    sheet_metric_ = device.allocate(6 * cells * real, "sheet metric");
    slowed_depth_ = device.allocate(cells * real, "slowed depth");
  }
  for (cl::Buffer& buffer : changed_)
    buffer = device.allocate((cells / Tissue::lanes + 1) * sizeof(int), "changed");
  metric_ = device.allocate(6 * cells * real, "metric");
  second_ = device.allocate(6 * cells * real, "second");
  correction_ = device.allocate(cells * real, "correction");
  linked_ = device.allocate(cells * sizeof(int), "linked");
  in_sheet_ = device.allocate(cells * sizeof(int), "in sheet");
}

// Sources in rounds, of each member one in a round: cells about two sources of one member may be the same.
void Eikonal::upload_sources(const Tissue& tissue, std::span<const Source> sources) {
  sources_ = static_cast<int>(sources.size());
  first_source_.clear();
  if (sources.empty()) return;
  std::vector<std::vector<Source>> rounds;
  std::vector<std::size_t> fired(tissue.first_block.size(), 0);  // rounds, by member
  for (const Source& source : sources) {
    const int block = (source.cell - Tissue::first_cell_place) / Tissue::block_cells;
    const auto after = std::upper_bound(tissue.first_block.begin(), tissue.first_block.end(), block);
    std::size_t& round = fired[static_cast<size_t>(after - tissue.first_block.begin() - 1)];
    if (round == rounds.size()) rounds.emplace_back();
    rounds[round++].push_back(source);
  }
  std::vector<int> triggers, cells;
  std::vector<double> starts, points, trigger_points;
  const auto add = [](std::vector<double>& to, const std::optional<std::array<double, 3>>& point) {
    const std::array<double, 3> p = point.value_or(std::array<double, 3>{});
    to.insert(to.end(), {p[0], p[1], p[2], point ? 1.0 : 0.0});
  };
  for (const std::vector<Source>& round : rounds) {
    first_source_.push_back(static_cast<int>(cells.size()));
    for (const Source& source : round) {
      triggers.push_back(source.trigger);
      cells.push_back(source.cell);
      starts.push_back(source.start_ms);
      add(points, source.point);
      add(trigger_points, source.trigger_point);
    }
  }
  first_source_.push_back(sources_);
  if (sources_ > source_capacity_) {
    Device& device = launcher_.device();
    source_capacity_ = 2 * sources_;
    const auto n = static_cast<std::size_t>(source_capacity_);
    const std::size_t real = real_bytes(precision_);
    trigger_ = device.allocate(n * sizeof(int), "trigger");
    source_cell_ = device.allocate(n * sizeof(int), "source cell");
    source_point_ = device.allocate(4 * n * real, "source point");
    trigger_point_ = device.allocate(4 * n * real, "trigger point");
    start_ = device.allocate(n * real, "start");
    fired_ = device.allocate(n * real, "fired");
  }
  cl::CommandQueue& queue = launcher_.queue();
  const auto upload = [&](const cl::Buffer& buffer, const std::vector<double>& numbers) {
    const std::vector<std::byte> packed = pack(numbers, precision_);
    queue.enqueueWriteBuffer(buffer, CL_TRUE, 0, packed.size(), packed.data());
  };
  queue.enqueueWriteBuffer(trigger_, CL_TRUE, 0, triggers.size() * sizeof(int), triggers.data());
  queue.enqueueWriteBuffer(source_cell_, CL_TRUE, 0, cells.size() * sizeof(int), cells.data());
  upload(start_, starts);
  upload(source_point_, points);
  upload(trigger_point_, trigger_points);
}

void Eikonal::fire(const Tissue& tissue, int mark) {
  const Real4 grid = tissue.grid().origin_and_spacing();
  launcher_.counted(trigger_kernel_, static_cast<size_t>(sources_), 0, trigger_, trigger_point_, start_,
                    arrival_[current_], tissue.first_cell, tissue.place, tissue.region, metric_, grid, fired_,
                    tissue.stride);
  const double reach = std::max(least_source_cells, std::ceil(source_radius_mm / grid.w));
  const std::size_t cells = static_cast<size_t>(std::pow(2 * reach + 1, 3));
  for (std::size_t k = 0; k + 1 < first_source_.size(); ++k)
    launcher_.counted(
        fire_, cells * static_cast<size_t>(first_source_[k + 1] - first_source_[k]), 0, first_source_[k],
        source_cell_, source_point_, fired_, tissue.first_cell, tissue.place, tissue.region, linked_, metric_,
        with_sheet_ ? 1 : 0, with_sheet_ ? sheet_id_ : tissue.region, with_sheet_ ? sheet_distance_ : metric_,
        with_sheet_ ? sheet_speed_ : metric_, grid, Real{source_radius_mm}, static_cast<int>(reach),
        correction_, arrival_[current_], arrival_[1 - current_], changed_[mark % 2], mark, last_change_,
        tissue.stride, static_cast<int>(tissue.places.size()) * Tissue::lanes);
}

void Eikonal::sweep(const Tissue& tissue, int number) {
  const auto cells = static_cast<std::size_t>(tissue.blocks) * Tissue::block_cells;
  Launcher::Handle& kernel = with_sheet_ ? sheet_sweep_ : sweep_;
  if (kernel.program() == nullptr) {
    std::vector<std::string> options = {"WIDTH=" + std::to_string(width_)};
    if (with_sheet_) options.emplace_back("SHEET");
    kernel = launcher_.handle(
        definitions_.build(launcher_.device(), {"segments.clh", "eikonal.clh", "eikonal_sweep.cl"}, options),
        "eikonal_sweep");
  }
  launcher_(kernel, cl::NDRange(cells / static_cast<size_t>(width_)),
            cl::NDRange(Tissue::block_cells / static_cast<size_t>(width_)),
            0,  // as many bytes as the wave asks for
            arrival_[current_], arrival_[1 - current_], metric_, linked_, in_sheet_,
            with_sheet_ ? sheet_metric_ : metric_, with_sheet_ ? sheet_depth_ : metric_, tissue.neighbours,
            changed_[(number - 1) % 2], changed_[number % 2], correction_, last_change_, number,
            tissue.stride);
  current_ = 1 - current_;
}

void Eikonal::solve(const Tissue& tissue, const cl::Buffer& speed, const Sheet* sheet,
                    const cl::Buffer* initial, std::span<const Source> sources, const cl::Buffer* fibres) {
  with_sheet_ = sheet != nullptr;
  reserve(tissue);
  upload_sources(tissue, sources);
  triggered_ = std::any_of(sources.begin(), sources.end(), [](const Source& s) { return s.trigger >= 0; });
  if (with_sheet_) {
    sheet_id_ = sheet->id;
    sheet_depth_ = sheet->depth;
    sheet_distance_ = sheet->distance;
    sheet_speed_ = sheet->speed;
  }
  with_initial_ = initial != nullptr;
  if (with_initial_) initial_ = *initial;
  const auto n = static_cast<std::size_t>(tissue.stride);
  const double cells = static_cast<double>(n);
  const cl::NDRange global(n), local(Tissue::group);
  cl::CommandQueue& queue = launcher_.queue();

  const int grid_cells = static_cast<int>(tissue.places.size()) * Tissue::lanes;
  const auto real = static_cast<double>(real_bytes(precision_));
  const cl::Buffer& normal = second_;  // until the second solution
  if (with_sheet_)
    launcher_(normals_, global, local, cells * (1 + 4 * real), tissue.first_cell, tissue.place, tissue.region,
              sheet_id_, sheet->distance, normal, Real{tissue.grid().dx_mm}, tissue.stride, grid_cells);
  launcher_(link_, global, local, cells * 5, tissue.first_cell, tissue.place, tissue.region, graph_of_region_,
            with_sheet_ ? sheet_id_ : tissue.region, with_sheet_ ? 1 : 0,
            with_sheet_ ? sheet_distance_ : metric_, normal, linked_, in_sheet_, Real{tissue.grid().dx_mm},
            tissue.stride, grid_cells);
  if (with_sheet_)
    launcher_(sheet_metric_kernel_, global, local, cells * 10 * real, normal, sheet->speed, sheet_metric_,
              Real{tissue.grid().dx_mm}, tissue.stride);
  speed_ = speed;
  fibres_ = fibres != nullptr ? *fibres : tissue.fibre;
  build_metric(tissue);
  queue.enqueueFillBuffer(correction_, cl_uchar{0}, 0, n * real_bytes(precision_));
  sweeps_ = 0;
  propagate(tissue);
  correct(tissue);
  propagate(tissue);
}

void Eikonal::build_metric(const Tissue& tissue) {
  launcher_(metric_kernel_, cl::NDRange(static_cast<size_t>(tissue.stride)), cl::NDRange(Tissue::group),
            11.0 * static_cast<double>(tissue.stride) * static_cast<double>(real_bytes(precision_)), fibres_,
            speed_, tissue.region, metric_, linked_, Real{tissue.grid().dx_mm}, tissue.stride);
}

void Eikonal::slow(const Tissue& tissue, const cl::Buffer& slowness) {
  build_metric(tissue);
  launcher_(slow_, cl::NDRange(static_cast<size_t>(tissue.stride)), cl::NDRange(Tissue::group),
            13.0 * static_cast<double>(tissue.stride) * static_cast<double>(real_bytes(precision_)), slowness,
            metric_, with_sheet_ ? sheet_depth_ : metric_, with_sheet_ ? slowed_depth_ : correction_,
            with_sheet_ ? 1 : 0, tissue.stride);
  if (with_sheet_) sheet_depth_ = slowed_depth_;
  correct(tissue);
  propagate(tissue);
}

// How late linear interpolation makes the solution: what the next one leaves out.
void Eikonal::correct(const Tissue& tissue) {
  const auto n = static_cast<std::size_t>(tissue.stride);
  const double bytes = 8.0 * static_cast<double>(n * real_bytes(precision_));
  const cl::NDRange global(n), local(Tissue::group);
  const int grid_cells = static_cast<int>(tissue.places.size()) * Tissue::lanes;
  launcher_(second_differences_, global, local, bytes, tissue.first_cell, tissue.place, arrival_[current_],
            linked_, second_, tissue.stride, grid_cells);
  launcher_(correction_kernel_, global, local, 2 * bytes, tissue.first_cell, tissue.place, arrival_[current_],
            metric_, linked_, in_sheet_, with_sheet_ ? 1 : 0, second_, correction_, tissue.stride,
            grid_cells);
}

void Eikonal::propagate(const Tissue& tissue) {
  const auto n = static_cast<std::size_t>(tissue.stride);
  cl::CommandQueue& queue = launcher_.queue();
  constexpr int first_mark = 1;
  for (const cl::Buffer& buffer : changed_)
    queue.enqueueFillBuffer(buffer, cl_int{0}, 0, n / Tissue::lanes * sizeof(int));
  queue.enqueueFillBuffer(last_change_, cl_int{0}, 0, sizeof(int));
  current_ = 0;
  const std::size_t real = real_bytes(precision_);
  launcher_(start_kernel_, cl::NDRange(n), cl::NDRange(Tissue::group),
            static_cast<double>(n * ((with_initial_ ? real + 1 : 0) + (with_sheet_ ? 4 : 2) * real)),
            with_initial_ ? initial_ : metric_, with_initial_ ? 1 : 0, tissue.region, arrival_[0],
            arrival_[1], with_sheet_ ? 1 : 0, changed_[first_mark % 2], first_mark, tissue.stride);
  if (sources_ > 0) fire(tissue, first_mark);

  // A few more sweeps than needed cost less than asking after each one.
  const int sweeps_to_a_look = launcher_.device().info().gpu ? 16 : 8;
  int number = first_mark + 1;
  for (bool moving = true; moving;) {
    const int first = number;
    if (triggered_ && first > first_mark + 1) fire(tissue, first - 1);
    for (int k = 0; k < sweeps_to_a_look; ++k, ++number) sweep(tissue, number);
    int last_change = 0;
    queue.enqueueReadBuffer(last_change_, CL_TRUE, 0, sizeof last_change, &last_change);
    moving = triggered_ ? last_change >= first : last_change >= number - 1;
    if (number > most_sweeps) throw std::runtime_error("the eikonal solver does not come to rest");
  }
  sweeps_ += number - first_mark - 1;
}

}  // namespace cohort
