#include <algorithm>
#include <cmath>

#include "solver/heartbeat.hpp"
#include "solver/pv_output.hpp"

// Cells and deforming tissue go through time together, in windows of about a millisecond: the cells advance,
// their potential or calcium is brought to the tissue, whose members follow to the window's end in steps of
// their own, and their stretch is brought back. With time.beats the cells start each beat from rest, with the
// scene's pacing, so that beats of a periodic heart are alike; else they go on to time.end_ms.
namespace cohort {

bool Heartbeat::beat_with_cells(std::span<const Member> all, std::span<Recording* const> recordings,
                                std::span<const std::size_t> beating, Excitation& excitation,
                                const TimeSteps& steps, Clock::time_point start, double timeout_s) {
  Electromechanics& coupling = *coupling_;
  coupling.connect(*solid_, excitation.tissue, beating);
  // Inflation; tissue without a circulation waits at once.
  bool in_time = step_until_all_wait(0, start, timeout_s);
  const double length = recorded_ms(scene_);
  std::vector<Recording> ended(all.size());  // what cells of members that have ended leave goes here
  for (int beat = 0; in_time; ++beat) {
    const std::vector<double> state = solid_->state();
    std::vector<Recording*> running(recordings.begin(), recordings.end());
    bool any = false;
    for (std::size_t k = 0; k < beating.size(); ++k) {
      const std::size_t m = beating[k];
      if (state[k * Solid::state_size + Solid::ended] != 0)
        running[m] = &(ended[m] = *recordings[m]);
      else
        any = any || recordings[m]->outcome == Outcome::done;
    }
    if (!any) break;
    double begin = 0;
    excitation.march(steps, all, running, timeout_s - seconds_since(start), [&](double time_ms) {
      if (time_ms == 0) {
        if (beat == 0) coupling.drive(*solid_, excitation.tissue, excitation.monodomain, 0, 1, true);
        coupling.stretch(*solid_, excitation.tissue, excitation.monodomain, excitation.parameters);
        return true;
      }
      coupling.drive(*solid_, excitation.tissue, excitation.monodomain, begin, time_ms - begin, false);
      solid_->release(beat * length + time_ms);
      in_time = step_until_all_wait(time_ms - begin, start, timeout_s);
      coupling.stretch(*solid_, excitation.tissue, excitation.monodomain, excitation.parameters);
      begin = time_ms;
      return in_time;
    });
    if (!scene_.beats) break;
  }
  return !in_time;
}

// Members of a batch begin a window with the same launch, and those that wait take no part in what follows:
// a member's steps do not depend on how many more the others need. window_ms: its length, 0 where it is not
// known.
bool Heartbeat::step_until_all_wait(double window_ms, Clock::time_point start, double timeout_s) {
  constexpr int longest = 64, more = 1;  // steps between two looks at the members
  int next_look = longest;
  if (window_ms > 0) {
    const std::vector<double> state = solid_->state();
    double least = window_ms;
    for (std::size_t k = 0; k < state.size(); k += Solid::state_size)
      if (state[k + Solid::ended] == 0) least = std::min(least, state[k + Solid::held_step]);
    next_look = static_cast<int>(std::min(std::ceil(window_ms / least), 1.0 * longest));
  }
  for (int number = 0;; ++number) {
    step(number, true);
    if (number + 1 < next_look) continue;
    next_look += window_ms > 0 ? more : longest;
    const std::vector<double> state = solid_->state();
    bool running = false;
    for (std::size_t k = 0; k < state.size(); k += Solid::state_size)
      running = running || (state[k + Solid::ended] == 0 && state[k + Solid::waits] == 0);
    if (!running) return true;
    if (seconds_since(start) > timeout_s) return false;
  }
}

}  // namespace cohort
