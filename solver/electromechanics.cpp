#include "solver/electromechanics.hpp"

#include <algorithm>

#include "solver/mechanics.hpp"
#include "solver/new_buffer.hpp"
#include "solver/tension_drive.hpp"
#include "solver/tissue_places.hpp"

namespace cohort {

bool Electromechanics::wanted(const Scene& scene, ActivationMethod activation) {
  return scene.mechanics && excites(scene) && activation != ActivationMethod::eikonal &&
         (TensionDrive::wanted(scene) || scene.stretch_activated);
}

Electromechanics::Electromechanics(Launcher& launcher, const Scene& scene, const Definitions& definitions)
    : launcher_(launcher),
      scene_(scene),
      driven_(TensionDrive::wanted(scene)),
      calcium_(driven_ && read_tension(scene.mechanics->tension).drive == MaterialFile::Drive::calcium) {
  std::vector<std::string> options = {"SOLID_BLOCK=" + std::to_string(SolidMesh::block)};
  std::string generated = definitions.generated;
  if (scene.stretch_activated) options.emplace_back("STRETCH_ACTIVATED");
  if (calcium_) {
    options.emplace_back("CALCIUM");
    const CellModels models(scene);
    generated += "constant int calcium_state[] = {";
    for (const int model : models.of_region()) {
      std::ptrdiff_t place = 0;
      if (model >= 0) {
        const auto& states = models.all()[static_cast<std::size_t>(model)].states;
        place = std::find_if(states.begin(), states.end(),
                             [](const CellModel::State& state) { return state.name == "Cai"; }) -
                states.begin();
      }
      generated += std::to_string(place) + ",";
    }
    generated += "};\n";
  }
  Definitions own = definitions;
  own.generated = generated;
  const cl::Program program =
      own.build(launcher.device(), {"solid_tile.clh", "segments.clh", "electromechanics.cl"}, options);
  bring_drive_ = launcher.handle(program, "bring_drive");
  bring_activation_ = launcher.handle(program, "bring_activation");
  if (scene.stretch_activated) bring_stretch_ = launcher.handle(program, "bring_stretch");
}

std::vector<std::string> Electromechanics::options(const Scene& scene) {
  std::vector<std::string> options = {"WINDOWS=1"};
  if (TensionDrive::wanted(scene)) options.emplace_back("DRIVE_CELLS");
  return options;
}

std::size_t Electromechanics::bytes(const Scene& scene, std::size_t cells, std::size_t stride) {
  return cells * (sizeof(int) + 2 * real_bytes(scene.precision)) + 2 * stride * sizeof(int);
}

void Electromechanics::connect(Solid& solid, const Tissue& tissue, std::span<const std::size_t> members) {
  const CellPlaces places = places_within(solid, tissue, members);
  first_ = upload_new(launcher_, places.first, "first");
  places_ = upload_new(launcher_, places.places, "places");
  cell_of_ = upload_new(launcher_, cells_around(solid, tissue, members), "cell of");
  const auto cells = static_cast<std::size_t>(solid.mesh().cells);
  // Of tissue that no wave excites.
  drive_ = upload_new(
      launcher_,
      pack(std::vector<double>(2 * cells, calcium_ ? TensionDrive::idle_mM : TensionDrive::idle_mV),
           scene_.precision),
      "drive");
  solid.activate(std::vector<float>(cells, -1));
  solid.drive(drive_, drive_, {});
}

void Electromechanics::drive(Solid& solid, const Tissue& tissue, const Monodomain& monodomain,
                             double begin_ms, double length_ms, bool first) {
  const auto cells = static_cast<std::size_t>(solid.mesh().cells);
  const cl::NDRange global(cells), local(SolidMesh::block);
  const double bytes =
      static_cast<double>(cells) * (8 + 4 * static_cast<double>(real_bytes(scene_.precision)));
  if (driven_) {
    launcher_(bring_drive_, global, local, bytes, calcium_ ? monodomain.states() : monodomain.potential(),
              tissue.region, first_, places_, drive_, tissue.stride, solid.mesh().cells, first ? 1 : 0);
    solid.drive(drive_, drive_, {begin_ms, 1 / length_ms, 0, 0});
  }
  launcher_(bring_activation_, global, local, bytes, monodomain.activation(), first_, places_,
            solid.activations());
}

void Electromechanics::stretch(const Solid& solid, const Tissue& tissue, const Monodomain& monodomain,
                               const cl::Buffer& parameters) {
  if (!scene_.stretch_activated) return;
  const auto n = static_cast<std::size_t>(tissue.stride);
  launcher_(bring_stretch_, cl::NDRange(n), cl::NDRange(Tissue::group),
            static_cast<double>(n) * (4 + 2 * static_cast<double>(real_bytes(scene_.precision))),
            solid.tension_states(), cell_of_, tissue.member_of, parameters, monodomain.stretch_rate(),
            solid.stretch_field(), solid.tension_fields());
}

}  // namespace cohort
