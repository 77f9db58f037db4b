#include "solver/pv_features.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "solver/loop_lobes.hpp"

namespace cohort {

namespace {

constexpr double undefined = std::numeric_limits<double>::quiet_NaN();
constexpr double millijoule_per_mmHg_mL = 0.133322;
constexpr double closes_within = 0.02;  // of a series' range: then its end goes on as its beginning

using Series = std::vector<double>;

std::string lower_case(std::string text) {
  for (char& letter : text)
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
  return text;
}

std::string artery_of(const std::string& ventricle) {
  return ventricle == "LV" ? "aorta" : ventricle == "RV" ? "pulmonary_artery" : "";
}

std::string atrium_of(const std::string& ventricle) {
  return ventricle == "LV" ? "LA" : ventricle == "RV" ? "RA" : "";
}

int index_of(std::span<const std::string> names, const std::string& name) {
  const auto it = std::find(names.begin(), names.end(), name);
  return it == names.end() ? -1 : static_cast<int>(it - names.begin());
}

enum class Part { ventricle, atrium, artery, cavity };

Part part(std::span<const std::string> compartments, const std::string& name) {
  if (const std::string artery = artery_of(name); !artery.empty() && index_of(compartments, artery) >= 0)
    return Part::ventricle;
  if (name == "LA" || name == "RA") return Part::atrium;
  if (name == "aorta" || name == "pulmonary_artery") return Part::artery;
  return Part::cavity;
}

using Names = std::vector<std::pair<const char*, const char*>>;

const Names& names_of(Part part) {
  static const Names ventricle = {{"edv_mL", "mL"},
                                  {"esv_mL", "mL"},
                                  {"sv_mL", "mL"},
                                  {"ef_percent", "%"},
                                  {"peak_mmHg", "mmHg"},
                                  {"edp_mmHg", "mmHg"},
                                  {"dpdt_max_mmHg_per_s", "mmHg/s"},
                                  {"dpdt_min_mmHg_per_s", "mmHg/s"},
                                  {"isovolumic_contraction_ms", "ms"},
                                  {"ejection_ms", "ms"},
                                  {"isovolumic_relaxation_ms", "ms"},
                                  {"filling_ms", "ms"},
                                  {"stroke_work_mJ", "mJ"}};
  static const Names atrium = {{"volume_max_mL", "mL"},  {"volume_min_mL", "mL"},
                               {"mean_mmHg", "mmHg"},    {"lobes_counterclockwise", "1"},
                               {"lobes_clockwise", "1"}, {"figure_of_eight", "1"}};
  static const Names artery = {{"systolic_mmHg", "mmHg"}, {"diastolic_mmHg", "mmHg"}, {"mean_mmHg", "mmHg"}};
  static const Names cavity = {{"pressure_max_mmHg", "mmHg"},
                               {"pressure_min_mmHg", "mmHg"},
                               {"volume_max_mL", "mL"},
                               {"volume_min_mL", "mL"}};
  switch (part) {
    case Part::ventricle:
      return ventricle;
    case Part::atrium:
      return atrium;
    case Part::artery:
      return artery;
    default:
      return cavity;
  }
}

/// One beat: samples at 0, interval, ... and the next beat's first at `length`.
struct Beat {
  double interval, length;
  std::size_t samples;
  double gap() const { return length - static_cast<double>(samples - 1) * interval; }
};

double largest(const Series& series) {
  return *std::max_element(series.begin(), series.end());
}
double smallest(const Series& series) {
  return *std::min_element(series.begin(), series.end());
}

/// Time average, by trapezia around the beat.
double mean(const Series& series, const Beat& beat) {
  const double sum = std::accumulate(series.begin(), series.end(), 0.0);
  const double ends = (series.front() + series.back()) / 2;
  return (sum * beat.interval + ends * (beat.gap() - beat.interval)) / beat.length;
}

/// Whether the series goes on from its end to its beginning: extrapolated from either side, or as it stands.
bool closes(const Series& x, const Beat& beat) {
  const std::size_t n = x.size();
  const double ahead = beat.gap() / beat.interval;
  const double error =
      std::min({std::abs(x[n - 1] - x[0]), std::abs(x[n - 1] + ahead * (x[n - 1] - x[n - 2]) - x[0]),
                std::abs(x[n - 1] - (x[0] - ahead * (x[1] - x[0])))});
  return error <= closes_within * (largest(x) - smallest(x));
}

/// Central differences; one-sided at the ends, so that nothing is taken across the beat's end.
Series derivative(const Series& x, double interval) {
  const std::size_t n = x.size();
  Series result(n);
  for (std::size_t i = 1; i + 1 < n; ++i) result[i] = (x[i + 1] - x[i - 1]) / (2 * interval);
  result[0] = (x[1] - x[0]) / interval;
  result[n - 1] = (x[n - 1] - x[n - 2]) / interval;
  return result;
}

/// Reads series of a beat at sample numbers that may lie before or behind it.
class Cycle {
 public:
  explicit Cycle(const Beat& beat) : beat_(beat), n_(static_cast<int>(beat.samples)) {}

