#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "ensemble/feature_names.hpp"
#include "ensemble/members.hpp"
#include "ensemble/work_precision_design.hpp"
#include "ensemble/work_precision_runs.hpp"

namespace cohort {

namespace {

/// A campaign by its results and by how it runs.
std::string name_of(const Campaign& campaign) {
  return fmt::format("{} {} {}\n", campaign.sha256, campaign.members_per_device, campaign.memory_limit_GB);
}

/// Where a setting says something of members; else where it begins.
Place members_place(const Study& study, const Setting& setting) {
  for (std::size_t k = 0; k < setting.places.size(); ++k)
    for (const char* section : {"campaign", "parameters"})
      if (setting.values[k].first.starts_with(section)) return setting.places[k];
  return setting.places.empty() ? study.root.place : setting.places.front();
}

/// Every campaign that a study runs in one scene is compared member by member with the others.
class SceneCheck {
 public:
  SceneCheck(const Study& study, const WorkPrecisionDesign& design, const Setting& scene, Mistakes& mistakes)
      : study_(study), own_(in_scene(study, scene)), design_(design), mistakes_(mistakes) {
    base = campaign_of(own_, {}, study.file);
    points_ = sample(base);
  }

  /// Returns the campaign's name.
  std::string check(const Setting& setting, const std::string& what) {
    const Campaign campaign =
        campaign_of(own_, setting.overrides(), fmt::format("{}: {}", study_.file, what));
    const Samples points = sample(campaign);
    if (campaign.members != base.members || points.paths != points_.paths ||
        points.physical != points_.physical)
      mistakes_.add(members_place(study_, setting),
                    what + " has other members than the base; what is sampled is said in \"set\", for all");
    const Layout shapes = layout(campaign.scene);
    for (const std::string& measure : design_.measures)
      if (!measure_name(measure, shapes))
        mistakes_.add(members_place(study_, setting), fmt::format("{} does not give {}", what, measure));
    return name_of(campaign);
  }

  Campaign base;

 private:
  const Study& study_;
  const Study own_;
  const WorkPrecisionDesign& design_;
  Mistakes& mistakes_;
  Samples points_;
};

/// Measures and known values by the whole names of the scene's features.
void name_measures(Study& study, WorkPrecisionDesign& design, const Layout& shapes, Mistakes& mistakes) {
  Node& list = *study.root.find("measures");
  std::vector<std::string> names;
  for (std::size_t k = 0; k < design.measures.size(); ++k) {
    const Place& place = list.kind == Node::Kind::sequence ? list.items[k].place : list.place;
    const std::string& wish = design.measures[k];
    const auto name = measure_name(wish, shapes);
    if (!name)
      mistakes.add(place, "measures: " + (is_norm(wish) ? wish + " is no output of the scene"
                                                        : no_such_feature(shapes.features, wish)));
    else if (std::find(names.begin(), names.end(), *name) != names.end())
      mistakes.add(place, fmt::format("measures: {} stands there twice", *name));
    else if (!design.reference && is_norm(wish))
      mistakes.add(place, fmt::format("measures: {} needs a reference that is run, not values", wish));
    else
      names.push_back(*name);
  }
  if (!mistakes.empty()) return;
  design.measures = names;
  if (design.reference) return;

  std::map<std::string, double> known;
  for (const Node::Entry& entry : study.root.find("reference")->find("values")->entries) {
    const auto which = find_feature(names, entry.key);
    if (!which)
      mistakes.add(entry.place, fmt::format("reference.values: {} is none of the measures", entry.key));
    else if (!known.emplace(names[*which], design.known.at(entry.key)).second)
      mistakes.add(entry.place, fmt::format("reference.values: {} stands there twice", names[*which]));
  }
  for (const std::string& name : names)
    if (!known.contains(name))
      mistakes.add(list.place, fmt::format("measures: reference.values has no {}", name));
  design.known = known;
}

void check_measurements(Study& study, const std::string& file, Mistakes& mistakes) {
  namespace fs = std::filesystem;
  const Place& place = study.root.find("measurements")->place;
  const fs::path path(file), folder = path.parent_path();
  if (fs::is_directory(path) || (!folder.empty() && !fs::is_directory(folder)))
    return mistakes.add(
        place, fmt::format("measurements: {} cannot be written there: {}", file,
                           fs::is_directory(path) ? "it is a folder" : folder.string() + " is no folder"));
  const fs::path store = study.store;
  for (const fs::path& other :
       {fs::path(study.file), fs::path(study.base), store, fs::path(store).replace_extension(".csv"),
        fs::path(store).replace_extension(".png")})
    if (same_file(path.string(), other.string()))
      return mistakes.add(place, fmt::format("measurements would be written over {}", other.string()));
}

}  // namespace

void check_design(Study& study, WorkPrecisionDesign& design, Mistakes& mistakes) {
  if (!design.measurements.empty()) check_measurements(study, design.measurements, mistakes);
  std::string base;  // names of all scenes, one behind the other
  std::vector<std::string> names(design.settings.size());
  for (const Setting& scene : design.scenes) {
    SceneCheck check(study, design, scene, mistakes);
    if (base.empty()) name_measures(study, design, layout(check.base.scene), mistakes);
    if (!mistakes.empty()) return;
    base += name_of(check.base);
    for (std::size_t i = 0; i < names.size(); ++i)
      names[i] += check.check(design.settings[i], fmt::format("setting \"{}\"", design.settings[i].label));
    if (design.reference) check.check(*design.reference, "the reference");
  }
  std::map<std::string, std::string> labels;  // by name
  std::set<std::string> given;
  bool has_default = false;
  for (std::size_t i = 0; i < names.size(); ++i) {
    Setting& setting = design.settings[i];
    const Place& place = setting.places.empty() ? study.root.place : setting.places.front();
    const auto [first, is_new] = labels.emplace(names[i], setting.label);
    if (!given.insert(setting.label).second)
      mistakes.add(place, fmt::format("two settings are called \"{}\"; give their groups a label, or leave "
                                      "out what stands there twice",
                                      setting.label));
    else if (!is_new)
      mistakes.add(place,
                   fmt::format("settings \"{}\" and \"{}\" are the same", first->second, setting.label));
    setting.is_default = names[i] == base;
    has_default = has_default || setting.is_default;
  }
  if (!has_default) design.settings.push_back({"default", {}, true});
}

}  // namespace cohort
