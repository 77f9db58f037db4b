#include "solver/heartbeat.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "solver/circulation.hpp"
#include "solver/energy_balance.hpp"
#include "solver/excitation.hpp"
#include "solver/mechanics.hpp"
#include "solver/pv_output.hpp"
#include "solver/tissue_places.hpp"

namespace cohort {

namespace {

// A stretch of steps whose kernels are timed, behind the first looks: by then all are compiled.
constexpr std::int64_t first_timed_step = 1024, timed_steps = 64;
// As in kernels/solid_reduce.clh.
constexpr double smallest_volume_ratio = 0.02;
constexpr double seconds_between_words = 10;  ///< of what --verbose tells of long batches
// Steps between two looks of the host at the members' states.
constexpr int steps_per_look = 512;

}  // namespace

Grid solid_grid(const Scene& scene, const Plan& plan) {
  const double dx = scene.parameters.value("grid.dx_mm"), coarse = solid_dx_mm(scene);
  Grid grid{};
  grid.dx_mm = coarse;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    constexpr double rounding = 1e-6;
    const double first = std::floor(plan.origin_mm[axis] / coarse + rounding);
    const double last = std::ceil((plan.origin_mm[axis] + dx * plan.cells[axis]) / coarse - rounding);
    grid.origin_mm[axis] = first * coarse;
    grid.cells[axis] = static_cast<int>(last - first);
  }
  grid.cells[0] = (grid.cells[0] + Tissue::lanes - 1) / Tissue::lanes * Tissue::lanes;
  return grid;
}

std::size_t Heartbeat::bytes(const Scene& scene, int members_per_batch) {
  return (scene.circulation ? LumpedCirculation::bytes(scene, members_per_batch, pv_times_ms(scene).size())
                            : 0) +
         static_cast<std::size_t>(members_per_batch * scene.parameters.size()) * real_bytes(scene.precision);
}

Heartbeat::Heartbeat(Launcher& launcher, const Scene& scene, const Plan& plan)
    : launcher_(launcher),
      scene_(scene),
      samples_(scene.circulation ? pv_times_ms(scene).size() : 0),
      parameters_(launcher.device().allocate(
          static_cast<std::size_t>(plan.members_per_device * scene.parameters.size()) *
          real_bytes(scene.precision))) {
  if (scene.circulation) circulation_.emplace(launcher, scene, plan.members_per_device, samples_);
  if (scene.mechanics) {
    const Grid grid = solid_grid(scene, plan);
    if (plan.activation == ActivationMethod::eikonal && TensionDrive::wanted(scene))
      drive_.emplace(
          launcher, scene,
          scene_definitions(scene, {plan.cells, plan.origin_mm, scene.parameters.value("grid.dx_mm")}),
          plan.members_per_device);
    if (Electromechanics::wanted(scene, plan.activation))
      coupling_.emplace(
          launcher, scene,
          scene_definitions(scene, {plan.cells, plan.origin_mm, scene.parameters.value("grid.dx_mm")}));
    solid_.emplace(launcher, scene, scene_definitions(scene, grid), grid, plan.members_per_device,
                   plan.viscous,
                   drive_      ? drive_->options()
                   : coupling_ ? Electromechanics::options(scene)
                               : std::vector<std::string>());
    if (scene.displacement) points_.emplace(launcher, scene, *solid_);
  }
}

void Heartbeat::upload(std::span<const Member> members) {
  std::vector<double> values;
  for (const Member& member : members)
    values.insert(values.end(), member.values.begin(), member.values.end());
  const std::vector<std::byte> packed = pack(values, scene_.precision);
  launcher_.queue().enqueueWriteBuffer(parameters_, CL_TRUE, 0, packed.size(), packed.data());
}

