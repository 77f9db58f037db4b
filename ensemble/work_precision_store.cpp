#include "ensemble/work_precision_store.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "ensemble/hdf5.hpp"
#include "ensemble/table.hpp"

namespace cohort {

namespace {

std::string text_of(const Setting& setting) {
  return fmt::format("{}", fmt::join(setting.overrides(), "; "));
}

std::pair<double, double> range_of(const std::vector<double>& values) {
  if (values.empty())
    return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return {*low, *high};
}

/// As a field of a CSV file.
std::string field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted.append(c == '"' ? 2 : 1, c);
  return quoted + '"';
}

double median_wall_s(const SettingRun& run) {
  SettingRun other;
  other.device_s = run.wall_s;
  return other.median_device_s();
}

std::string measure_table(const WorkPrecision& result, std::size_t m) {
  const std::vector<double> time = result.times(), error = result.rms(m);
  const std::vector<bool> front = pareto_front(time, error);
  std::vector<std::size_t> order(time.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return time[a] < time[b]; });
  TextTable table(
      {Align::left, Align::right, Align::right, Align::right, Align::right, Align::right, Align::left});
  const MeasureErrors& measure = result.errors[m];
  table.add({fmt::format("{} ({})", measure.name, measure.unit), "error rms", "largest", "device s", "noise",
             "of roof", ""});
  for (const std::size_t i : order) {
    const SettingRun& run = result.runs[i];
    const Setting& setting = result.design.settings[i];
    if (!run.outcome.empty()) {
      table.add({setting.label, "-", "-", "-", "-", "-", run.outcome});
      continue;
    }
    const auto [low, high] = range_of(run.device_s);
    table.add({setting.label, fmt::format("{:.3g}", error[i]), fmt::format("{:.3g}", measure.largest(i)),
               fmt::format("{:.4g}", time[i]), fmt::format("{:.0f} %", 100 * (high - low) / time[i]),
               fmt::format("{:.0f} %", 100 * run.roof_s / time[i]),
               fmt::format("{}{}", front[i] ? "front" : "",
                           setting.is_default ? (front[i] ? ", default" : "default") : "")});
  }
  std::string text = table.text();
  const std::size_t own = result.default_setting();
  if (own < result.runs.size() && result.runs[own].outcome.empty())
    text += fmt::format("the default is {:.2f} from the front\n", distance_to_front(time, error, own));
  return text;
}

/// A column of text, then one of numbers for each measure.
TextTable table_of_measures(const WorkPrecision& result, const std::string& head) {
  std::vector<Align> alignment(result.errors.size() + 1, Align::right);
  alignment[0] = Align::left;
  std::vector<std::string> first = {head};
  for (const MeasureErrors& measure : result.errors) first.push_back(measure.name);
  TextTable table(std::move(alignment));
  table.add(std::move(first));
  return table;
}

/// Orders come pair by pair, each with all measures.
std::string order_table(const WorkPrecision& result) {
  TextTable table = table_of_measures(result, "observed order");
  const std::size_t measures = result.errors.size();
  for (std::size_t k = 0; k < result.orders.size(); k += measures) {
    const ObservedOrder& pair = result.orders[k];
    std::vector<std::string> row = {
        fmt::format("{}, {} to {}", result.design.settings[pair.coarse].label, pair.path, pair.fine_h)};
    for (std::size_t m = 0; m < measures; ++m) {
      const double order = result.orders[k + m].order;
      row.push_back(std::isnan(order) ? "-" : fmt::format("{:.2f}", order));
    }
    table.add(std::move(row));
  }
  return table.text();
}

std::string rounding_table(const WorkPrecision& result) {
  TextTable table = table_of_measures(result, "rounding of single, of the error");
  const std::size_t measures = result.errors.size();
  for (std::size_t k = 0; k < result.rounding.size(); k += measures) {
    std::vector<std::string> row = {result.design.settings[result.rounding[k].single].label};
    for (std::size_t m = 0; m < measures; ++m)
      row.push_back(fmt::format("{:.2g} %", 100 * result.rounding[k + m].share));
    table.add(std::move(row));
  }
  return table.text();
}

}  // namespace

std::vector<double> WorkPrecision::times() const {
  std::vector<double> result;
  for (const SettingRun& run : runs) result.push_back(run.median_device_s());
  return result;
}

std::vector<double> WorkPrecision::rms(std::size_t measure) const {
  std::vector<double> result;
  for (std::size_t i = 0; i < runs.size(); ++i) result.push_back(errors[measure].rms(i));
  return result;
}

std::size_t WorkPrecision::default_setting() const {
  const auto it = std::find_if(design.settings.begin(), design.settings.end(),
                               [](const Setting& setting) { return setting.is_default; });
  return static_cast<std::size_t>(it - design.settings.begin());
}

