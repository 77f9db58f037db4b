#pragma once

#include <memory>
#include <span>
#include <vector>

#include "solver/diffusion.hpp"
#include "solver/elliptic.hpp"
#include "solver/monodomain.hpp"

namespace cohort {

/// The bidomain equations (kernels/bidomain.cl) around the cell model and the states of a Monodomain, whose
/// operator is then that of the intracellular conductivity. The extracellular potential is held in one box
/// for each member, over tissue and bath.
class Bidomain {
 public:
  Bidomain(Launcher& launcher, const Scene& scene, const Definitions& definitions, const Grid& grid,
           int members_per_batch);

  /// Conductors, operators and injected currents of `members`, after monodomain.assemble().
  void assemble(const Tissue& tissue, Diffusion& diffusion, const Monodomain& monodomain,
                const cl::Buffer& parameters, std::span<const Member> members);
  /// Forgets the extracellular potential, after monodomain.initialise().
  void initialise();

  /// One step from time_ms: diffusion (half a step when `first`) by the midpoint rule with a phi_e of each of
  /// its stages, then reaction.
  void advance(const Tissue& tissue, Monodomain& monodomain, const cl::Buffer& parameters, double time_ms,
               bool first);
  /// The potential with the splitting closed, for looking; the solution stays as it is.
  const cl::Buffer& closed_potential(const Tissue& tissue, Monodomain& monodomain, double time_ms);
  /// phi_e of any potential on the tissue, (stride) mV, mean zero over what conducts.
  const cl::Buffer& extracellular(const Tissue& tissue, const Monodomain& monodomain, const cl::Buffer& V,
                                  double time_ms);

  /// Residual over source where it was largest since initialise(), by member.
  const std::vector<double>& worst_residual() const { return worst_residual_; }
  /// The residual beyond which a member is not to be trusted.
  double acceptable_residual() const { return 100 * tolerance_; }
  std::int64_t solves() const { return solves_; }          ///< since construction
  std::int64_t iterations() const { return iterations_; }  ///< V-cycles, since construction

  /// Tissue and bath, and the couplings of the extracellular operator on them (6, stride).
  const Tissue& conductor() const { return conductor_; }
  const cl::Buffer& conductor_stencil() const { return conductor_stencil_; }
  /// Operators on the boxes from the two compact ones: part of assemble(), for who has changed them.
  void build_operators(const Tissue& tissue, const cl::Buffer& intracellular);
  /// A current into the cells of the conductor, (conductor's stride) mV/ms, that flows while
  /// boundary_current_start_ms and _duration_ms say; its sum over a member must be zero.
  void inject(const std::vector<double>& current);
  /// phi_e of member m in every cell of the conductor, in the order of its cells; read back.
  std::vector<double> potential_of_conductor(std::size_t m) const;

  /// Device bytes for as many members as `conductor`, tissue and bath, holds one of; `stride` compact cells
  /// of tissue and `conductor_stride` of tissue and bath in all.
  static std::size_t bytes(const Device& device, const Tissue& conductor, int members, std::int64_t stride,
                           std::int64_t conductor_stride, Precision precision);

 private:
  struct Box {
    std::array<int, 3> lower, cells;
    std::unique_ptr<EllipticSolver> solver;
    cl::Buffer source, injected;
    struct Track {
      cl::Buffer potential, before;  ///< the last two solutions
      int solved = 0;                ///< since initialise(), up to 2
    };
    Track tracks[2];  ///< of the stages of a step
    double share = 0;
    std::array<cl::Buffer*, 5> fields() {
      return {&source, &tracks[0].potential, &tracks[0].before, &tracks[1].potential, &tracks[1].before};
    }
  };
  static Box box_of(const Tissue& conductor, std::size_t m);
  enum Stage { at_start, at_middle };
  void solve(const Tissue& tissue, const Monodomain& monodomain, const cl::Buffer& V, double from_ms,
             double to_ms, Stage stage, bool next_step);
  void gather(const Tissue& tissue, const cl::Buffer& V, Stage stage);
  void last_stage(const Tissue& tissue, const Monodomain& monodomain, const cl::Buffer& stage,
                  const cl::Buffer& base, double dt_ms, const cl::Buffer& to);
  void half_step(const Tissue& tissue, Monodomain& monodomain, double dt_ms, const cl::Buffer& to);
  const cl::Buffer& scratch(std::size_t which);
  void boundary_current(std::span<const Member> members);
  double injected_share(std::size_t m, double from_ms, double to_ms) const;

  Launcher& launcher_;
  const Scene& scene_;
  Tissue conductor_;
  int extracellular_offset_, width_;
  double tolerance_;
  std::vector<Box> boxes_;
  std::vector<std::array<double, 2>> injected_ms_;  ///< by member: start and end
  bool injects_ = false;
  int capacity_ = 0, conductor_capacity_ = 0;
  bool stale_ = true;
  std::int64_t solves_ = 0, iterations_ = 0;
  std::vector<double> worst_residual_;
  cl::Buffer conductor_stencil_, extracellular_, intracellular_, diffused_, scratch_[3];
  Launcher::Handle add_couplings_, source_, injected_source_, extrapolate_, gather_, diffusion_;
};

}  // namespace cohort
