#pragma once

#include <functional>
#include <map>
#include <span>
#include <vector>

#include "solver/cell_models.hpp"
#include "solver/diffusion.hpp"
#include "solver/electrophysiology.hpp"

namespace cohort {

/// The monodomain equation on the tissue of a batch, split by Strang (kernels/monodomain.cl).
class Monodomain {
 public:
  Monodomain(Launcher& launcher, const Scene& scene, const Definitions& definitions, int members_per_batch);

  /// Assembles the operator for the tissue of `members` and reads the limits of their steps. Of a scene with
  /// heterogeneity the tissue must have its coordinates.
  void assemble(const Tissue& tissue, Diffusion& diffusion, const cl::Buffer& parameters,
                std::span<const Member> members);
  /// By member: largest stable explicit diffusion step (ms) and fastest rate of the cell model (1/ms).
  const std::vector<double>& diffusion_limit_ms() const { return diffusion_limit_ms_; }
  const std::vector<double>& fastest_rate() const { return fastest_rate_; }

  /// Resting state everywhere, for steps of dt_ms with `substeps` diffusion steps in each.
  void initialise(const Tissue& tissue, const cl::Buffer& parameters, double dt_ms, int substeps);

  /// One step from time_ms: diffusion (half a step when `first`, which opens the splitting), then reaction.
  void advance(const Tissue& tissue, const cl::Buffer& parameters, double time_ms, bool first);

  /// The reaction alone of a step from time_ms, on the potential `diffused` that the caller has diffused.
  void react(const Tissue& tissue, const cl::Buffer& parameters, double time_ms, const cl::Buffer& diffused);
  /// A step of diffusion alone, from != to.
  void diffuse(const Tissue& tissue, const cl::Buffer& from, const cl::Buffer& to, double dt_ms);

  /// Closes the splitting: the potential after half a step of diffusion more, for looking; the solution stays
  /// as it is.
  const cl::Buffer& closed_potential(const Tissue& tissue);
  int substeps() const { return substeps_; }
  /// to = base + dt_ms L stage on the tissue's cells; potentials (stride).
  void diffusion_stage(const Tissue& tissue, const cl::Buffer& stage, const cl::Buffer& base,
                       const cl::Buffer& to, double dt_ms);

  /// Potential (stride) mV after the last step; the closing half step of diffusion is not in it.
  const cl::Buffer& potential() const { return potential_[current_]; }
  /// The cells' states (states of the model that has most, stride).
  const cl::Buffer& states() const { return states_; }
  const cl::Buffer& stencil() const { return stencil_; }
  /// Index of each cell's model (stride), where there are several.
  const cl::Buffer& model_of() const { return model_of_; }
  /// Activation times (activation_fields(scene), stride), kernels/monodomain.cl.
  const cl::Buffer& activation() const { return activation_; }
  /// (stride) bit k where stimulus k acts.
  const std::vector<std::uint8_t>& stimulated_by() const { return stimulated_by_host_; }
  /// (stride) 1/ms, what stretch-activated channels add (kernels/monodomain.cl); 0 after assemble().
  const cl::Buffer& stretch_rate() const { return stretch_rate_; }
  /// Name of state k of the cells of a region.
  const std::string& state_name(std::size_t k, std::size_t region) const {
    return models_.all()[static_cast<std::size_t>(models_.of_region()[region])].states[k].name;
  }
  double dt_ms() const { return dt_ms_; }
  /// Diffusion that is still to be done where a step ends.
  double open_ms() const { return scene_.splitting == Splitting::strang ? 0.5 * dt_ms_ : 0; }
  /// The same mask and the stimuli's numbers (members, stimuli, stimulus_numbers) on the device.
  const cl::Buffer& stimulated_by_mask() const { return stimulated_by_; }
  const cl::Buffer& stimuli() const { return stimuli_buffer_; }
  /// Steps take no stimulus from now on until assemble(): something else starts the front.
  void silence_stimuli() { stimuli_.clear(); }

  /// Device bytes for `stride` compact cells of `batch` of `members`, at most; substeps take another real a
  /// cell.
  static std::size_t bytes(const Scene& scene, std::span<const Member> members, int batch,
                           std::int64_t stride);
  /// Least bytes that one step's last launch, and a stage of diffusion, move for each cell.
  double bytes_per_cell_step() const;
  double bytes_per_cell_stage() const;

 private:
  void step(const Tissue& tissue, const cl::Buffer& parameters, double time_ms, const cl::Buffer& stage,
            const cl::Buffer& base, const cl::Buffer& before, double dt_diffusion);
  /// By derived constant of all models: its field, or -1.
  static std::vector<int> fields_of(const Scene& scene, std::span<const Member> members);
  void choose_fields(std::span<const Member> members);
  void begin();
  void build_kernels();
  std::vector<double> read(const cl::Buffer& buffer, std::size_t count);
  std::string generated() const;
  void read_rates(const Tissue& tissue, const cl::Buffer& parameters, std::size_t members);

  Launcher& launcher_;
  const Scene& scene_;
  Definitions definitions_;
  CellModels models_;
  RegionParameters regions_;
  int members_per_batch_, width_;
  int capacity_ = 0;
  double dt_ms_ = 0;
  int substeps_ = 1;
  int current_ = 0;
  std::vector<bool> region_varies_;  ///< by region: its cell parameters vary through the wall
  bool heterogeneous_;               ///< in some region they do
  bool few_states_;
  bool constants_by_value_;  ///< derived constants are an argument of the step, not a buffer
  Reals constants_;
  std::vector<int> field_of_;  ///< by derived constant of all models: its field, or -1
  int fields_ = 0, fields_allocated_ = -1;
  std::vector<double> diffusion_limit_ms_, fastest_rate_;
  std::vector<std::vector<double>> stimuli_;
  std::vector<std::uint8_t> stimulated_by_host_;

  cl::Buffer potential_[2], states_, stencil_, derived_, derived_fields_, fastest_rate_buffer_, activation_,
      stimulated_by_, stimuli_buffer_, model_of_, stretch_rate_;
  cl::Buffer stage_;   ///< first stage of a diffusion step
  cl::Buffer before_;  ///< potential at the start of a step and while it is closed; with substeps only
  int before_capacity_ = 0;
  struct Kernels {
    Launcher::Handle derive, segment_rates, initialise, step, stimulated_step, diffusion_step;
    std::function<Launcher::Handle()> build_stimulated;  ///< with the first stimulus
  };
  std::map<std::vector<int>, Kernels> kernels_by_fields_;
  Kernels* kernels_ = nullptr;
  Launcher::Handle mark_stimuli_;
};

}  // namespace cohort
