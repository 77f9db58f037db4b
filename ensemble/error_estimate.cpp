#include "ensemble/error_estimate.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "ensemble/choose_checks.hpp"
#include "ensemble/table.hpp"

namespace cohort {
namespace {

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

/// What /errors/crc32 covers, in this order.
constexpr std::array covered{Column::error_checks,  Column::error_mean,     Column::error_rms,
                             Column::error_largest, Column::error_left_out, Column::error_left_out_constant,
                             Column::error_model,   Column::error_measured, Column::error_estimate};
constexpr std::size_t rows_at_once = 65536;

template <typename T>
std::vector<T> values(const Store& store, Column column, std::size_t first, std::size_t count) {
  const auto bytes = store.read_rows(column, first, count);
  std::vector<T> result(bytes.size() / sizeof(T));
  std::memcpy(result.data(), bytes.data(), bytes.size());
  return result;
}

template <typename T>
std::vector<T> values(const Store& store, Column column) {
  return values<T>(store, column, 0, store.rows(column));
}

template <typename T>
std::span<const char> bytes_of(const std::vector<T>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(T)};
}

std::uint32_t add_to_checksum(std::uint32_t sum, std::span<const char> bytes) {
  return static_cast<std::uint32_t>(
      ::crc32_z(sum, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

bool all_ended(const Store& store) {
  const auto statuses = store.statuses();
  return std::all_of(statuses.begin(), statuses.end(), is_final);
}

/// The errors of the checks, and their models.
struct Errors {
  std::vector<std::int64_t> members;  ///< by check
  std::vector<double> measured;       ///< (checks, F) NaN where there is none
  std::vector<FeatureError> features;
  std::vector<ErrorModel> models;  ///< (F)
};

/// Tell when beats ended, by another rule in a check (half_steps): their difference is no error.
bool is_of_the_rule(const std::string& feature) {
  return feature == "beats" || feature == "beat_difference";
}

/// (checks, F)
std::vector<double> measure(const Store& store, const Store& checks, std::span<const std::int64_t> members,
                            double order) {
  std::vector<double> errors;
  for (std::size_t check = 0; check < members.size(); ++check) {
    const auto member = static_cast<std::size_t>(members[check]);
    const bool both = checks.status(static_cast<std::int64_t>(check)) == Status::done &&
                      store.status(members[check]) == Status::done;
    const auto coarse = values<float>(store, Column::features, member, 1);
    const auto fine = values<float>(checks, Column::features, check, 1);
    for (std::size_t i = 0; i < coarse.size(); ++i) {
      const double error = both && !is_of_the_rule(store.features()[i])
                               ? error_of(static_cast<double>(coarse[i]), static_cast<double>(fine[i]), order)
                               : NaN;
      errors.push_back(std::isfinite(error) ? error : NaN);
    }
  }
  return errors;
}

Errors errors_of(const Store& store, const Store& checks, std::span<const double> points,
                 std::size_t parameters, double order) {
  Errors result;
  result.members = values<std::int64_t>(checks, Column::member_of_check);
  result.measured = measure(store, checks, result.members, order);
  const std::size_t features = store.features().size();
  for (std::size_t i = 0; i < features; ++i) {
    std::vector<double> places, errors;
    for (std::size_t check = 0; check < result.members.size(); ++check) {
      const double error = result.measured[check * features + i];
      if (std::isnan(error)) continue;
      errors.push_back(error);
      const auto place =
          points.subspan(static_cast<std::size_t>(result.members[check]) * parameters, parameters);
      places.insert(places.end(), place.begin(), place.end());
    }
    const ErrorModel& model = result.models.emplace_back(places, parameters, errors);
    FeatureError summary{store.features()[i], store.feature_units()[i], static_cast<int>(errors.size())};
    double squares = 0;
    for (const double error : errors) {
      summary.mean += error / static_cast<double>(errors.size());
      squares += error * error / static_cast<double>(errors.size());
      summary.largest = std::max(summary.largest, std::abs(error));
    }
    summary.rms = std::sqrt(squares);
    if (errors.empty()) summary.mean = summary.rms = summary.largest = NaN;
    summary.left_out_rms = model.left_out_rms();
    summary.left_out_rms_constant = model.left_out_rms_constant();
    summary.model = model.kind();
    result.features.push_back(std::move(summary));
  }
  return result;
}

/// (count, F) of the members from `first` on.
std::vector<float> estimates(const Store& store, const Errors& errors, std::span<const double> points,
                             std::size_t parameters, std::size_t first, std::size_t count) {
  const auto recorded = values<float>(store, Column::features, first, count);
  const auto status = values<Status>(store, Column::status, first, count);
  const std::size_t features = errors.models.size();
  std::vector<float> result(count * features, static_cast<float>(NaN));
  for (std::size_t row = 0; row < count; ++row) {
    if (status[row] != Status::done) continue;
    const std::size_t member = first + row;
    const auto found =
        std::lower_bound(errors.members.begin(), errors.members.end(), static_cast<std::int64_t>(member));
    const bool checked = found != errors.members.end() && *found == static_cast<std::int64_t>(member);
    for (std::size_t i = 0; i < features; ++i) {
      if (std::isnan(recorded[row * features + i])) continue;
      const double measured =
          checked ? errors.measured[static_cast<std::size_t>(found - errors.members.begin()) * features + i]
                  : NaN;
      result[row * features + i] = static_cast<float>(
          std::isnan(measured) ? errors.models[i].at(points.subspan(member * parameters, parameters))
                               : measured);
    }
  }
  return result;
}

std::vector<std::uint8_t> measured_members(const Errors& errors, std::size_t members) {
  std::vector<std::uint8_t> result(members, 0);
  const std::size_t features = errors.models.size();
  for (std::size_t check = 0; check < errors.members.size(); ++check)
    for (std::size_t i = 0; i < features; ++i)
      if (!std::isnan(errors.measured[check * features + i]))
        result[static_cast<std::size_t>(errors.members[check])] = 1;
  return result;
}

std::uint8_t state(const Store& store) {
  return values<std::uint8_t>(store, Column::error_state).front();
}

void write_state(Store& store, std::uint8_t state) {
  store.write_rows_at(Column::error_state, 0, bytes_of(std::vector{state}));
  store.flush();
}

/// Gives every block of bytes of the errors, in the order of `covered`, to `take` (column, first row, bytes).
template <typename Take>
void produce(const Store& store, const Errors& errors, std::span<const double> points, std::size_t parameters,
             Take take) {
  const auto each = [&]<typename T>(Column column, T FeatureError::*number) {
    std::vector<T> numbers;
    for (const auto& feature : errors.features) numbers.push_back(feature.*number);
    take(column, std::size_t{0}, bytes_of(numbers));
  };
  each(Column::error_checks, &FeatureError::checks);
  each(Column::error_mean, &FeatureError::mean);
  each(Column::error_rms, &FeatureError::rms);
  each(Column::error_largest, &FeatureError::largest);
  each(Column::error_left_out, &FeatureError::left_out_rms);
  each(Column::error_left_out_constant, &FeatureError::left_out_rms_constant);
  each(Column::error_model, &FeatureError::model);
  const auto members = static_cast<std::size_t>(store.members());
  take(Column::error_measured, std::size_t{0}, bytes_of(measured_members(errors, members)));
  for (std::size_t first = 0; first < members; first += rows_at_once) {
    const std::size_t count = std::min(rows_at_once, members - first);
    take(Column::error_estimate, first, bytes_of(estimates(store, errors, points, parameters, first, count)));
  }
}

std::uint32_t stored_checksum(const Store& store) {
  std::uint32_t sum = 0;
  for (const auto column : covered)
    for (std::size_t first = 0; first < store.rows(column); first += rows_at_once)
      sum = add_to_checksum(
          sum, store.read_rows(column, first, std::min(rows_at_once, store.rows(column) - first)));
  return sum;
}

/// One process at a time; the lock is the one under which stores are created.
class WritingLock {
 public:
  explicit WritingLock(Claims& claims) : claims_(claims) { claims.begin_creation(); }
  ~WritingLock() { claims_.end_creation(); }
  WritingLock(const WritingLock&) = delete;
  WritingLock& operator=(const WritingLock&) = delete;

 private:
  Claims& claims_;
};

}  // namespace

void write_errors(Store& store, const Schema& schema, Claims& claims) {
  if (!store.has_checks()) return;
  const WritingLock lock(claims);
  const Store checks(store.path(), Store::Access::read, checks_group);
  if (!all_ended(store) || !all_ended(checks)) return;
  const auto points = unit_points(schema.samples, store.members());
  const std::size_t parameters = schema.samples.paths.size();
  const Errors errors = errors_of(store, checks, points, parameters, schema.error_order);
  std::uint32_t sum = 0;
  produce(store, errors, points, parameters,
          [&](Column, std::size_t, std::span<const char> bytes) { sum = add_to_checksum(sum, bytes); });
  if (state(store) == 1 && sum == stored_checksum(store) && errors_are_intact(store)) return;
  write_state(store, 0);
  produce(store, errors, points, parameters,
          [&](Column column, std::size_t first, std::span<const char> bytes) {
            store.write_rows_at(column, first, bytes);
          });
  store.write_rows_at(Column::error_crc32, 0, bytes_of(std::vector{sum}));
  store.flush();
  write_state(store, 1);
}

void forget_errors(Store& store) {
  if (has_errors(store)) write_state(store, 0);
}

bool has_errors(const Store& store) {
  return store.has_checks() && state(store) == 1;
}

bool errors_are_intact(const Store& store) {
  return !has_errors(store) ||
         values<std::uint32_t>(store, Column::error_crc32).front() == stored_checksum(store);
}

std::vector<FeatureError> feature_errors(const Store& store) {
  const auto checks = values<std::int32_t>(store, Column::error_checks);
  const auto mean = values<double>(store, Column::error_mean), rms = values<double>(store, Column::error_rms),
             largest = values<double>(store, Column::error_largest),
             left_out = values<double>(store, Column::error_left_out),
             constant = values<double>(store, Column::error_left_out_constant);
  const auto model = values<ErrorModelKind>(store, Column::error_model);
  std::vector<FeatureError> result;
  for (std::size_t i = 0; i < checks.size(); ++i)
    result.push_back({store.features()[i], store.feature_units()[i], checks[i], mean[i], rms[i], largest[i],
                      left_out[i], constant[i], model[i]});
  return result;
}

std::string error_table(const Store& store) {
  TextTable table({Align::left, Align::left, Align::right, Align::right, Align::right, Align::right,
                   Align::right, Align::left});
  table.add({"error of", "unit", "checks", "mean", "rms", "largest", "left out", "model"});
  const auto number = [](double value) { return std::isnan(value) ? "-" : fmt::format("{:.2g}", value); };
  std::vector<std::string> none;
  for (const FeatureError& error : feature_errors(store)) {
    if (error.largest == 0)
      none.push_back(error.feature);
    else
      table.add({error.feature, error.unit, std::to_string(error.checks), number(error.mean),
                 number(error.rms), number(error.largest), number(error.left_out_rms),
                 error_model_names.at(static_cast<std::size_t>(error.model))});
  }
  return table.text() + (none.empty() ? "" : fmt::format("no error in {}\n", fmt::join(none, ", ")));
}

}  // namespace cohort
