#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "solver/parameters.hpp"

namespace cohort {

class LabelHeart;

enum class GeometryKind { none, box, shapes, heart, labels };  ///< none: no tissue, a circulation alone
enum class TorsoKind { box, ellipsoid, cylinder, unbounded };
enum class Precision { single_, double_ };
/// How the tissue is activated: the monodomain or bidomain equations; arrival times of an eikonal equation
/// that trigger the cell model (reaction_eikonal), or that shift a template of its action potential, without
/// a time loop (eikonal). automatic: chosen by the plan.
enum class ActivationMethod { automatic, monodomain, bidomain, reaction_eikonal, eikonal };
/// How a step of the monodomain equation joins diffusion and reaction: half a step of diffusion, reaction,
/// half a step of diffusion (Strang 1968, second order; neighbouring halves are one launch), or one after the
/// other (Godunov, first order, for comparisons).
enum class Splitting { strang, godunov };
/// As configuration files and plans write it.
std::string method_name(ActivationMethod method);

/// A signed distance shape: a primitive (its sizes are parameters geometry.shapes.<name>.<primitive>.<size>)
/// or an operation on shapes named before it.
struct Shape {
  enum class Kind {
    box,
    ellipsoid,
    cylinder,
    cone,
    capsule,
    half_space,  // primitives
    union_,
    intersection,
    subtract,
    smooth_union,
    shell
  };  // set algebra
  std::string name;
  Kind kind;
  std::vector<std::string> operands;  ///< names of shapes, for the set algebra
};

/// A part of the tissue with its own material. Regions do not overlap: the first that holds a cell owns it.
struct Region {
  enum class Fibres { none, constant, transmural };  ///< rule that sets the fibre direction
  std::string name;
  std::string shape;      ///< geometry `shapes` only: the shape it fills
  bool excitable = true;  ///< false: insulates (no electrophysiology in it)
  Fibres fibres = Fibres::none;
  bool bath = false;  ///< bidomain: not excitable, but an isotropic conductor in contact with the tissue
};

struct Stimulus {
  enum class Kind { box, sphere, site };
  std::string name;
  Kind kind;
  std::string site;  ///< Kind::site only: a named place of the heart ("sinoatrial_node", ...)
};

/// How the heart is driven: from the sinoatrial node through the atria, then either after the delay of the
/// atrioventricular node to early sites on a fast (Purkinje) layer, or along the conduction path through the
/// insulating septum (region conduction_path, which exists only then).
struct ConductionSystem {
  enum class Kind { delay, path };
  enum class Surface { lv, rv_septum, rv_free_wall };  ///< endocardium on which a site lies
  struct EarlySite {
    std::string name;
    Surface surface;
  };
  Kind kind = Kind::delay;
  std::vector<EarlySite> early_sites;  ///< leaving out those of one side is a bundle branch block
};

/// Cell parameters that vary through the wall: each has slopes electrophysiology.heterogeneity.<name>.<basis>
/// (solver/heterogeneity.hpp).
struct Heterogeneity {
  std::vector<std::string> parameters;  ///< names of cell parameters; empty: none varies
  std::vector<std::string> regions;     ///< where they vary; empty: as heterogeneous_regions() says
};

/// Twelve leads: by lead fields, solved once, or by a solve of the torso at every sample.
struct EcgRequest {
  enum class Method { lead_field, forward };
  Method method = Method::lead_field;
};
struct ActivationRequest {          ///< activation times by region and at probes
  std::vector<std::string> probes;  ///< their positions are parameters outputs.activation.probes.<name>_mm
  bool beats = false;  ///< also counts activations, keeps the latest, and measures APD90 and DI at probes
};

/// Pressure and volume of all chambers and arteries, and the features of their loops.
struct PvRequest {};

/// Displacement of material points; their positions are parameters outputs.displacement.points.<name>_mm.
struct DisplacementRequest {
  std::vector<std::string> points;
};

/// The chambers of the heart, in the order of every array of chambers. A chamber is a 3D cavity of the
/// mechanics where one is so called ("lv", "rv", "la", "ra"), else an elastance of the circulation.
enum class Chamber { lv, rv, la, ra };
inline constexpr std::size_t chamber_count = 4;
inline constexpr const char* chamber_names[chamber_count] = {"lv", "rv", "la", "ra"};

/// What the chambers are joined to; its numbers are circulation.*. closed_loop: systemic and pulmonary
/// circulation with all four chambers (Regazzoni et al. 2022); windkessel: three elements behind the left
/// ventricle, which fills from a constant pressure.
struct Circulation {
  enum class Kind { closed_loop, windkessel };
  Kind kind = Kind::closed_loop;
};

/// Deforming tissue; its numbers are mechanics.*.
struct Mechanics {
  /// Blood within the tissue. Geometry `heart`: a chamber's name. `shapes`: any name, and the shape that it
  /// fills; then, without a circulation, its pressure is mechanics.cavities.<name>.pressure_kPa.
  /// bestel: the pressure follows the equation of the tension of that name, whose numbers it shares.
  struct Cavity {
    enum class Pressure { constant, bestel };
    std::string name, shape;
    Pressure pressure = Pressure::constant;
  };
  /// Condition on a surface of the tissue: of a shape, or of the heart ("base", "epicardium",
  /// "lv_endocardium", "rv_endocardium"). normal: the component along the surface's normal alone. Springs and
  /// dashpots are parallel, kPa/mm and kPa ms/mm: mechanics.boundary.<name>.*.
  struct Boundary {
    enum class Kind { clamp, clamp_normal, spring, spring_normal };
    std::string name, surface;
    Kind kind;
  };
  std::string law = "guccione";  ///< a file of kernels/laws
  std::string tension;           ///< a file of kernels/tension; empty: passive
  std::vector<Cavity> cavities;
  std::vector<Boundary> boundary;
  bool quasi_static = false;  ///< the equilibrium under the final loads alone, not the way to it
};

/// Beats of the heart until two that follow each other agree; only the last is recorded. Its numbers are
/// time.beats.*: until_periodic (largest relative difference of any extremum), at_most, length_ms.
struct Beats {};

/// What a campaign simulates: the structure that all members share, and the table of every number in it.
/// Structure is compiled into the kernels; numbers reach them as arguments, a block for each member.
struct Scene {
  GeometryKind geometry = GeometryKind::heart;
  std::vector<Shape> shapes;                      ///< geometry `shapes`
  std::shared_ptr<const LabelHeart> labels;       ///< geometry `labels`: the map and what its values mean
  std::vector<Region> regions;                    ///< filled by declare_parameters, but for `shapes`
  std::string cell_model = "mitchell_schaeffer";  ///< a file of kernels/cells
  std::map<std::string, std::string>
      region_cell_models;  ///< by name of a region: the model that it has instead
  Heterogeneity heterogeneity;
  ActivationMethod activation_method = ActivationMethod::automatic;
  Splitting splitting = Splitting::strang;
  std::vector<Stimulus> stimuli;
  std::optional<ConductionSystem> conduction_system;  ///< geometry `heart` only
  bool stretch_activated = false;  ///< a current of stretched cells: electrophysiology.stretch_activated.*
  TorsoKind torso = TorsoKind::cylinder;
  Precision precision = Precision::single_;
  std::optional<EcgRequest> ecg;
  std::optional<ActivationRequest> activation;
  std::optional<PvRequest> pv;
  std::optional<DisplacementRequest> displacement;
  std::optional<Mechanics> mechanics;
  std::optional<Circulation> circulation;
  std::optional<Beats> beats;

