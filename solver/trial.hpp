#pragma once

#include <span>
#include <string>

#include "solver/footprint.hpp"
#include "solver/simulation.hpp"

namespace cohort {

/// What a batch took of a device when its set-up and its first steps were run.
struct Trial {
  Footprint footprint;
  double launches_per_step = 0;   ///< of the time loop, samples and looks shared; 0: there is none
  double first_batch_s = 0;       ///< what the first batch takes beyond the next ones: it compiles
  double setup_s = 0;             ///< of a batch, behind the first
  double step_s = 0;              ///< of a batch
  double steps = 0;               ///< expected, of `beats` beats; a member's own where the tissue has its own
  double beats = 1;               ///< expected
  bool beats_are_known = true;    ///< else a member may have 2 to time.beats.at_most
  double seconds_per_member = 0;  ///< expected wall time behind the first batch
};

/// Runs the set-up of members of `members` twice, as many as make a batch, the second time others where there
/// are, then their steps for up to `most_s` of wall time and as many as are needed to see each kernel.
/// base: stands in where there are no members, or no sound ones. Recordings are thrown away.
Trial try_out(Device& device, const Scene& scene, const Plan& plan, std::span<const Member> members,
              double most_s = 1);

/// The module of a plan that a kernel file, or a source file that allocates, belongs to; empty where it is
/// none of these.
std::string module_of(const std::string& file);

}  // namespace cohort
