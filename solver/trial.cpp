#include "solver/trial.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "solver/circulation.hpp"
#include "solver/excitation.hpp"
#include "solver/heartbeat.hpp"
#include "solver/pv_output.hpp"
#include "solver/simulation_state.hpp"

namespace cohort {

namespace {

// Steps of the default heart's beat, of those at rest: walls thin as it fills and muscle stiffens. Measured
// at 4 mm (solver/README.md); 1.24 and 1.26 at 8 and 6 mm.
constexpr double beat_over_rest = 1.3;
// Beats of the default heart until they agree to 1 %, where the scene leaves it open.
constexpr double usual_beats = 4;
constexpr const char* counts_steps = "solid_forces";

std::int64_t launches_of(Device& device, const char* kernel) {
  std::int64_t sum = 0;
  for (const Footprint::Kernel& k : device.footprint().kernels)
    if (kernel == nullptr || k.name == kernel) sum += k.launches;
  return sum;
}

/// One batch through a device, in parts that are timed.
class Trying {
 public:
  Trying(Device& device, const Scene& scene, const Plan& plan, double most_s)
      : device_(device), scene_(scene), plan_(plan), most_s_(most_s), launcher_(device, scene.precision) {
    if (excites(scene)) excitation_.emplace(launcher_, scene, plan);
    if (Heartbeat::wanted(scene)) heartbeat_.emplace(launcher_, scene, plan);
  }

  /// batch_of: members of batch number k. The first compiles; of those behind it the median counts, of as
  /// many as most_s has room for.
  Trial run(const std::function<std::vector<Member>(std::size_t)>& batch_of) {
    constexpr std::size_t most_batches = 5;
    const double cold_s = batch(batch_of(0), 0);
    const auto start = Clock::now();
    std::vector<Trial> trials;
    do {
      const std::vector<Member> members = batch_of(trials.size() + 1);
      const double compiled_s = batch(members, most_s_);
      trial_.first_batch_s = std::max(0.0, cold_s - compiled_s);
      trial_.seconds_per_member =
          (trial_.setup_s + trial_.steps * trial_.step_s) / static_cast<double>(members.size());
      trials.push_back(trial_);
    } while (trials.size() < most_batches && seconds_since(start) < most_s_);
    std::sort(trials.begin(), trials.end(),
              [](const Trial& a, const Trial& b) { return a.seconds_per_member < b.seconds_per_member; });
    Trial result = trials[trials.size() / 2];
    result.footprint = device_.footprint();
    return result;
  }

 private:
  /// Its set-up and steps for up to most_s; returns the seconds of its set-up and of its first steps.
  double batch(std::span<const Member> members, double most_s) {
    const auto start = Clock::now();
    std::vector<Recording> recordings(members.size(), blank_recording(scene_));
    std::vector<Recording*> all;
    for (Recording& recording : recordings) all.push_back(&recording);
    for (Recording& recording : recordings) recording.outcome = Outcome::done;
    trial_.setup_s = trial_.step_s = trial_.steps = 0;
    TimeSteps steps{};
    if (excitation_) {
      excitation_->prepare(members);
      launcher_.queue().finish();
      if (!excitation_->eikonal)
        steps = choose_steps(
            scene_,
            *std::max_element(excitation_->monodomain.fastest_rate().begin(),
                              excitation_->monodomain.fastest_rate().end()),
            *std::min_element(excitation_->monodomain.diffusion_limit_ms().begin(),
                              excitation_->monodomain.diffusion_limit_ms().end()),
            members[0].values[static_cast<std::size_t>(scene_.parameters.index("time.step_factor"))]);
      else
        excitation_->project(members, all);
      launcher_.queue().finish();
      for (Recording& recording : recordings) recording.outcome = Outcome::done;
    }
    trial_.setup_s = seconds_since(start);
    double first_steps_s = 0;
    if (excitation_ && !excitation_->eikonal && !excitation_->coupled)
      first_steps_s += march(members, all, steps, most_s);
    if (heartbeat_) {
      for (Recording& recording : recordings) recording.outcome = Outcome::done;
      first_steps_s += beat(members, all, steps, most_s);
    }
    return trial_.setup_s + first_steps_s;
  }

