#include "solver/lumped_circulation.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <sstream>

#include "solver/circulation.hpp"

namespace cohort {

namespace {

bool windkessel(const Scene& scene) {
  return scene.circulation->kind == Circulation::Kind::windkessel;
}

std::size_t compartments_of(const Scene& scene) {
  return windkessel(scene) ? 2 : 6;
}

}  // namespace

std::string instability(const Scene& scene, const HeartStatus& status) {
  constexpr std::array<const char*, 6> compartments = {
      "left ventricle", "right ventricle", "left atrium", "right atrium", "aorta", "pulmonary artery"};
  const bool artery = windkessel(scene) && status.where == 1;
  const std::string place = compartments.at(artery ? 4 : static_cast<std::size_t>(status.where));
  std::ostringstream text;
  text.precision(4);
  switch (status.defect) {
    case HeartDefect::no_number:
      text << "the pressure of the " << place << " is no number or beyond 1 MPa (" << status.value
           << " mmHg)";
      break;
    case HeartDefect::empty:
      text << "the volume of the " << place << " is negative (" << status.value << " mL)";
      break;
    case HeartDefect::switching:
      text << "coupling oscillation: the valves switched " << status.value << " times in a beat";
      break;
    case HeartDefect::ringing:
      text << "coupling oscillation: the pressure of the " << place << " rings from step to step by "
           << status.value << " mmHg";
      break;
    case HeartDefect::steep:
      text << "coupling oscillation, or a load too sudden for the tissue: the pressure of the " << place
           << " changes by " << status.value << " mmHg/s";
      break;
    case HeartDefect::apart:
      text << "coupling oscillation, or tissue that nothing holds: the blood of the " << place
           << " and its volume are " << status.value << " mL apart";
      break;
    case HeartDefect::leaking:
      text << "blood is not conserved: " << status.value << " mL more in the loop than at its start";
      break;
    case HeartDefect::none:
      break;
  }
  return text.str();
}

std::size_t LumpedCirculation::bytes(const Scene& scene, int members_per_batch, std::size_t samples) {
  const std::size_t rows = 2 * compartments_of(scene) * samples * sizeof(float);
  return static_cast<std::size_t>(members_per_batch) *
             (heart_state_bytes + sizeof(HeartStatus) + sizeof(double) + rows) +
         2 * Device::least_bytes;  // the clock, and what blood is less than one
}

LumpedCirculation::LumpedCirculation(Launcher& launcher, const Scene& scene, int members_per_batch,
                                     std::size_t samples, bool single)
    : launcher_(launcher),
      compartments_(compartments_of(scene)),
      samples_(samples),
      at_most_(most_beats(scene)),
      single_(single || !launcher.device().has_double()) {
  Device& device = launcher.device();
  const ParameterTable& table = scene.parameters;
  const int dt = table.find("circulation.dt_ms");  // of elastances alone
  dt_ms_ = dt < 0 ? 0 : table[dt].value;
  std::vector<std::string> options = {"PARAMETERS=" + std::to_string(scene.parameters.size())};
  if (scene.precision == Precision::double_) options.push_back("DOUBLE");
  const std::string tables = circulation_tables(scene, single_);
  build_total_ = [&device, options, tables] {
    return device.build({"circulation.clh", "beats.clh", "total_blood.cl"}, options, tables);
  };
  if (dt_ms_ > 0) options.push_back("ALONE");
  const cl::Program program =
      device.build({"circulation.clh", "beats.clh", "circulation.cl"}, options, tables);
  start_ = launcher.handle(program, "start_circulation");
  if (dt_ms_ > 0) advance_ = launcher.handle(program, "advance_circulation");

  const auto members = static_cast<std::size_t>(members_per_batch);
  states_ = device.allocate(members * heart_state_bytes, "states");
  status_ = device.allocate(members * sizeof(HeartStatus), "status");
  blood_ = device.allocate(members * sizeof(double), "blood");
  pressure_ = device.allocate(members * compartments_ * samples * sizeof(float), "pressure");
  volume_ = device.allocate(members * compartments_ * samples * sizeof(float), "volume");

  steps_of_beat_ = dt_ms_ > 0 ? static_cast<int>(std::ceil(beat_ms(scene) / dt_ms_)) : 0;
  const std::vector<double> numbers = {beat_ms(scene), scene.beats ? 0 : table.value("time.end_ms"),
                                       scene.pv ? 1000 / table.value("outputs.pv.rate_hz") : 1,
                                       scene.beats ? table.value("time.beats.until_periodic") : 0, dt_ms_};
  const std::vector<std::byte> packed = pack(numbers, single_ ? Precision::single_ : Precision::double_);
  numbers_ = device.allocate(packed.size(), "numbers");
  launcher.queue().enqueueWriteBuffer(numbers_, CL_TRUE, 0, packed.size(), packed.data());
}

void LumpedCirculation::initialise(const cl::Buffer& parameters, int members) {
  members_ = members;
  const auto count = static_cast<std::size_t>(members);
  if (samples_ > 0)
    for (const cl::Buffer& buffer : {pressure_, volume_})
      launcher_.queue().enqueueFillBuffer(buffer, std::numeric_limits<float>::quiet_NaN(), 0,
                                          count * compartments_ * samples_ * sizeof(float));
  launcher_.queue().enqueueFillBuffer(status_, cl_uchar{0}, 0, count * sizeof(HeartStatus));
  launcher_.counted(start_, count, 0, parameters, states_, numbers_);
}

void LumpedCirculation::advance(const cl::Buffer& parameters, int steps) {
  launcher_.counted(advance_, static_cast<std::size_t>(members_), 0, parameters, states_, status_, numbers_,
                    pressure_, volume_, at_most_, static_cast<int>(samples_), steps);
}

std::vector<HeartStatus> LumpedCirculation::status() {
  std::vector<HeartStatus> result(static_cast<std::size_t>(members_));
  launcher_.queue().enqueueReadBuffer(status_, CL_TRUE, 0, result.size() * sizeof(HeartStatus),
                                      result.data());
  return result;
}

std::vector<double> LumpedCirculation::blood() {
  const Precision precision = single_ ? Precision::single_ : Precision::double_;
  if (total_.program() == nullptr) total_ = launcher_.handle(build_total_(), "total_blood");
  launcher_.counted(total_, static_cast<std::size_t>(members_), 0, states_, blood_);
  std::vector<std::byte> raw(static_cast<std::size_t>(members_) * real_bytes(precision));
  launcher_.queue().enqueueReadBuffer(blood_, CL_TRUE, 0, raw.size(), raw.data());
  return unpack(raw, precision);
}

std::vector<float> LumpedCirculation::series(const cl::Buffer& buffer) {
  std::vector<float> result(static_cast<std::size_t>(members_) * compartments_ * samples_);
  if (!result.empty())
    launcher_.queue().enqueueReadBuffer(buffer, CL_TRUE, 0, result.size() * sizeof(float), result.data());
  return result;
}

}  // namespace cohort