namespace {

void write_scene(hid_t group, const WorkPrecision& result) {
  const std::size_t rows = result.runs.size(), measures = result.errors.size();
  const auto repeats = static_cast<std::size_t>(result.design.repeats);
  constexpr double nothing = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::string> labels, sets, outcomes, names, units;
  std::vector<double> own, roof, device, wall, rms, largest, front, member_errors, references;
  for (std::size_t i = 0; i < rows; ++i) {
    const SettingRun& run = result.runs[i];
    labels.push_back(result.design.settings[i].label);
    sets.push_back(text_of(result.design.settings[i]));
    outcomes.push_back(run.outcome);
    own.push_back(result.design.settings[i].is_default ? 1 : 0);
    roof.push_back(run.roof_s);
    for (std::size_t k = 0; k < repeats; ++k) {
      device.push_back(k < run.device_s.size() ? run.device_s[k] : nothing);
      wall.push_back(k < run.wall_s.size() ? run.wall_s[k] : nothing);
    }
  }
  const std::vector<double> times = result.times();
  std::size_t members = 0;
  for (std::size_t m = 0; m < measures; ++m) {
    names.push_back(result.errors[m].name);
    units.push_back(result.errors[m].unit);
    const std::vector<double> errors = result.rms(m);
    rms.insert(rms.end(), errors.begin(), errors.end());
    for (const bool on : pareto_front(times, errors)) front.push_back(on ? 1 : 0);
    for (std::size_t i = 0; i < rows; ++i) {
      largest.push_back(result.errors[m].largest(i));
      members = result.errors[m].of[i].size();
      member_errors.insert(member_errors.end(), result.errors[m].of[i].begin(), result.errors[m].of[i].end());
    }
    references.insert(references.end(), result.errors[m].reference.begin(), result.errors[m].reference.end());
  }
  hdf5::write_attribute(group, "scene", result.scene);
  hdf5::write_texts(group, "settings/label", labels);
  hdf5::write_texts(group, "settings/set", sets);
  hdf5::write_texts(group, "settings/outcome", outcomes);
  hdf5::write_numbers(group, "settings/default", {rows}, own);
  hdf5::write_numbers(group, "settings/device_s", {rows, repeats}, device);
  hdf5::write_numbers(group, "settings/wall_s", {rows, repeats}, wall);
  hdf5::write_numbers(group, "settings/roof_s", {rows}, roof);
  hdf5::write_texts(group, "measures/name", names);
  hdf5::write_texts(group, "measures/unit", units);
  hdf5::write_numbers(group, "measures/rms", {measures, rows}, rms);
  hdf5::write_numbers(group, "measures/largest", {measures, rows}, largest);
  hdf5::write_numbers(group, "measures/front", {measures, rows}, front);
  hdf5::write_numbers(group, "measures/error", {measures, rows, members}, member_errors);
  hdf5::write_numbers(group, "measures/reference", {measures, members}, references);
}

}  // namespace

void write_study(const std::string& path, const Study& study, const std::vector<WorkPrecision>& scenes) {
  const WorkPrecision& result = scenes.front();
  const hdf5::Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose, path);
  hdf5::write_attribute(file, "kind", std::string("work_precision"));
  hdf5::write_attribute(file, "study", flow_text(study.root));
  hdf5::write_attribute(file, "base", study.base_text);
  hdf5::write_attribute(file, "reference",
                        result.design.reference ? text_of(*result.design.reference) : std::string("values"));
  hdf5::write_attribute(file, "program", std::string(COHORT_VERSION));
  hdf5::write_attribute(file, "device", result.device);
  hdf5::write_attribute(file, "triad_GB_per_s", result.triad_GB_per_s);
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    const std::string name = fmt::format("{:03d}", k);
    const hdf5::Handle group(H5Gcreate2(file, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose,
                             path);
    write_scene(group, scenes[k]);
  }
}

namespace {

std::string scene_csv(const WorkPrecision& result) {
  std::string text;
  const std::vector<double> times = result.times();
  for (std::size_t m = 0; m < result.errors.size(); ++m) {
    const std::vector<double> errors = result.rms(m);
    const std::vector<bool> front = pareto_front(times, errors);
    for (std::size_t i = 0; i < result.runs.size(); ++i) {
      const SettingRun& run = result.runs[i];
      const Setting& setting = result.design.settings[i];
      const auto [low, high] = range_of(run.device_s);
      text += fmt::format("{},{},{},{:d},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:d},{}\n",
                          field(result.scene), field(setting.label), field(text_of(setting)),
                          setting.is_default, result.errors[m].name, result.errors[m].unit, errors[i],
                          result.errors[m].largest(i), times[i], low, high, median_wall_s(run), run.roof_s,
                          front[i] ? 1 : 0, field(run.outcome));
    }
  }
  return text;
}

}  // namespace

std::string study_csv(const std::vector<WorkPrecision>& scenes) {
  std::string text =
      "scene,setting,set,default,measure,unit,error_rms,error_largest,device_s,device_s_least,device_s_most,"
      "wall_s,roof_s,front,outcome\n";
  for (const WorkPrecision& scene : scenes) text += scene_csv(scene);
  return text;
}

std::string study_report(const WorkPrecision& result) {
  std::string text =
      fmt::format("{}{}, triad {:.1f} GB/s; seconds are the device's, for one member\n\n",
                  result.scene.empty() ? "" : result.scene + " on ", result.device, result.triad_GB_per_s);
  for (std::size_t m = 0; m < result.errors.size(); ++m) text += measure_table(result, m) + "\n";
  if (!result.orders.empty()) text += order_table(result) + "\n";
  if (!result.rounding.empty()) text += rounding_table(result) + "\n";
  return text;
}

}  // namespace cohort