  /// The time loop for most_s at most. Waits of the host end stretches that double in length, of which the
  /// last counts.
  double march(std::span<const Member> members, std::span<Recording* const> all, const TimeSteps& steps,
               double most_s) {
    const auto total = std::ceil(recorded_ms(scene_) / steps.dt_ms - 1e-9);
    const int each = Excitation::window_steps(steps);
    const auto start = Clock::now();
    auto last = start;
    std::int64_t window = 0, next = 2, last_window = 0, last_launches = 0;
    double step_s = 0;
    excitation_->march(steps, members, all, 1e9, [&](double) {
      if (window++ < next) return true;
      launcher_.queue().finish();
      const double stretch_s = seconds_since(last);
      const std::int64_t launches = launches_of(device_, nullptr), windows = window - 1 - last_window;
      step_s = stretch_s / static_cast<double>(windows * each);
      trial_.launches_per_step =
          static_cast<double>(launches - last_launches) / static_cast<double>(windows * each);
      last = Clock::now();
      last_window = window - 1;
      last_launches = launches;
      next *= 2;
      // A stretch more would take twice as long as the last one.
      return seconds_since(start) + 2 * stretch_s < most_s;
    });
    launcher_.queue().finish();
    const double whole_s = seconds_since(start);
    trial_.step_s = step_s > 0 ? step_s : whole_s / total;
    trial_.steps = total;
    return std::min(whole_s, 2.0 * each * trial_.step_s);
  }

  /// The beat for most_s at most.
  double beat(std::span<const Member> members, std::span<Recording* const> all, const TimeSteps& steps,
              double most_s) {
    const std::int64_t steps_before = launches_of(device_, counts_steps),
                       launches_before = launches_of(device_, nullptr);
    const double simulated_before = heartbeat_->simulated_ms();
    const auto start = Clock::now();
    Excitation* excitation = excitation_ ? &*excitation_ : nullptr;
    // A circulation alone is a matter of milliseconds.
    heartbeat_->run(members, all, excitation, steps, scene_.mechanics ? prepared_s_ + most_s : 1e9);
    const double whole_s = seconds_since(start);
    prepared_s_ = heartbeat_->prepared_s();
    trial_.setup_s += prepared_s_;
    const double loop_s = whole_s - prepared_s_;
    const double simulated =
        (heartbeat_->simulated_ms() - simulated_before) / static_cast<double>(members.size());
    const bool finished = std::none_of(all.begin(), all.end(), [](const Recording* recording) {
      return recording->outcome == Outcome::timeout;
    });
    const auto taken = static_cast<double>(launches_of(device_, counts_steps) - steps_before);
    if (taken > 0)
      trial_.launches_per_step = static_cast<double>(launches_of(device_, nullptr) - launches_before) / taken;
    if (finished || !scene_.mechanics) {  // the whole loop, as it will be run
      const double batches_steps = std::max(taken, 1.0);
      trial_.beats = scene_.beats ? simulated / beat_ms(scene_) : 1;
      extend(batches_steps, loop_s / batches_steps);
      return first_steps(taken, loop_s);
    }
    const bool quasi_static = scene_.mechanics->quasi_static;
    const double beat = scene_.circulation ? beat_ms(scene_) : 0;
    trial_.beats = 1;
    if (scene_.beats) {
      const int most = most_beats(scene_);
      trial_.beats_are_known = most <= 2;
      trial_.beats = std::min<double>(most, usual_beats);
    } else if (scene_.circulation) {
      trial_.beats = recorded_ms(scene_) / beat;
    }
    const double length = scene_.beats ? beat : quasi_static ? 0 : recorded_ms(scene_);
    // Of cells and tissue together by the time that went by; the tissue's own by its step.
    constexpr double steps_to_rest = 1000;
    double each_beat =
        quasi_static ? std::max(steps_to_rest, 2 * taken) : beat_over_rest * length / plan_.dt_ms;
    if (excitation_ && excitation_->coupled && simulated > 0) each_beat = taken * length / simulated;
    if (simulated > length && length > 0) each_beat = taken * length / simulated;
    extend((scene_.beats ? trial_.beats : 1) * each_beat, loop_s / std::max(taken, 1.0));
    return first_steps(taken, loop_s);
  }

