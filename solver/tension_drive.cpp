#include "solver/tension_drive.hpp"

#include <algorithm>
#include <cmath>

#include "solver/circulation.hpp"
#include "solver/mechanics.hpp"
#include "solver/new_buffer.hpp"
#include "solver/pv_output.hpp"

namespace cohort {

namespace {

// The fastest tension rises in 10 ms.
constexpr double spacing_ms = 0.5;
constexpr int foot = 12;  ///< samples of the upstroke below the threshold

double table_ms(const Scene& scene) {
  return scene.circulation ? beat_ms(scene) : recorded_ms(scene);
}

int row_of(const Scene& scene) {
  return foot + static_cast<int>(std::ceil(table_ms(scene) / spacing_ms)) + 1;
}

MaterialFile::Drive drive_of(const Scene& scene) {
  return !scene.mechanics || scene.mechanics->tension.empty() ? MaterialFile::Drive::none
                                                              : read_tension(scene.mechanics->tension).drive;
}

}  // namespace

bool TensionDrive::wanted(const Scene& scene) {
  return drive_of(scene) != MaterialFile::Drive::none;
}

TensionDrive::TensionDrive(Launcher& launcher, const Scene& scene, const Definitions& definitions,
                           int members_per_batch)
    : launcher_(launcher),
      scene_(scene),
      models_(scene),
      regions_(region_parameters(scene)),
      columns_(template_columns(scene)),
      row_(row_of(scene)),
      table_(launcher.device().allocate(bytes(scene, members_per_batch))) {
  std::vector<std::string> options = {"FOOT=" + std::to_string(foot), "ROW=" + std::to_string(row_)};
  if (scene.precision == Precision::double_) options.emplace_back("DOUBLE");
  if (drive_of(scene) == MaterialFile::Drive::calcium) options.emplace_back("CALCIUM");
  for (const CellModel& model : models_.all())
    runs_.push_back(launcher.handle(launcher.device().build({"gates.clh", "cells/" + model.name + ".cl",
                                                             "template_cell.clh", "drive_cells.cl"},
                                                            options, model.macros()),
                                    "run_drives"));
  if (!scene.heterogeneity.parameters.empty())
    varying_ = template_columns_kernel(launcher, scene, definitions);
}

std::size_t TensionDrive::bytes(const Scene& scene, int members) {
  return static_cast<std::size_t>(members) *
         static_cast<std::size_t>((template_columns(scene).total + 1) * row_of(scene)) *
         real_bytes(scene.precision);
}

std::vector<std::string> TensionDrive::options() const {
  return {"DRIVE_TABLE", "DRIVE_FOOT=" + std::to_string(foot), "DRIVE_ROW=" + std::to_string(row_),
          "DRIVE_COLUMNS=" + std::to_string(columns_.total + 1)};
}

// The tables, unless they are those of the last batch. A member whose cells are those of one before it gets a
// copy of that one's.
void TensionDrive::prepare(std::span<const Member> members) {
  std::vector<std::vector<TemplateCells>> cells;
  std::vector<double> all, ranges;
  for (const Member& member : members) {
    cells.push_back(template_cells(scene_, models_, regions_, columns_, {&member, 1}, ranges));
    for (const TemplateCells& of_model : cells.back()) {
      all.insert(all.end(), of_model.parameters.begin(), of_model.parameters.end());
      all.insert(all.end(), of_model.threshold.begin(), of_model.threshold.end());
      all.insert(all.end(), of_model.step_factor.begin(), of_model.step_factor.end());
    }
  }
  if (all == last_cells_) return;
  const auto same = [](const std::vector<TemplateCells>& a, const std::vector<TemplateCells>& b) {
    return std::equal(
        a.begin(), a.end(), b.begin(), b.end(), [](const TemplateCells& x, const TemplateCells& y) {
          return x.parameters == y.parameters && x.threshold == y.threshold && x.step_factor == y.step_factor;
        });
  };
  std::vector<std::size_t> source;  // by member: the first one with its cells
  for (std::size_t m = 0; m < members.size(); ++m) {
    std::size_t first = 0;
    while (!same(cells[first], cells[m])) ++first;
    source.push_back(first);
  }
  cl::CommandQueue& queue = launcher_.queue();
  const int columns = columns_.total + 1;
  defects_.assign(members.size(), {});
  for (std::size_t k = 0; k < models_.all().size(); ++k) {
    TemplateCells batch;
    for (std::size_t m = 0; m < members.size(); ++m) {
      if (source[m] != m) continue;
      const TemplateCells& own = cells[m][k];
      batch.parameters.insert(batch.parameters.end(), own.parameters.begin(), own.parameters.end());
      batch.threshold.insert(batch.threshold.end(), own.threshold.begin(), own.threshold.end());
      batch.step_factor.insert(batch.step_factor.end(), own.step_factor.begin(), own.step_factor.end());
      for (const int column : own.columns) batch.columns.push_back(static_cast<int>(m) * columns + column);
    }
    const auto reals = [&](const std::vector<double>& host) {
      return upload_new(launcher_, pack(host, scene_.precision));
    };
    const std::size_t count = batch.columns.size();
    const cl::Buffer silent = launcher_.device().allocate(count * sizeof(int), "silent");
    launcher_.counted(runs_[k], count,
                      static_cast<double>(count * static_cast<std::size_t>(row_)) *
                          static_cast<double>(real_bytes(scene_.precision)),
                      reals(batch.parameters), upload_new(launcher_, batch.columns), reals(batch.threshold),
                      reals(batch.step_factor), table_, silent, Real{spacing_ms}, Real{table_ms(scene_)},
                      static_cast<int>(std::lround(scene_.parameters.value("mechanics.drive_beats"))));
    std::vector<int> host(count);
    queue.enqueueReadBuffer(silent, CL_TRUE, 0, count * sizeof(int), host.data());
    for (std::size_t c = 0; c < count; ++c)
      if (host[c] != 0)
        defects_[static_cast<std::size_t>(batch.columns[c] / columns)] =
            silent_column(scene_, columns_, batch.columns[c] % columns, batch.threshold[c]);
  }
  const std::size_t real = real_bytes(scene_.precision), row = static_cast<std::size_t>(row_) * real,
                    table = static_cast<std::size_t>(columns) * row;
  const double idle = drive_of(scene_) == MaterialFile::Drive::calcium ? idle_mM : idle_mV;
  const std::vector<std::byte> rest =
      pack(std::vector<double>(static_cast<std::size_t>(row_), idle), scene_.precision);
  for (std::size_t m = 0; m < members.size(); ++m) {
    queue.enqueueWriteBuffer(table_, CL_TRUE, m * table + static_cast<std::size_t>(columns_.total) * row, row,
                             rest.data());
    if (source[m] == m) continue;
    queue.enqueueCopyBuffer(table_, table_, source[m] * table, m * table, table);
    defects_[m] = defects_[source[m]];
  }
  last_cells_ = std::move(all);
}

void TensionDrive::connect(std::span<const Member> members, std::span<const std::size_t> of_tissue,
                           const Tissue& tissue, const cl::Buffer& parameters, std::span<const int> places,
                           Solid& solid) {
  solid.drive(table_, columns_of_cells(members, of_tissue, tissue, parameters, places, solid.mesh()),
              {1 / spacing_ms, 0, 0, 0});
}

// By cell of the mesh: its place between the columns of its member, that of idle tissue last.
std::vector<double> TensionDrive::columns_of_cells(std::span<const Member> members,
                                                   std::span<const std::size_t> of_tissue,
                                                   const Tissue& tissue, const cl::Buffer& parameters,
                                                   std::span<const int> places, const SolidMesh& mesh) {
  std::vector<double> along(static_cast<std::size_t>(tissue.stride), 0);
  if (!scene_.heterogeneity.parameters.empty()) {
    // Ranges by member of the tissue; of those that do not beat nobody asks.
    std::vector<double> ranges(tissue.tissue_cells.size() * scene_.regions.size() * 2, 0), own;
    template_cells(scene_, models_, regions_, columns_, members, own);
    const std::size_t width = scene_.regions.size() * 2;
    for (std::size_t m = 0; m < members.size(); ++m)
      std::copy_n(own.begin() + static_cast<std::ptrdiff_t>(m * width), width,
                  ranges.begin() + static_cast<std::ptrdiff_t>(of_tissue[m] * width));
    const auto n = static_cast<std::size_t>(tissue.stride);
    const cl::Buffer column = launcher_.device().allocate(n * real_bytes(scene_.precision), "column");
    launcher_(varying_, cl::NDRange(n), cl::NDRange(Tissue::group), static_cast<double>(n), parameters,
              tissue.member_of, tissue.region, tissue.coordinates,
              upload_new(launcher_, pack(ranges, scene_.precision)), column, tissue.stride);
    std::vector<std::byte> raw(n * real_bytes(scene_.precision));
    launcher_.queue().enqueueReadBuffer(column, CL_TRUE, 0, raw.size(), raw.data());
    along = unpack(raw, scene_.precision);
  }
  std::vector<double> result(static_cast<std::size_t>(mesh.cells), columns_.total);
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (mesh.grid_cell[i] < 0 || places[i] < 0) continue;
    const auto place = static_cast<std::size_t>(places[i]);
    const auto region = static_cast<std::size_t>(tissue.regions[place]);
    if (columns_.count[region] > 0)
      result[i] = columns_.first[region] + along[place] * (columns_.count[region] - 1);
  }
  return result;
}

}  // namespace cohort
