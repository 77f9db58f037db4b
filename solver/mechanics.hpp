#pragma once

#include <span>
#include <string>
#include <vector>

#include "solver/scene.hpp"

namespace cohort {

/// Names of the passive laws, files of kernels/laws, and of the active tensions, files of kernels/tension.
std::vector<std::string> laws();
std::vector<std::string> tensions();

/// What a file of kernels/laws or kernels/tension declares of itself in its lines `//@`:
///   //@ parameter NAME DEFAULT LOWER UPPER UNIT "meaning" "source"
///   //@ sheets 0|1                      laws: whether they read the sheet direction
///   //@ states N                        tensions: numbers that each cell keeps
///   //@ drive none|potential|calcium    tensions: what drives them
///   //@ per_stretch2 0|1                tensions: the active stress is T / lambda^2 f (x) f, else T f (x) f
struct MaterialFile {
  enum class Drive { none, potential, calcium };
  std::string name;
  std::vector<Parameter> parameters;  ///< paths are bare names
  bool sheets = false, per_stretch2 = false;
  int states = 0;
  Drive drive = Drive::none;
};
/// Throw std::invalid_argument where there is no such file or its declarations are not as above.
MaterialFile read_law(const std::string& name);
MaterialFile read_tension(const std::string& name);

/// Declares mechanics.*: the parameters of the law and the tension (mechanics.<law>.*,
/// mechanics.<tension>.*), the bulk modulus and the viscosity, for each region of tissue its own copies of
/// all of these (mechanics.regions.<region>.*), which inherit while they are not set, and the density,
/// damping, inflation, boundary and cavities. Needs scene.regions. Throws std::invalid_argument for a law or
/// tension without a file, and for a tension driven by calcium where an excitable region's cell model has
/// none.
void declare_mechanics(Scene& scene);

/// What a program of the mechanics needs beside its own kernels.
struct MechanicsText {
  /// Macros M_<name>, the place of each number in the block M of a region; LAW_SHEETS; TENSION 0|1,
  /// TENSION_STATES, TENSION_NEEDS_POTENTIAL, TENSION_NEEDS_CALCIUM, TENSION_PER_STRETCH2; and the table
  /// `constant int material_first[]`: by region the place of its block in the parameters P of a member, -1
  /// where it is no tissue.
  std::string generated;
  std::vector<std::string> files;  ///< to join in front of the program's kernels
  MaterialFile law, tension;       ///< tension without a name: passive
};
MechanicsText mechanics_text(const Scene& scene);

/// Spacing of the mechanics' grid: its own, or that of the scene.
double solid_dx_mm(const Scene& scene);

/// Whether the tissue of a member with these values (inherited ones filled in) is viscous somewhere.
bool viscous(const Scene& scene, std::span<const double> values);

/// Why the tissue of a member with these values (inherited ones filled in) is no stable solid: a region whose
/// law, at rest, resists some change of shape or of volume with nothing or less. Empty where all are stable,
/// or nothing deforms.
std::string law_defect(const Scene& scene, std::span<const double> values);

/// The least stiffness e : 2 dS/dC : e (kPa) of the law of a region at rest, over unit strains e that keep
/// the volume. NaN for a law that is not known in closed form.
double least_stiffness_at_rest(const Scene& scene, std::span<const double> values, std::size_t region);

}  // namespace cohort