void Heartbeat::run(std::span<const Member> members, std::span<Recording* const> recordings,
                    Excitation* excitation, const TimeSteps& steps, double timeout_s) {
  const auto start = Clock::now();
  std::vector<std::size_t> beating;  // of the batch
  std::vector<Member> own;
  for (std::size_t m = 0; m < members.size(); ++m) {
    if (recordings[m]->outcome != Outcome::done) continue;
    if (const std::string why = scene_.circulation ? circulation_defect(scene_, members[m].values) : "";
        !why.empty()) {
      reject(*recordings[m], why);
      continue;
    }
    if (const std::string why = law_defect(scene_, members[m].values); !why.empty()) {
      reject(*recordings[m], why);
      continue;
    }
    beating.push_back(m);
    own.push_back(members[m]);
  }
  if (beating.empty()) return;
  upload(own);
  if (solid_) {
    solid_->build(parameters_, own);
    if (drive_) drive_->prepare(own);
    std::vector<std::size_t> sound;
    std::vector<Member> moving;
    for (std::size_t k = 0; k < beating.size(); ++k) {
      std::string why = solid_->defect(k);
      if (why.empty() && drive_) why = drive_->defect(k);
      if (why.empty() && points_) why = points_->defect(*solid_, k);
      if (!why.empty()) {
        reject(*recordings[beating[k]], why);
        continue;
      }
      sound.push_back(beating[k]);
      moving.push_back(own[k]);
    }
    if (sound.empty()) return;
    if (sound.size() < beating.size()) {
      beating = sound;
      own = moving;
      upload(own);
      solid_->build(parameters_, own);
      if (drive_) drive_->prepare(own);
    }
    if (points_) points_->begin(*solid_, beating.size());
    if (excitation && !excitation->coupled && !scene_.mechanics->tension.empty())
      activate(own, beating, *excitation);
  }
  if (circulation_) circulation_->initialise(parameters_, static_cast<int>(beating.size()));
  prepared_s_ = seconds_since(start);
  if (solid_)
    spdlog::debug("{} members' tissue of {} cells is set up in {:.3g} s", beating.size(),
                  solid_->mesh().cells, prepared_s_);
  const bool late = coupling_
                        ? beat_with_cells(members, recordings, beating, *excitation, steps, start, timeout_s)
                    : solid_ ? beat_tissue(start, timeout_s)
                             : beat_alone(start, timeout_s);
  const double share_s = seconds_since(start) / static_cast<double>(beating.size());
  std::vector<HeartStatus> status(beating.size());
  // Of the batch: (members, ...) each.
  std::vector<float> pressure, volume, displacement;
  if (circulation_) {
    status = circulation_->status();
    pressure = circulation_->pressure();
    volume = circulation_->volume();
  } else if (solid_) {
    const std::vector<float> both = solid_->cavity_series();
    const auto half = static_cast<std::ptrdiff_t>(both.size() / beating.size() / 2);
    for (auto it = both.begin(); it != both.end(); it += 2 * half) {
      pressure.insert(pressure.end(), it, it + half);
      volume.insert(volume.end(), it + half, it + 2 * half);
    }
  }
  if (points_) displacement = points_->series();
  const auto keep = [&](const std::vector<float>& all, std::size_t k, std::vector<float>& own_series) {
    const std::size_t row = all.size() / beating.size();
    const auto first = all.begin() + static_cast<std::ptrdiff_t>(k * row);
    own_series.assign(first, first + static_cast<std::ptrdiff_t>(row));
  };
  const std::vector<double> state = solid_ ? solid_->state() : std::vector<double>();
  for (std::size_t k = 0; k < beating.size(); ++k) {
    Recording& recording = *recordings[beating[k]];
    if (recording.outcome != Outcome::done) continue;                     // its cells went wrong
    recording.device_s = (coupling_ ? 0 : recording.device_s) + share_s;  // a march of both is in the share
    const std::span<const double> tissue =
        solid_ ? std::span(state).subspan(k * Solid::state_size, Solid::state_size)
               : std::span<const double>();
    simulated_ms_ += tissue.empty() ? static_cast<double>(status[k].ended_ms) : tissue[Solid::time];
    keep(pressure, k, recording.pressure);
    keep(volume, k, recording.volume);
    keep(displacement, k, recording.displacement);
    store(own[k], k, late ? timeout_s : 0, status[k], tissue, recording);
  }
}

// Of each cell of the solid, the arrival time at its place or the nearest that a wave reaches, and what comes
// behind it.
void Heartbeat::activate(std::span<const Member> members, std::span<const std::size_t> of_tissue,
                         Excitation& excitation) {
  const std::vector<float> times = excitation.activation_times();
  const std::vector<int> places = nearest_places(*solid_, excitation.tissue, times, of_tissue);
  solid_->activate(values_at(places, times));
  if (drive_) drive_->connect(members, of_tissue, excitation.tissue, excitation.parameters, places, *solid_);
}

// A beat at a time, all in one launch.
bool Heartbeat::beat_alone(Clock::time_point start, double timeout_s) {
  for (bool running = true; running;) {
    circulation_->advance(parameters_, circulation_->steps_of_beat());
    const std::vector<HeartStatus> status = circulation_->status();
    running = std::any_of(status.begin(), status.end(),
                          [](const HeartStatus& s) { return s.ended == HeartEnd::running; });
    if (running && seconds_since(start) > timeout_s) return true;
  }
  return false;
}

void Heartbeat::step(std::int64_t number, bool windows) {
  Solid& solid = *solid_;
  const bool measured = number % steps_per_measure == 0,
             sampled = windows || measured || (number + 1) % steps_per_measure == 0;
  solid.forces(parameters_);
  if (measured) solid.measure(parameters_);  // behind the forces, whose tensions it reads
  solid.predict(sampled);
  if (circulation_)
    solid.beat(parameters_, *circulation_, static_cast<int>(samples_), sampled, measured);
  else
    solid.load(measured);
  solid.move();
  if (points_) points_->sample(solid);
}

