#include <spdlog/fmt/fmt.h>

#include <charconv>
#include <filesystem>

#include "ensemble/config.hpp"
#include "ensemble/config_sections.hpp"
#include "ensemble/read_values.hpp"
#include "ensemble/sha256.hpp"
#include "solver/labels.hpp"

// geometry: {labels: heart.nii.gz, convention: MM-WHS, labels_table: {500: lv_blood}, frame: heart}
namespace cohort {

namespace {

/// Adds what the file's own table says; its keys are whole numbers, its values names of blood or regions.
void read_table(Node& node, LabelTable& table, Mistakes& mistakes) {
  for (Node::Entry& entry : node.entries) {
    node.known.insert(entry.key);
    std::int32_t value = 0;
    const char* end = entry.key.data() + entry.key.size();
    const auto parsed = std::from_chars(entry.key.data(), end, value);
    const auto name = read_text(entry.value, entry.value.path, mistakes);
    if (parsed.ec != std::errc() || parsed.ptr != end) {
      mistakes.add(
          entry.place,
          fmt::format("geometry.labels_table has the key \"{}\"; a label is a whole number", entry.key));
      continue;
    }
    if (!name) continue;
    const Node::Entry named{*name, entry.value.place, {}};
    if (check_name(named, "a region", mistakes)) table[value] = *name;
  }
}

}  // namespace

void read_labels(Node& geometry, const std::string& campaign_file, Scene& scene, Mistakes& mistakes) {
  const size_t before = mistakes.size();
  Node* labels = take(geometry, "labels");
  const auto name = read_text(*labels, labels->path, mistakes);
  std::string convention;
  LabelTable table;
  if (Node* node = take(geometry, "convention")) {
    const std::vector<std::string> names = label_conventions();
    if (const auto index = read_choice(*node, node->path, names, mistakes)) {
      convention = names[*index];
      table = label_table(convention);
    }
  }
  if (Node* node = take_map(geometry, "labels_table", mistakes)) {
    if (convention.empty()) table[0] = "background";
    read_table(*node, table, mistakes);
  } else if (convention.empty() && mistakes.size() == before) {
    mistakes.add(
        labels->place,
        fmt::format("geometry.labels needs \"convention\" ({}) or \"labels_table\": what its values mean",
                    fmt::join(label_conventions(), ", ")));
  }
  std::optional<LabelFrame> frame;
  if (Node* node = take(geometry, "frame"))
    frame = read_word<LabelFrame>(*node, {{"image", LabelFrame::image}, {"heart", LabelFrame::heart}},
                                  LabelFrame::image, mistakes);
  if (mistakes.size() != before || !name) return;

  const std::string file = (std::filesystem::path(campaign_file).parent_path() / *name).string();
  try {
    LabelImage image = read_label_image(file);
    auto heart = std::make_shared<LabelHeart>(std::move(image), file, convention, std::move(table), frame);
    heart->sha256 = sha256(read_campaign_file(file));
    scene.labels = std::move(heart);
  } catch (const std::runtime_error& error) {
    mistakes.add(labels->place, error.what());
  } catch (const std::invalid_argument& error) {
    mistakes.add(labels->place, error.what());
  }
}

}  // namespace cohort
