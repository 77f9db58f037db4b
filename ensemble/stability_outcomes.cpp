#include "ensemble/stability_outcomes.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <tuple>

#include "ensemble/study.hpp"
#include "ensemble/table.hpp"
#include "solver/energy_balance.hpp"

namespace cohort {

namespace {

// Of what passes through a chamber of some 100 mL in a beat, the part that the step of the coupling may miss.
constexpr double blood_apart_share = 1e-4;

std::optional<double> feature(const Layout& layout, const StoredRow& row, const std::string& name) {
  const auto at = std::find(layout.features.begin(), layout.features.end(), name);
  if (at == layout.features.end()) return std::nullopt;
  return row.features[static_cast<std::size_t>(at - layout.features.begin())];
}

/// "pressure of LV is nan at sample 12", or nothing.
std::string not_finite(const std::vector<float>& series, const std::vector<std::string>& names,
                       const std::string& what) {
  const auto wild = std::find_if(series.begin(), series.end(), [](float x) { return !std::isfinite(x); });
  if (wild == series.end()) return {};
  const std::size_t place = static_cast<std::size_t>(wild - series.begin()),
                    length = series.size() / names.size();
  return fmt::format("{} of {} is {} at sample {}", what, names[place / length], *wild, place % length);
}

/// What is left over in the balance of energy, over the largest of its terms; nothing without a balance.
std::optional<double> energy_left(const Layout& layout, const StoredRow& row) {
  const auto begin = std::find(layout.features.begin(), layout.features.end(), "active_work_mJ");
  const auto end = std::find(begin, layout.features.end(), "energy_residual");
  if (end == layout.features.end()) return std::nullopt;
  const auto term = row.features.begin() + (begin - layout.features.begin());
  const double residual = row.features[static_cast<std::size_t>(end - layout.features.begin())];
  double most = 0;
  for (auto other = term; other != term + (end - begin); ++other) {
    if (std::isnan(*other)) return *other;
    most = std::max(most, std::abs(static_cast<double>(*other)));
  }
  return *term != 0 ? residual * std::abs(static_cast<double>(*term)) / most : residual;
}

/// NaN says that there is no such feature; an infinite one is a mistake.
std::string infinite_feature(const Layout& layout, const StoredRow& row) {
  for (std::size_t i = 0; i < row.features.size(); ++i)
    if (std::isinf(row.features[i])) return fmt::format("{} is infinite", layout.features[i]);
  return {};
}

std::string empty_chamber(const Layout& layout, const StoredRow& row) {
  const std::size_t samples = layout.pv_ms.size();
  for (std::size_t c = 0; c < layout.compartments.size(); ++c) {
    if (layout.compartments[c] == "aorta" || layout.compartments[c] == "pulmonary_artery") continue;
    const auto first = row.volume.begin() + static_cast<std::ptrdiff_t>(c * samples);
    const float least = *std::min_element(first, first + static_cast<std::ptrdiff_t>(samples));
    if (!(least >= 0))
      return fmt::format("the volume of {} falls to {:.4g} mL", layout.compartments[c], least);
  }
  return {};
}

/// Einthoven's and Goldberger's leads are sums of two.
std::string leads_apart(const Layout& layout, const StoredRow& row) {
  const std::size_t samples = layout.ecg_ms.size();
  if (layout.leads.size() < 6) return {};
  for (std::size_t k = 0; k < samples; ++k) {
    const auto lead = [&](std::size_t l) { return row.ecg[l * samples + k]; };
    const double scale = std::abs(lead(0)) + std::abs(lead(1)) + std::abs(lead(2));
    constexpr double rounding = 1e-5;
    const double loop = lead(0) + lead(2) - lead(1), augmented = lead(3) + lead(4) + lead(5);
    if (std::abs(loop) > rounding * scale || std::abs(augmented) > rounding * scale)
      return fmt::format("the limb leads do not add up at sample {}", k);
  }
  return {};
}

}  // namespace

std::string failed_check(const Layout& layout, const StoredRow& row) {
  if (!std::isfinite(row.dt_ms) || row.dt_ms < 0) return fmt::format("the step is {} ms", row.dt_ms);
  for (const std::string& why :
       {layout.leads.empty() ? std::string() : not_finite(row.ecg, layout.leads, "lead"),
        layout.compartments.empty() ? std::string()
                                    : not_finite(row.pressure, layout.compartments, "pressure"),
        layout.compartments.empty() ? std::string() : not_finite(row.volume, layout.compartments, "volume"),
        layout.points.empty() ? std::string() : not_finite(row.displacement, layout.points, "displacement"),
        infinite_feature(layout, row), empty_chamber(layout, row), leads_apart(layout, row)})
    if (!why.empty()) return why;
  if (const auto least = feature(layout, row, "smallest_volume_ratio"); least && !(*least > 0))
    return fmt::format("a cell was pressed to {:.3g} of its volume", *least);
  if (const auto apart = feature(layout, row, "blood_apart_mL")) {
    const float largest = row.volume.empty() ? 0 : *std::max_element(row.volume.begin(), row.volume.end());
    if (!(*apart <= blood_apart_share * largest))
      return fmt::format("blood and cavity are {:.3g} mL apart, of {:.4g} mL", *apart, largest);
  }
  if (const auto left = energy_left(layout, row); left && !(std::abs(*left) < largest_energy_left))
    return fmt::format("{:.3g} of the energy of the tissue is left over", *left);
  return {};
}

std::vector<StabilityOutcome> stability_outcomes(Store& store, const Layout& layout) {
  std::vector<StabilityOutcome> outcomes;
  const std::vector<Status> statuses = store.statuses();
  for (std::size_t i = 0; i < statuses.size(); ++i) {
    const auto member = static_cast<std::int64_t>(i);
    StabilityOutcome outcome;
    outcome.status = statuses[i];
    outcome.at_ms = std::numeric_limits<double>::quiet_NaN();
    outcome.cause = status_names[static_cast<std::size_t>(outcome.status)];
    if (outcome.status == Status::done) {
      outcome.reason =
          !store.row_is_intact(member)
              ? "the row is not what was written"
              : failed_check(
                    layout,
                    {store.floats(Column::ecg, member), store.floats(Column::pv_pressure, member),
                     store.floats(Column::pv_volume, member), store.floats(Column::displacement, member),
                     store.floats(Column::features, member), store.number(Column::dt_ms, member)});
      if (!outcome.reason.empty()) outcome.cause = "check failed: " + masked(outcome.reason);
    } else if (is_final(outcome.status)) {
      outcome.reason = store.reason(member);
      outcome.at_ms = store.number(Column::failed_at_ms, member);
      outcome.cause += ": " + masked(outcome.reason);
    }
    if (is_final(outcome.status)) store.write_outcome(member, outcome.cause);
    outcomes.push_back(std::move(outcome));
  }
  return outcomes;
}

bool StabilityVerdict::good(double share) const {
  return check_failed + hung + crashed + unnamed == 0 &&
         static_cast<double>(inside_done) >= share * static_cast<double>(inside);
}

std::string StabilityVerdict::text(double share) const {
  return fmt::format(
      "{}: {} members, {} done and right; inside the ranges {} of {} ({:.1f} %, {:g} % asked); checks failed "
      "{}, "
      "hung {}, crashed {}, without a cause {}",
      good(share) ? "holds" : "does not hold", members, done, inside_done, inside,
      inside > 0 ? 100 * static_cast<double>(inside_done) / static_cast<double>(inside) : 100.0, 100 * share,
      check_failed, hung, crashed, unnamed);
}

StabilityVerdict verdict(const std::vector<StabilityResult>& results) {
  StabilityVerdict total;
  for (const StabilityResult& result : results)
    for (std::size_t i = 0; i < result.outcomes.size(); ++i) {
      const StabilityOutcome& outcome = result.outcomes[i];
      const bool inside = result.members.inside[i] != 0;
      ++total.members;
      total.done += outcome.good();
      total.inside += inside;
      total.inside_done += inside && outcome.good();
      total.check_failed += outcome.status == Status::done && !outcome.good();
      total.hung += outcome.status == Status::timeout;
      total.crashed += outcome.status == Status::failed;
      total.unnamed += outcome.status != Status::done && outcome.reason.empty();
    }
  return total;
}

namespace {

/// Members of a case's group that came to one cause, in the order of their first.
struct Line {
  std::string name, group, cause;
  std::size_t count = 0, inside = 0, first = 0;
};

std::vector<Line> lines(const std::vector<StabilityResult>& results, bool by_group) {
  std::vector<Line> all;
  for (const StabilityResult& result : results) {
    const std::size_t begin = all.size();
    for (std::size_t i = 0; i < result.outcomes.size(); ++i) {
      const std::string& group = result.members.groups[i];
      const std::string& cause = result.outcomes[i].cause;
      auto line = std::find_if(
          all.begin() + static_cast<std::ptrdiff_t>(begin), all.end(),
          [&](const Line& known) { return (!by_group || known.group == group) && known.cause == cause; });
      if (line == all.end()) line = all.insert(all.end(), Line{result.name, group, cause, 0, 0, i});
      ++line->count;
      line->inside += result.members.inside[i];
    }
  }
  return all;
}

const StabilityOutcome& first_of(const Line& line, const std::vector<StabilityResult>& results) {
  const auto result =
      std::find_if(results.begin(), results.end(), [&](const auto& r) { return r.name == line.name; });
  return result->outcomes[line.first];
}

std::string time_text(double at_ms) {
  return std::isnan(at_ms) ? "" : fmt::format("{:.1f}", at_ms);
}

std::string table_by_group(const std::vector<StabilityResult>& results) {
  constexpr std::array ends = {"done", "unstable", "rejected", "timeout", "failed", "open", "check failed"};
  std::vector<std::string> order;
  std::map<std::string, std::map<std::string, int>> counts;
  std::map<std::string, int> inside;
  for (const StabilityResult& result : results)
    for (std::size_t i = 0; i < result.outcomes.size(); ++i) {
      const StabilityOutcome& outcome = result.outcomes[i];
      const std::string row = result.name + '\n' + result.members.groups[i];
      if (!counts.contains(row)) order.push_back(row);
      const bool wrong = outcome.status == Status::done && !outcome.good();
      ++counts[row][wrong                      ? "check failed"
                    : is_final(outcome.status) ? status_names[static_cast<std::size_t>(outcome.status)]
                                               : "open"];
      inside[row] += result.members.inside[i];
    }
  std::vector<Align> alignment(4 + ends.size(), Align::right);
  alignment[0] = alignment[1] = Align::left;
  TextTable table(alignment);
  std::vector<std::string> header = {"case", "group", "members", "inside"};
  header.insert(header.end(), ends.begin(), ends.end());
  table.add(header);
  for (const std::string& row : order) {
    int members = 0;
    for (const auto& [end, count] : counts[row]) members += count;
    const std::size_t split = row.find('\n');
    std::vector<std::string> cells = {row.substr(0, split), row.substr(split + 1), fmt::format("{}", members),
                                      fmt::format("{}", inside[row])};
    for (const char* end : ends)
      cells.push_back(counts[row].contains(end) ? fmt::format("{}", counts[row][end]) : "-");
    table.add(cells);
  }
  return table.text();
}

}  // namespace

std::string stability_report(const std::vector<StabilityResult>& results) {
  TextTable causes({Align::left, Align::right, Align::right, Align::right, Align::right, Align::left});
  causes.add({"case", "members", "inside", "first", "at ms", "outcome, of the first with its numbers"});
  for (const Line& line : lines(results, false)) {
    const StabilityOutcome& first = first_of(line, results);
    const std::string kind = line.cause.substr(0, line.cause.find(':'));
    causes.add({line.name, fmt::format("{}", line.count), fmt::format("{}", line.inside),
                fmt::format("{}", line.first), time_text(first.at_ms),
                first.reason.empty() ? kind : kind + ": " + first.reason});
  }
  return table_by_group(results) + '\n' + causes.text();
}

std::string stability_csv(const std::vector<StabilityResult>& results) {
  std::string text = "case,group,outcome,members,inside,first_member,at_ms,reason_of_first\n";
  for (const Line& line : lines(results, true)) {
    const StabilityOutcome& first = first_of(line, results);
    text += fmt::format("{},{},{},{},{},{},{},{}\n", line.name, line.group, csv_cell(line.cause), line.count,
                        line.inside, line.first, time_text(first.at_ms), csv_cell(first.reason));
  }
  return text;
}

}  // namespace cohort