  double value(const Series& x, int i) const { return x[static_cast<std::size_t>(wrapped(i))]; }
  double time(int i) const {
    const int turns = (i - wrapped(i)) / n_;
    return turns * beat_.length + wrapped(i) * beat_.interval;
  }
  /// Where the line from sample i to the next crosses zero, ms.
  double crossing(const Series& x, int i) const {
    const double a = value(x, i), b = value(x, i + 1);
    return time(i) + a / (a - b) * (time(i + 1) - time(i));
  }
  double at(const Series& x, int i, double time_ms) const {
    const double share = (time_ms - time(i)) / (time(i + 1) - time(i));
    return value(x, i) + share * (value(x, i + 1) - value(x, i));
  }

 private:
  int wrapped(int i) const { return (i % n_ + n_) % n_; }

  Beat beat_;
  int n_;
};

/// Samples between which a valve opens and closes: it is open from `opening` + 1 to `closing`.
struct Open {
  int opening, closing;
};

/// The stretch of positive gradient with the largest integral. Over the beat's end where it closes.
std::optional<Open> ejection(const Series& gradient, bool closed) {
  const auto n = static_cast<int>(gradient.size());
  const auto positive = [&](int i) { return gradient[static_cast<std::size_t>((i % n + n) % n)] > 0; };
  std::optional<Open> best;
  double most = 0;
  for (int i = 0; i < n; ++i) {
    const bool opens = !positive(i) && positive(i + 1);
    if (!opens || (!closed && i == n - 1)) continue;
    double integral = 0;
    int k = i + 1;
    while (positive(k)) integral += gradient[static_cast<std::size_t>(k++ % n)];
    if (!closed && k > n - 1) continue;  // the end is not within the series
    if (integral <= most) continue;
    most = integral;
    best = {i, k - 1};
  }
  return best;
}

struct Phases {
  double edv = undefined, esv = undefined, edp = undefined;
  double contraction = undefined, ejection = undefined, relaxation = undefined, filling = undefined;
};

/// inlet: pressure in front of the atrioventricular valve; empty where it is not known.
Phases phases_of(const Series& pressure, const Series& volume, const Series& inlet, const Series& outlet,
                 const Beat& beat) {
  const auto n = static_cast<int>(beat.samples);
  const Cycle cycle(beat);
  Series out(beat.samples), in(inlet.size());
  std::transform(pressure.begin(), pressure.end(), outlet.begin(), out.begin(), std::minus<>());
  std::transform(inlet.begin(), inlet.end(), pressure.begin(), in.begin(), std::minus<>());
  const bool closed = closes(pressure, beat) && closes(volume, beat) && closes(outlet, beat) &&
                      (inlet.empty() || closes(inlet, beat));
  const auto open = ejection(out, closed);
  if (!open) return {};
  Phases phases;
  const double begins = cycle.crossing(out, open->opening), ends = cycle.crossing(out, open->closing);
  phases.ejection = ends - begins;

  // The inlet closes between `shuts` and the next sample, and opens between `opens` and the next.
  std::optional<int> shuts, opens;
  const auto positive = [&](int i) { return cycle.value(in, i) > 0; };
  if (!in.empty()) {
    for (int i = open->opening; !shuts && i > open->closing - n && (closed || i >= 0); --i)
      if (positive(i)) shuts = i;
    for (int i = open->closing; !opens && i < open->opening + n && (closed || i + 1 < n); ++i)
      if (positive(i + 1)) opens = i;
  }
  // Of a ventricle whose two valves are open at once neither phase is told.
  if (shuts && !positive(*shuts + 1)) {
    const double time = cycle.crossing(in, *shuts);
    if (time <= begins) {
      phases.contraction = begins - time;
      phases.edp = cycle.at(pressure, *shuts, time);
    }
  }
  if (opens && !positive(*opens)) {
    const double time = cycle.crossing(in, *opens);
    if (time >= ends) phases.relaxation = time - ends;
  }
  phases.filling = beat.length - phases.contraction - phases.ejection - phases.relaxation;

  // Of two fillings in the series the one before the ejection counts: over the beat's end only where the
  // inlet has closed before its beginning.
  const bool before = closed && !(shuts && *shuts >= 0);
  phases.edv = cycle.value(volume, open->opening);
  for (int i = open->opening; i >= (before ? open->closing - n : 0); --i)
    phases.edv = std::max(phases.edv, cycle.value(volume, i));
  phases.esv = cycle.value(volume, open->closing);
  for (int i = open->opening; i <= (closed ? open->opening + n : n - 1); ++i)
    phases.esv = std::min(phases.esv, cycle.value(volume, i));
  return phases;
}

/// Work of a closed loop, by trapezia: positive where the volume falls at high pressure.
double loop_work_mJ(const Series& pressure, const Series& volume, const Beat& beat) {
  if (!closes(pressure, beat) || !closes(volume, beat)) return undefined;
  double work = 0;
  for (std::size_t i = 0; i < volume.size(); ++i) {
    const std::size_t next = (i + 1) % volume.size();
    work -= (pressure[i] + pressure[next]) / 2 * (volume[next] - volume[i]);
  }
  return work * millijoule_per_mmHg_mL;
}

class Measurement {
 public:
  explicit Measurement(const PvSeries& series) : series_(series) {
    const std::size_t all =
        series.compartments.empty() ? 0 : series.pressure.size() / series.compartments.size();
    const bool beats = !std::isnan(series.beat_ms);
    beat_.interval = series.interval_ms;
    beat_.samples = all;
    if (beats) {
      constexpr double rounding = 1e-6;
      beat_.samples = static_cast<std::size_t>(std::ceil(series.beat_ms / series.interval_ms - rounding));
    }
    const std::size_t fewest = beats ? 3 : 1;  // an equilibrium has one sample
    if (beat_.samples > all || beat_.samples < fewest) return;
    beat_.length = beats ? series.beat_ms : static_cast<double>(all) * series.interval_ms;
    for (std::size_t c = 0; c < series.compartments.size(); ++c) {
      const auto last_beat = [&](std::span<const float> values) {
        const auto end = values.begin() + static_cast<std::ptrdiff_t>((c + 1) * all);
        return Series(end - static_cast<std::ptrdiff_t>(beat_.samples), end);
      };
      pressure_.push_back(last_beat(series.pressure));
      volume_.push_back(last_beat(series.volume));
    }
    whole_ = true;
  }

