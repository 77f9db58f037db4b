// Scenes whose geometry is a label map: regions, parameters, extent, sites.
#include "solver/labels.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "solver/geometry_kinds.hpp"

namespace cohort {

namespace {

const std::string grown = "geometry.grown.";

bool is_blood(const std::string& name) {
  return std::any_of(std::begin(blood_names), std::end(blood_names),
                     [&](const char* b) { return name == b; });
}

bool is_inert(const std::string& region) {
  return region == "insulator" || region == "aorta" || region == "pulmonary_artery";
}

Extent nothing() {
  Extent e;
  e.lower.fill(1e30);
  e.upper.fill(-1e30);
  return e;
}

}  // namespace

LabelHeart::LabelHeart(LabelImage image_, const std::string& name, const std::string& convention_,
                       LabelTable table_, std::optional<LabelFrame> frame_)
    : shared_image(std::make_shared<const LabelImage>(with_enclosed_blood(std::move(image_), table_))),
      image(*shared_image),
      convention(convention_),
      table(std::move(table_)) {
  if (convention == "cohort") read_comment();
  collect_regions(name);
  frame = frame_.value_or(convention == "cohort" ? LabelFrame::image : LabelFrame::heart);
  if (frame == LabelFrame::heart) {
    try {
      const int rv = region_index("rv");
      to_heart = heart_frame(image, part_of_label, rv < 0 || grows_rv ? -1 : first_region_part + rv);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(name + ": " + error.what() +
                                  "; with \"frame: image\" the image's own axes count");
    }
  }
  measure();
  for (auto& [site_name, sphere] : sites) sphere.centre = to_heart(sphere.centre);
}

// Lines of an export's comment: "label 101 scar inert", "site av_node x y z radius".
void LabelHeart::read_comment() {
  std::istringstream lines(image.comment);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string what, name, kind;
    words >> what;
    if (what == "label") {
      std::int32_t value = 0;
      if (words >> value >> name >> kind && !name.empty() && value >= first_other_label && value < 256) {
        table.emplace(value, name);
        excitable_.emplace_back(name, kind != "inert");
      }
    } else if (what == "site") {
      Sphere s{};
      words >> name >> s.centre[0] >> s.centre[1] >> s.centre[2] >> s.radius;
      const bool finite =
          std::isfinite(s.centre[0] + s.centre[1] + s.centre[2]) && s.radius > 0 && s.radius < 1e3;
      if (words && finite) sites.emplace_back(name, s);
    }
  }
}