  /// Seconds of as many steps as the first batch took.
  double first_steps(double taken, double loop_s) {
    if (first_taken_ < 0) first_taken_ = taken;
    return taken > 0 ? loop_s * std::min(1.0, first_taken_ / taken) : loop_s;
  }

  /// Adds steps to what there is; their seconds are what counts.
  void extend(double steps, double step_s) {
    const double seconds = trial_.steps * trial_.step_s + steps * step_s;
    trial_.steps = std::max(steps, trial_.steps);
    trial_.step_s = seconds / trial_.steps;
  }

  Device& device_;
  const Scene& scene_;
  const Plan& plan_;
  double most_s_, prepared_s_ = 0, first_taken_ = -1;
  Launcher launcher_;
  std::optional<Excitation> excitation_;
  std::optional<Heartbeat> heartbeat_;
  Trial trial_;
};

}  // namespace

std::string module_of(const std::string& file) {
  static const std::map<std::string, std::string> modules = {
      {"tissue", "geometry"},
      {"labels", "geometry"},
      {"excitation", "geometry"},
      {"eikonal", "eikonal"},
      {"eikonal_activation", "eikonal"},
      {"eikonal_sweep", "eikonal"},
      {"reaction_eikonal", "eikonal"},
      {"conduction_system", "eikonal"},
      {"template_cells", "templates"},
      {"template_columns", "templates"},
      {"templates", "templates"},
      {"template_ecg", "templates"},
      {"monodomain", "monodomain"},
      {"cell_setup", "monodomain"},
      {"stimulus", "monodomain"},
      {"diffusion", "diffusion"},
      {"stencil", "diffusion"},
      {"diffusion_bound", "diffusion"},
      {"bidomain", "bidomain"},
      {"torso", "torso"},
      {"lead_weights", "torso"},
      {"sample_leads", "torso"},
      {"source_faces", "torso"},
      {"forward_ecg", "torso"},
      {"record", "recorder"},
      {"cell_checks", "recorder"},
      {"check_weights", "torso"},
      {"recorder", "recorder"},
      {"probes", "activation times"},
      {"heartbeat", "mechanics"},
      {"tension_drive", "tension drive"},
      {"drive_cells", "tension drive"},
      {"electromechanics", "electromechanics"},
      {"lumped_circulation", "circulation"},
      {"circulation", "circulation"},
  };
  const std::size_t slash = file.find_last_of('/');
  const std::string name = slash == std::string::npos ? file : file.substr(slash + 1);
  const std::string stem = name.substr(0, name.find('.'));
  if (const auto it = modules.find(stem); it != modules.end()) return it->second;
  return stem.starts_with("solid") ? "mechanics" : "";
}

Trial try_out(Device& device, const Scene& scene, const Plan& plan, std::span<const Member> members,
              double most_s) {
  Member base{0, scene.parameters.values()};
  scene.parameters.resolve(base.values);
  const auto batch = static_cast<std::size_t>(plan.members_per_device);
  device.restart_footprint();
  return Trying(device, scene, plan, most_s).run([&](std::size_t k) {
    std::vector<Member> result;
    for (std::size_t m = 0; m < std::clamp<std::size_t>(members.size(), 1, batch); ++m)
      result.push_back(members.empty() ? base : members[(k * batch + m) % members.size()]);
    return result;
  });
}

}  // namespace cohort