  std::vector<float> features() const {
    std::vector<float> result;
    double output = undefined;
    for (std::size_t c = 0; c < series_.compartments.size(); ++c) {
      const Part kind = part(series_.compartments, series_.compartments[c]);
      const std::size_t count = names_of(kind).size();
      std::vector<double> values;
      if (whole_ && are_numbers(c)) values = measured(kind, c);
      values.resize(count, undefined);
      for (const double value : values) result.push_back(static_cast<float>(value));
      constexpr std::size_t stroke_volume = 2;
      constexpr double L_per_min = 60;  // 1 mL/ms
      if (kind == Part::ventricle && series_.compartments[c] == "LV")
        output = values[stroke_volume] / series_.beat_ms * L_per_min;
    }
    if (has_output(series_.compartments)) result.push_back(static_cast<float>(output));
    return result;
  }

  static bool has_output(std::span<const std::string> compartments) {
    return index_of(compartments, "LV") >= 0 && part(compartments, "LV") == Part::ventricle;
  }

 private:
  bool are_numbers(std::size_t c) const {
    const auto finite = [](double value) { return std::isfinite(value); };
    return std::all_of(pressure_[c].begin(), pressure_[c].end(), finite) &&
           std::all_of(volume_[c].begin(), volume_[c].end(), finite);
  }