  ParameterTable parameters;  ///< filled by declare_parameters
};

/// Whether something excites tissue: an output of it is asked for, or an active tension waits for a wave.
inline bool excites(const Scene& scene) {
  const bool wave = scene.conduction_system || !scene.stimuli.empty();
  return scene.geometry != GeometryKind::none &&
         (scene.ecg || scene.activation || !scene.mechanics || (!scene.mechanics->tension.empty() && wave));
}

/// Fields of a cell that the scene's activation times take: none, the first time, or with beats the latest
/// and the number of activations too. A tension waits for the first as an output does.
inline int activation_fields(const Scene& scene) {
  if (scene.activation) return scene.activation->beats ? 3 : 1;
  return scene.mechanics && !scene.mechanics->tension.empty() ? 1 : 0;
}

/// Fills scene.parameters with everything the scene's structure holds, at defaults: grid, time, geometry,
/// electrophysiology, stimuli, torso. Call once the structure is set, before any value is.
/// Throws std::invalid_argument naming what the structure lacks (a shape that does not exist, a cell model
/// without a file).
void declare_parameters(Scene& scene);

/// Names of the cell models there are, from kernels/cells.
std::vector<std::string> cell_models();

/// Named stimulus sites of a geometry ("sinoatrial_node" for the heart and for label maps; none otherwise).
std::vector<std::string> stimulus_sites(GeometryKind geometry);

}  // namespace cohort
