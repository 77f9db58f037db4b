#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "solver/bidomain.hpp"
#include "solver/eikonal_activation.hpp"
#include "solver/forward_ecg.hpp"
#include "solver/lead_weights.hpp"
#include "solver/monodomain.hpp"
#include "solver/observer.hpp"
#include "solver/probes.hpp"
#include "solver/reaction_eikonal.hpp"
#include "solver/recorder.hpp"
#include "solver/recording_writer.hpp"
#include "solver/simulation.hpp"
#include "solver/template_ecg.hpp"
#include "solver/time_steps.hpp"

namespace cohort {

using Clock = std::chrono::steady_clock;

inline double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Electrophysiology of a batch: its tissue and what activates it, and the ways from prepared members to
/// their recordings: solver/time_loop.cpp, and without one solver/template_projection.cpp.
struct Excitation {
  Excitation(Launcher& launcher, const Scene& scene, const Plan& plan);

  /// Geometry, operators and lead fields of `members`, whose blocks are written to `parameters`.
  void prepare(std::span<const Member> members);
  /// Prepared members to their recordings; those that cannot run are rejected. start: of their preparation.
  /// beat: what their tissue does then, for members that were run together; in place of march() where
  /// `coupled`.
  using Beat = std::function<void(std::span<const Member>, std::span<Recording* const>, const TimeSteps&)>;
  void run(std::span<const Member> members, std::span<Recording> recordings, Clock::time_point start,
           double timeout_s, const Beat& beat = {});

  /// Why member m cannot run; empty when it can.
  std::string defect(std::size_t m, const Member& member);
  bool in_torso(std::size_t m, const Member& member);
  /// One step of whatever activates the tissue.
  void advance(double time_ms, const TimeSteps& steps, bool first);
  /// The time loop of members that share their steps, from rest. window: called at 0, then every
  /// window_steps and at the end, with the time in ms; ends the loop by false.
  using Window = std::function<bool(double)>;
  void march(const TimeSteps& steps, std::span<const Member> members, std::span<Recording* const> recordings,
             double timeout_s, const Window& window = {});
  static int window_steps(const TimeSteps& steps);
  /// First activation times (stride) ms of what was excited last, -1 where there is none.
  std::vector<float> activation_times();
  /// What stands on the device when the loop has ended: activation, probes and the features of them.
  void finish(std::span<const Member> members, std::span<Recording* const> recordings);
  /// Says where and how a member went wrong that has just been told to, or whose cells have.
  void name_outcome(std::size_t m, double interval_ms, Recording& recording, bool was_done);
  std::string place_of(std::size_t cell) const;
  /// Ends members whose potentials the elliptic solver could not find.
  void stop_unsolved(std::span<Recording* const> recordings, double time_ms);
  /// ECG and activation of all members of the batch from their arrival times: no time loop. `recordings` of
  /// members that were rejected stay as they are.
  void project(std::span<const Member> members, std::span<Recording* const> recordings);

  const Scene& scene;
  Launcher& launcher;
  Grid grid;
  Definitions definitions;
  Tissue tissue;
  Diffusion diffusion;
  Monodomain monodomain;
  std::optional<Bidomain> bidomain;
  std::optional<EikonalActivation> eikonal;  ///< activation: eikonal, without a time loop
  std::optional<TemplateEcg> templates;
  std::optional<ReactionEikonal> reaction_eikonal;
  std::optional<LeadWeights> lead_weights;
  std::optional<ForwardEcg> forward;
  Recorder recorder;
  std::vector<double> weights_left;  ///< by member: Recorder::weights_left
  std::optional<Probes> probes;
  std::optional<Observation> observation;
  RecordingWriter writer;
  bool coupled;  ///< cells and deforming tissue go through time together (solver/electromechanics.hpp)
  cl::Buffer parameters;
  double simulated_ms = 0, cell_updates = 0;
  int batches = 0;  ///< run so far: kernels of the first are compiled in it, the second is timed
};

}  // namespace cohort
