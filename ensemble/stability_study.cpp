#include "ensemble/stability_study.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <filesystem>

#include "ensemble/draw.hpp"
#include "ensemble/guarded.hpp"
#include "ensemble/ranks.hpp"
#include "ensemble/stability_design.hpp"
#include "ensemble/stability_outcomes.hpp"
#include "ensemble/study.hpp"
#include "ensemble/study_files.hpp"

namespace cohort {

namespace {

/// NAME.h5 of the study's own scene, NAME.CASE.h5 of a case.
std::string store_of(const std::string& store, const std::string& name) {
  const std::filesystem::path path(store);
  if (name.empty()) return store;
  return path.parent_path() / fmt::format("{}.{}{}", path.stem().string(), name, path.extension().string());
}

StabilityResult read_result(const StabilityCase& one) {
  Store store(one.campaign.store, Store::Access::write);
  return {one.name.empty() ? std::filesystem::path(one.campaign.store).stem().string() : one.name,
          one.campaign.study, stability_outcomes(store, layout(one.campaign.scene))};
}

/// Tells of all cases; of rank 0.
StabilityVerdict conclude(const StabilityStudy& study, const std::string& store) {
  std::vector<StabilityResult> results;
  std::vector<std::string> stores;
  for (const StabilityCase& one : study.cases) {
    results.push_back(read_result(one));
    stores.push_back(one.campaign.store);
  }
  const StabilityVerdict total = verdict(results);
  const auto stem = std::filesystem::path(store).replace_extension();
  fmt::print("\n{}\n{}\n", stability_report(results), total.text(study.inside_done));
  write_file(stem.string() + ".csv", stability_csv(results));
  std::fflush(stdout);
  stores.insert(stores.end(), {"-o", stem.string() + ".png"});
  const bool drawn = draw("stability", stores);
  spdlog::info("{0}.csv{1}", stem.string(), drawn ? fmt::format(", {}.png", stem.string()) : "");
  return total;
}

}  // namespace

ExitCode run_stability(Study& study, const CampaignOptions& options) {
  check_stability_files(study);
  StabilityStudy cases = read_stability(study);
  for (StabilityCase& one : cases.cases) {
    use_design(stability_design(one, cases.seed), cases.seed, one.campaign);
    one.campaign.store = store_of(study.store, one.name);
  }
  const Ranks ranks;
  share_cores(ranks.local());
  for (const StabilityCase& one : cases.cases) {
    if (ranks.first()) spdlog::info("{}: {} members", one.campaign.store, one.campaign.members);
    if (const ExitCode end = run_campaign(ranks, one.campaign, options.device);
        end != ExitCode::done && end != ExitCode::failed)
      return end;
  }
  return guarded(ExitCode::interrupted, [&] {
    bool good = true;
    ranks.agree([&] {
      if (ranks.first()) good = conclude(cases, study.store).good(cases.inside_done);
    });
    return ranks.all(good) ? ExitCode::done : ExitCode::failed;
  });
}

}  // namespace cohort
