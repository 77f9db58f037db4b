#include <spdlog/spdlog.h>

#include <filesystem>
#include <limits>

#include "ensemble/exports.hpp"
#include "ensemble/vtk_image.hpp"
#include "solver/observer.hpp"

namespace cohort {

namespace {

constexpr float outside = std::numeric_limits<float>::quiet_NaN();
// vtkDataSetAttributes::HIDDENCELL: readers neither draw nor cut these cells.
constexpr std::uint8_t hidden_cell = 32;

/// Fields of tissue cells on their box.
class Box {
 public:
  explicit Box(const TissueFields& tissue) : tissue_(tissue), hidden_(size(), hidden_cell) {
    for (const std::int64_t cell : tissue_.cell) hidden_[static_cast<std::size_t>(cell)] = 0;
  }
  /// values (n, components) of the tissue; `elsewhere` in all other cells.
  template <typename T>
  std::vector<T> spread(std::span<const T> values, T elsewhere, std::size_t components = 1) const {
    std::vector<T> field(size() * components, elsewhere);
    for (std::size_t k = 0; k < tissue_.cell.size(); ++k)
      for (std::size_t c = 0; c < components; ++c)
        field[static_cast<std::size_t>(tissue_.cell[k]) * components + c] = values[k * components + c];
    return field;
  }
  VtkImage image() const { return {tissue_.cells, tissue_.origin_mm, tissue_.dx_mm}; }
  const std::vector<std::uint8_t>& hidden() const { return hidden_; }
  const TissueFields& tissue() const { return tissue_; }

 private:
  std::size_t size() const {
    return static_cast<std::size_t>(tissue_.cells[0]) * static_cast<std::size_t>(tissue_.cells[1]) *
           static_cast<std::size_t>(tissue_.cells[2]);
  }
  TissueFields tissue_;
  std::vector<std::uint8_t> hidden_;
};

void write_tissue(const Box& box, const Scene& scene, std::span<const float> activation,
                  const std::filesystem::path& folder) {
  const TissueFields& tissue = box.tissue();
  VtkImage image = box.image();
  image.add("activation_ms", box.spread(activation, outside));
  image.add("region", box.spread<std::uint8_t>(tissue.region, 255));
  image.add("fraction", box.spread<float>(tissue.fraction, 0.0f));
  image.add("fibre", box.spread<float>(tissue.fibre, 0.0f, 3), 3);
  image.add("vtkGhostType", box.hidden());
  image.write(folder / "tissue.vti");
  std::string regions;
  for (std::size_t r = 0; r < scene.regions.size(); ++r)
    regions += fmt::format("{}{} {}", r == 0 ? "" : ", ", r, scene.regions[r].name);
  spdlog::info("{}: {} cells; regions {}", (folder / "tissue.vti").string(), tissue.cell.size(), regions);
}

}  // namespace

void export_vtk(const ExportedMember& exported, const std::filesystem::path& folder, double every_ms) {
  std::filesystem::create_directories(folder);
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    // An earlier export with more snapshots must not mix with this one.
    const std::string name = entry.path().filename().string();
    if (name.starts_with("potential_") && name.ends_with(".vti")) std::filesystem::remove(entry.path());
  }

  std::optional<Box> box;
  std::vector<std::pair<double, std::string>> series;
  std::vector<float> activated;
  Observer observer;
  observer.interval_ms = every_ms;
  observer.tissue = [&](const TissueFields& tissue) { box.emplace(tissue); };
  observer.potential = [&](double time_ms, std::span<const float> potential) {
    const std::string name = fmt::format("potential_{:05}.vti", series.size());
    VtkImage image = box->image();
    image.add("potential_mV", box->spread(potential, outside));
    image.add("vtkGhostType", box->hidden());
    image.write(folder / name);
    series.emplace_back(time_ms, name);
  };
  observer.activation = [&](std::span<const float> activation) {
    activated.assign(activation.begin(), activation.end());
  };
  Simulation simulation(exported.device, exported.campaign.scene, exported.plan);
  simulation.observe(std::move(observer));
  const Recording recording = simulation.run({&exported.member, 1}, exported.campaign.timeout_s).front();
  if (recording.outcome != Outcome::done)
    throw std::runtime_error(
        fmt::format("member {} did not end well: {}", exported.member.id, recording.reason));
  write_tissue(*box, exported.campaign.scene, activated, folder);
  if (every_ms > 0) {
    write_vtk_series(folder / "potential.pvd", series);
    spdlog::info("{}: {} potentials, every {} ms", (folder / "potential.pvd").string(), series.size(),
                 every_ms);
  }
}

}  // namespace cohort