void LabelHeart::collect_regions(const std::string& name) {
  std::string unknown;
  std::vector<std::string> present, labelled;  // in the image, in the table
  for (const auto& [value, meaning] : table) labelled.push_back(meaning);
  for (std::size_t i = 0; i < image.labels.size(); ++i) {
    if (image.counts[i] == 0) continue;
    const auto it = table.find(image.labels[i]);
    if (it == table.end())
      unknown +=
          fmt::format("{}{} ({} voxels)", unknown.empty() ? "" : ", ", image.labels[i], image.counts[i]);
    else
      present.push_back(it->second);
  }
  if (!unknown.empty())
    throw std::invalid_argument(
        fmt::format("{}: holds labels that {} does not know: {}; name them under geometry.labels_table", name,
                    convention.empty() ? "geometry.labels_table" : "convention " + convention, unknown));
  const auto in = [](const std::vector<std::string>& names, const std::string& n) {
    return std::find(names.begin(), names.end(), n) != names.end();
  };
  // Walls that the convention has no label for are grown around the blood that is there.
  grows_rv = in(present, "rv_blood") && !in(labelled, "rv");
  grows_la = in(present, "la_blood") && !in(labelled, "la");
  grows_ra = in(present, "ra_blood") && !in(labelled, "ra");
  const bool atria = grows_la || grows_ra || in(present, "la") || in(present, "ra");
  const bool ventricles = in(present, "lv") || grows_rv || in(present, "rv");
  grows_plate = atria && ventricles && convention != "cohort";
  grows_path = (grows_ra || in(present, "ra")) && in(present, "lv") && !in(labelled, "conduction_path");
  const auto wanted = [&](const std::string& region) {
    return in(present, region) || (region == "rv" && grows_rv) || (region == "la" && grows_la) ||
           (region == "ra" && grows_ra) || (region == "insulator" && grows_plate) ||
           (region == "conduction_path" && grows_path);
  };
  std::vector<std::string> names;
  for (const char* region : heart_regions)
    if (wanted(region)) names.emplace_back(region);
  for (const std::string& meaning : present)
    if (meaning != "background" && !is_blood(meaning) && !in(names, meaning)) names.push_back(meaning);
  if (names.size() > 200) throw std::invalid_argument(name + ": has more than 200 regions");

  part_of_label.assign(image.labels.size(), no_part);
  for (std::size_t i = 0; i < image.labels.size(); ++i) {
    if (image.counts[i] == 0) continue;
    const std::string& meaning = table.at(image.labels[i]);
    for (std::size_t b = 0; b < std::size(blood_names); ++b)
      if (meaning == blood_names[b]) part_of_label[i] = static_cast<Part>(lv_blood_part + b);
    const auto it = std::find(names.begin(), names.end(), meaning);
    if (it != names.end()) part_of_label[i] = static_cast<Part>(first_region_part + (it - names.begin()));
    if (part_of_label[i] < first_region_part) blood_voxels_[part_of_label[i]] += image.counts[i];
  }
  bool excitable = false;
  for (const std::string& region : names) {
    Region r{.name = region, .shape = {}, .excitable = !is_inert(region), .fibres = Region::Fibres::none};
    for (const auto& [other, conducts] : excitable_)
      if (other == region) r.excitable = conducts;
    excitable = excitable || r.excitable;
    const LabelFibres rule = label_fibres(*this, region);
    if (r.excitable)
      r.fibres = rule == LabelFibres::constant ? Region::Fibres::constant : Region::Fibres::transmural;
    regions.push_back(r);
  }
  if (!excitable) throw std::invalid_argument(name + ": holds no tissue that conducts");
}

std::shared_ptr<const LabelHeart> LabelHeart::without_path() const {
  auto result = std::make_shared<LabelHeart>(*this);
  const int path = region_index("conduction_path");
  const bool node_known =
      std::any_of(sites.begin(), sites.end(), [](const auto& site) { return site.first == "av_node"; });
  result->idle_path = path >= 0 || (has("lv") && has("ra") && !node_known);
  if (path < 0) return result;
  result->grows_path = false;
  result->regions.erase(result->regions.begin() + path);
  const auto part = static_cast<Part>(first_region_part + path);
  for (Part& p : result->part_of_label)
    p = p == part ? idle_path_part : p > part ? static_cast<Part>(p - 1) : p;
  result->measure();
  return result;
}

int LabelHeart::region_index(const std::string& region) const {
  for (std::size_t r = 0; r < regions.size(); ++r)
    if (regions[r].name == region) return static_cast<int>(r);
  return -1;
}

void LabelHeart::measure() {
  part_extents_.fill(nothing());
  const Affine transform = compose(to_heart, image.to_world);
  std::array<double, 3> reach{};  // of a voxel about its centre
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) reach[i] += 0.5 * std::abs(transform.row[i][j]);
  std::size_t voxel = 0;
  for (int z = 0; z < image.cells[2]; ++z)
    for (int y = 0; y < image.cells[1]; ++y) {
      // Along a row the place is linear: its ends are enough for each run of one part.
      for (int x = 0; x < image.cells[0];) {
        const Part part = part_of_label[image.voxels[voxel]];
        int end = x;
        for (; end < image.cells[0] && part_of_label[image.voxels[voxel]] == part; ++end) ++voxel;
        if (part != no_part) {
          Extent& e = part_extents_[part];
          for (const int last : {x, end - 1}) {
            const auto p = transform({double(last), double(y), double(z)});
            for (size_t i = 0; i < 3; ++i) {
              e.lower[i] = std::min(e.lower[i], p[i] - reach[i]);
              e.upper[i] = std::max(e.upper[i], p[i] + reach[i]);
            }
          }
        }
        x = end;
      }
    }
}

