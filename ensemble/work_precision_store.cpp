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

std::string told(const FrontDistance& distance) {
  constexpr double shown = 1.005;  // as two digits tell it
  if (std::isnan(distance.factor))
    return "the default has no error here: of some member there is no such value\n";
  if (distance.factor < shown) return "the default is on the front\n";
  return fmt::format(
      "the default is {:.2f} from the front: {:.2f} times as slow as the fastest of no larger "
      "error; {:.2f} times the error of the best in no more time\n",
      distance.factor, distance.slower, distance.worse);
}

std::string measure_table(const WorkPrecision& result, std::size_t m) {
  const std::vector<Seconds> time = result.times();
  const std::vector<double> error = result.rms(m);
  const std::vector<FrontDistance> distances = result.distances(m);
  std::vector<std::size_t> order(time.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return time[a].median < time[b].median; });
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
    const auto [median, low, high] = time[i];
    const bool front = distances[i].factor == 1;
    table.add({setting.label, fmt::format("{:.3g}", error[i]), fmt::format("{:.3g}", measure.largest(i)),
               fmt::format("{:.4g}", median), fmt::format("{:.0f} %", 100 * (high - low) / median),
               fmt::format("{:.0f} %", 100 * run.roof_s / median),
               fmt::format("{}{}", front ? "front" : "",
                           setting.is_default ? (front ? ", default" : "default") : "")});
  }
  std::string text = table.text();
  const std::size_t own = result.default_setting();
  if (own < result.runs.size() && result.runs[own].outcome.empty()) text += told(distances[own]);
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
    const bool several = pair.path.find(',') != std::string::npos;
    std::vector<std::string> row = {fmt::format("{}, {} {} {:g}", result.design.settings[pair.coarse].label,
                                                pair.path, several ? "by" : "to",
                                                several ? pair.coarse_h / pair.fine_h : pair.fine_h)};
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

std::vector<Seconds> WorkPrecision::times() const {
  std::vector<Seconds> result;
  for (const SettingRun& run : runs) {
    const double middle = run.median_device_s();
    if (run.device_s.empty()) {
      result.push_back({middle, middle, middle});
      continue;
    }
    const auto [least, most] = std::minmax_element(run.device_s.begin(), run.device_s.end());
    result.push_back({middle, *least, *most});
  }
  return result;
}

std::vector<FrontDistance> WorkPrecision::distances(std::size_t measure) const {
  const std::vector<Seconds> time = times();
  const std::vector<double> error = rms(measure);
  std::vector<FrontDistance> result;
  for (std::size_t i = 0; i < runs.size(); ++i) result.push_back(distance_to_front(time, error, i));
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
  std::vector<double> own, roof, device, wall, rms, largest, member_errors, references;
  std::vector<double> front, distance, slower, worse;
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
  std::size_t members = 0;
  for (std::size_t m = 0; m < measures; ++m) {
    names.push_back(result.errors[m].name);
    units.push_back(result.errors[m].unit);
    const std::vector<double> errors = result.rms(m);
    rms.insert(rms.end(), errors.begin(), errors.end());
    for (const FrontDistance& own_distance : result.distances(m)) {
      front.push_back(own_distance.factor == 1 ? 1 : 0);
      distance.push_back(own_distance.factor);
      slower.push_back(own_distance.slower);
      worse.push_back(own_distance.worse);
    }
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
  hdf5::write_numbers(group, "measures/distance", {measures, rows}, distance);
  hdf5::write_numbers(group, "measures/times_as_slow", {measures, rows}, slower);
  hdf5::write_numbers(group, "measures/times_the_error", {measures, rows}, worse);
  hdf5::write_numbers(group, "measures/error", {measures, rows, members}, member_errors);
  hdf5::write_numbers(group, "measures/reference", {measures, members}, references);
}

}  // namespace

void write_study(const std::string& path, const Study& study, const std::vector<WorkPrecision>& scenes) {
  const WorkPrecision& result = scenes.front();
  const hdf5::Handle file = hdf5::file_in_memory();
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
  write_file(path, hdf5::image(file));
}

namespace {

std::string scene_csv(const WorkPrecision& result) {
  std::string text;
  const std::vector<Seconds> times = result.times();
  for (std::size_t m = 0; m < result.errors.size(); ++m) {
    const MeasureErrors& measure = result.errors[m];
    const std::vector<double> errors = result.rms(m);
    const std::vector<FrontDistance> distances = result.distances(m);
    for (std::size_t i = 0; i < result.runs.size(); ++i) {
      const SettingRun& run = result.runs[i];
      const Setting& setting = result.design.settings[i];
      const FrontDistance& distance = distances[i];
      text += fmt::format("{},{},{},{:d},{},{},", csv_cell(result.scene), csv_cell(setting.label),
                          csv_cell(text_of(setting)), setting.is_default, measure.name, measure.unit);
      text += fmt::format("{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},", errors[i], measure.largest(i),
                          times[i].median, times[i].least, times[i].most, median(run.wall_s), run.roof_s);
      text += fmt::format("{:d},{:.6g},{:.6g},{:.6g},{}\n", distance.factor == 1, distance.factor,
                          distance.slower, distance.worse, csv_cell(run.outcome));
    }
  }
  return text;
}

}  // namespace

std::string study_csv(const std::vector<WorkPrecision>& scenes) {
  std::string text =
      "scene,setting,set,default,measure,unit,error_rms,error_largest,device_s,device_s_least,device_s_most,"
      "wall_s,roof_s,front,distance,times_as_slow,times_the_error,outcome\n";
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