bool Heartbeat::beat_tissue(Clock::time_point start, double timeout_s) {
  double told_s = seconds_since(start);
  for (std::int64_t number = 0;; ++number) {
    if (number == first_timed_step) launcher_.profile(true);
    if (number == first_timed_step + timed_steps) launcher_.profile(false);
    step(number, false);
    if ((number + 1) % steps_per_look != 0) {
      if (number % steps_per_measure == 0) launcher_.queue().flush();
      continue;
    }
    const std::vector<double> state = solid_->state();
    bool running = false;
    for (std::size_t k = Solid::ended; k < state.size(); k += Solid::state_size)
      running = running || state[k] == 0;
    if (seconds_since(start) > told_s + seconds_between_words) {
      told_s = seconds_since(start);
      spdlog::debug("tissue of the first member at {:.1f} ms after {:.0f} s", state[Solid::time], told_s);
    }
    if (running && seconds_since(start) <= timeout_s) continue;
    launcher_.profile(false);
    return running;
  }
}

void Heartbeat::store(const Member& member, std::size_t k, double timeout_s, const HeartStatus& status,
                      std::span<const double> tissue, Recording& recording) {
  const auto unstable = [&](double time_ms, const std::string& reason) {
    end_unstable(recording, time_ms, fmt::format("{}, at {:.1f} ms", reason, time_ms));
  };
  const auto timeout = [&](double time_ms) {
    recording.outcome = Outcome::timeout;
    recording.failed_at_ms = time_ms;
    recording.reason = fmt::format("not finished after {:g} s: at {:.1f} ms", timeout_s, time_ms);
  };
  if (!tissue.empty()) {
    recording.dt_ms = tissue[Solid::largest_step];
    auto end = static_cast<SolidEnd>(static_cast<int>(tissue[Solid::ended]));
    // The last steps are behind the last look at the cells.
    if (const double least = end == SolidEnd::settled ? solid_->worst_cell(k).second : 1;
        !(least > smallest_volume_ratio))
      end = std::isnan(least) ? SolidEnd::runaway : SolidEnd::inverted;
    if (end != SolidEnd::moves && end != SolidEnd::settled)
      return unstable(tissue[Solid::time], solid_->failure(k, end));
    spdlog::debug("member {}: its steps took up to {:.3f} of their bound", member.id,
                  tissue[Solid::step_share]);
    if (end == SolidEnd::moves && timeout_s > 0) return timeout(tissue[Solid::time]);
  } else if (status.ended == HeartEnd::running) {
    return timeout(status.beats * beat_ms(scene_));
  }
  if (scene_.circulation && recording.dt_ms == 0)
    recording.dt_ms = circulation_->dt_ms() *
                      member.values[static_cast<std::size_t>(scene_.parameters.index("time.step_factor"))];
  if (status.ended == HeartEnd::unstable)
    return unstable(static_cast<double>(status.ended_ms), instability(scene_, status));
  if (scene_.beats && most_beats(scene_) > 1 && status.beats > 0 &&
      !(status.difference <= scene_.parameters.value("time.beats.until_periodic")))
    spdlog::warn("member {}: after {} beats the last two differ by {:.2g}: not periodic to {:.2g}", member.id,
                 status.beats, status.difference, scene_.parameters.value("time.beats.until_periodic"));
  constexpr int most_switches = 20;  // eight of a healthy beat and some
  if (!tissue.empty() && status.switches > most_switches)
    spdlog::warn(
        "member {}: its valves switched {} times in a beat: pressures ring, or the chambers hardly eject",
        member.id, status.switches);
  // Tissue is taken for nearly incompressible: slivers aside, cells of a healthy beat keep three quarters.
  if (constexpr double low = 0.6; !tissue.empty() && tissue[Solid::smallest_J] < low)
    spdlog::warn(
        "member {}: a cell of the tissue was pressed to {:.2f} of its volume; a larger "
        "mechanics.bulk_modulus_kPa or a weaker tension keeps it",
        member.id, tissue[Solid::smallest_J]);
  std::vector<float> features = recorded_pv_features(scene_, recording, member.values);
  if (scene_.circulation && !features.empty()) {
    features.insert(features.end(), {static_cast<float>(status.beats), status.difference});
    if (!tissue.empty())
      features.insert(features.end(), {static_cast<float>(status.switches), status.ringing_mmHg,
                                       status.apart_mL, static_cast<float>(tissue[Solid::smallest_J])});
  }
  if (balances_energy(scene_)) {
    const std::vector<float> balance = energy_balance(scene_, tissue);
    if (const double left = energy_left(scene_, tissue); !(std::abs(left) < largest_energy_left))
      return unstable(
          tissue[Solid::time],
          fmt::format("the energy of the tissue does not balance: {:.2g} of it is left over", left));
    features.insert(features.end(), balance.begin(), balance.end());
  }
  std::copy(features.rbegin(), features.rend(), recording.features.rbegin());  // the last of layout()
}

}  // namespace cohort