LabelFibres label_fibres(const LabelHeart& heart, const std::string& region) {
  // Without blood beside it a wall has no inner side.
  const auto wall = [&](Part blood, LabelFibres rule) {
    return heart.has_blood(blood) ? rule : LabelFibres::constant;
  };
  if (is_inert(region)) return LabelFibres::none;
  if (region == "conduction_path" || region == "bachmann") return LabelFibres::along;
  if (region == "rv") return wall(rv_blood_part, LabelFibres::helix);
  if (region == "la") return wall(la_blood_part, LabelFibres::circumferential);
  if (region == "ra") return wall(ra_blood_part, LabelFibres::circumferential);
  return wall(lv_blood_part, LabelFibres::helix);
}

void declare_labels(Scene& scene) {
  if (!scene.labels) throw std::invalid_argument("a geometry of labels needs a label map");
  // A delay stands for the path: as in the schematic heart there is none.
  if (scene.conduction_system && scene.conduction_system->kind == ConductionSystem::Kind::delay)
    scene.labels = scene.labels->without_path();
  const LabelHeart& heart = *scene.labels;
  scene.regions = heart.regions;
  const auto mm = [&](const char* name, double value, double lower, double upper, const char* meaning,
                      const char* source) {
    Parameter p{grown + name, "mm", value, lower, upper, meaning, source};
    p.structural = true;
    scene.parameters.add(p);
  };
  const char* schematic = "as in the schematic heart";
  if (heart.grows_rv)
    mm("rv_wall_mm", 3.8, 0.5, 12, "right ventricular wall grown around its blood", schematic);
  if (heart.grows_la || heart.grows_ra)
    mm("atrial_wall_mm", 2.6, 0.5, 6, "atrial walls grown around their blood", schematic);
  if (heart.grows_plate)
    mm("av_plate_mm", 2, 0.1, 10,
       "atrial tissue nearer than this to ventricular tissue insulates; at least one cell",
       "half of the schematic heart's plate: tissue on one side gives way");
  if (heart.grows_path || heart.idle_path) {
    mm("conduction_path_radius_mm", 3, 1, 6, "path that joins atria and ventricles; at least one cell thick",
       schematic);
    mm("conduction_path_length_mm", 20, 4, 40, "path below the AV plane, in the septum", schematic);
  }
  if (heart.has("ra"))
    mm("sinoatrial_node_radius_mm", 4, 1, 10, "ball in which the sinoatrial node fires", schematic);
}

double label_size(const Scene& scene, const std::string& name) {
  const int index = scene.parameters.find(grown + name);
  return index < 0 ? 0 : scene.parameters[index].value;
}

Extent labels_extent(const Scene& scene) {
  const LabelHeart& heart = *scene.labels;
  Extent box = nothing();
  const auto include = [&](const Extent& e, double by) {
    if (e.lower[0] > e.upper[0]) return;
    for (size_t i = 0; i < 3; ++i) {
      box.lower[i] = std::min(box.lower[i], e.lower[i] - by);
      box.upper[i] = std::max(box.upper[i], e.upper[i] + by);
    }
  };
  for (std::size_t r = 0; r < heart.regions.size(); ++r)
    include(heart.part_extent(static_cast<Part>(first_region_part + r)), 0);
  const double rv = label_size(scene, "rv_wall_mm"), atrial = label_size(scene, "atrial_wall_mm");
  if (heart.grows_rv) include(heart.part_extent(rv_blood_part), rv);
  if (heart.grows_la) include(heart.part_extent(la_blood_part), atrial);
  if (heart.grows_ra) include(heart.part_extent(ra_blood_part), atrial);
  return box;
}

Sphere labels_site(const Scene& scene, const std::string& name) {
  const auto cells = label_cells(scene);
  for (const auto& [known, sphere] : cells->landmarks.sites)
    if (known == name) return sphere;
  throw std::invalid_argument("the label map has no stimulus site \"" + name +
                              "\": it lacks the labels from which it would be found");
}

}  // namespace cohort