  std::vector<double> measured(Part kind, std::size_t c) const {
    const Series &p = pressure_[c], &v = volume_[c];
    switch (kind) {
      case Part::ventricle:
        return ventricle(c);
      case Part::atrium: {
        std::vector<double> values = {largest(v), smallest(v), mean(p, beat_)};
        if (!closes(p, beat_) || !closes(v, beat_)) return values;
        const LoopLobes lobes = loop_lobes(v, p);
        for (const int number : {lobes.counterclockwise, lobes.clockwise, lobes.figure_of_eight() ? 1 : 0})
          values.push_back(number);
        return values;
      }
      case Part::artery:
        return {largest(p), smallest(p), mean(p, beat_)};
      default:
        return {largest(p), smallest(p), largest(v), smallest(v)};
    }
  }

  std::vector<double> ventricle(std::size_t c) const {
    const std::string& name = series_.compartments[c];
    const Series &p = pressure_[c], &v = volume_[c];
    const auto artery = static_cast<std::size_t>(index_of(series_.compartments, artery_of(name)));
    const int atrium = index_of(series_.compartments, atrium_of(name));
    Series inlet;
    if (atrium >= 0 && are_numbers(static_cast<std::size_t>(atrium)))
      inlet = pressure_[static_cast<std::size_t>(atrium)];
    else if (atrium < 0 && !std::isnan(series_.filling_mmHg))
      inlet.assign(p.size(), series_.filling_mmHg);
    Phases phases;
    if (are_numbers(artery)) phases = phases_of(p, v, inlet, pressure_[artery], beat_);
    constexpr double per_s = 1000, percent = 100;
    const Series slope = derivative(p, beat_.interval);
    const bool beats = !std::isnan(series_.beat_ms);
    return {phases.edv,
            phases.esv,
            phases.edv - phases.esv,
            percent * (phases.edv - phases.esv) / phases.edv,
            largest(p),
            phases.edp,
            per_s * largest(slope),
            per_s * smallest(slope),
            phases.contraction,
            phases.ejection,
            phases.relaxation,
            beats ? phases.filling : undefined,
            loop_work_mJ(p, v, beat_)};
  }

  const PvSeries& series_;
  Beat beat_{};
  bool whole_ = false;
  std::vector<Series> pressure_, volume_;  // of the beat, by compartment
};

}  // namespace

std::vector<std::pair<std::string, std::string>> pv_feature_names(std::span<const std::string> compartments) {
  std::vector<std::pair<std::string, std::string>> names;
  for (const std::string& compartment : compartments)
    for (const auto& [name, unit] : names_of(part(compartments, compartment)))
      names.emplace_back(lower_case(compartment) + "_" + name, unit);
  if (Measurement::has_output(compartments)) names.emplace_back("cardiac_output_L_per_min", "L/min");
  return names;
}

std::vector<float> pv_features(const PvSeries& series) {
  return Measurement(series).features();
}

}  // namespace cohort
