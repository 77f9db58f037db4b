#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "solver/parameters.hpp"

namespace cohort {

class LabelHeart;

enum class GeometryKind { box, shapes, heart, labels };
enum class TorsoKind { box, ellipsoid, cylinder, unbounded };
enum class Precision { single_, double_ };
/// How the tissue is activated: the monodomain or bidomain equations; arrival times of an eikonal equation
/// that trigger the cell model (reaction_eikonal), or that shift a template of its action potential, without
/// a time loop (eikonal). automatic: chosen by the plan.
enum class ActivationMethod { automatic, monodomain, bidomain, reaction_eikonal, eikonal };

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
};

struct Stimulus {
  enum class Kind { box, sphere, site };
  std::string name;
  Kind kind;
  std::string site;  ///< Kind::site only: a named place of the heart ("sinoatrial_node", ...)
};

struct EcgRequest {};               ///< twelve leads
struct ActivationRequest {          ///< activation times by region and at probes
  std::vector<std::string> probes;  ///< their positions are parameters outputs.activation.probes.<name>_mm
};

/// What a campaign simulates: the structure that all members share, and the table of every number in it.
/// Structure is compiled into the kernels; numbers reach them as arguments, a block for each member.
struct Scene {
  GeometryKind geometry = GeometryKind::heart;
  std::vector<Shape> shapes;                      ///< geometry `shapes`
  std::shared_ptr<const LabelHeart> labels;       ///< geometry `labels`: the map and what its values mean
  std::vector<Region> regions;                    ///< filled by declare_parameters, but for `shapes`
  std::string cell_model = "mitchell_schaeffer";  ///< a file of kernels/cells
  ActivationMethod activation_method = ActivationMethod::automatic;
  std::vector<Stimulus> stimuli;
  TorsoKind torso = TorsoKind::cylinder;
  Precision precision = Precision::single_;
  std::optional<EcgRequest> ecg;
  std::optional<ActivationRequest> activation;

  ParameterTable parameters;  ///< filled by declare_parameters
};

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
