#include "ensemble/study.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>

#include "ensemble/config.hpp"
#include "ensemble/config_sections.hpp"
#include "ensemble/read_values.hpp"

namespace cohort {

namespace {

/// As it is where that is the same value within brackets and braces, else in quotes.
std::string scalar_text(const std::string& text, bool quoted) {
  if (!quoted && text.find_first_of(",[]{}#:\"'\\\n\t") == std::string::npos) return text;
  std::string result = "\"";
  for (const char c : text) {
    if (c == '\n' || c == '\t') {
      result += c == '\n' ? "\\n" : "\\t";
      continue;
    }
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

/// Keys of studies that campaigns have not.
const std::set<std::string>& study_keys() {
  static const std::set<std::string> keys = {"kind",     "base",      "set",     "for_each",    "settings",
                                             "measures", "reference", "repeats", "measurements"};
  return keys;
}

}  // namespace

std::string flow_text(const Node& node) {
  std::vector<std::string> parts;
  switch (node.kind) {
    case Node::Kind::null:
      return "null";
    case Node::Kind::scalar:
      return scalar_text(node.text, node.quoted);
    case Node::Kind::sequence:
      for (const Node& item : node.items) parts.push_back(flow_text(item));
      return fmt::format("[{}]", fmt::join(parts, ", "));
    case Node::Kind::map:
      for (const Node::Entry& entry : node.entries)
        parts.push_back(fmt::format("{}: {}", scalar_text(entry.key, false), flow_text(entry.value)));
      return fmt::format("{{{}}}", fmt::join(parts, ", "));
  }
  return {};
}

std::vector<std::string> settings(const Node& map) {
  std::vector<std::string> result;
  for (const Node::Entry& entry : map.entries) result.push_back(entry.key + "=" + flow_text(entry.value));
  return result;
}

Study read_study(const std::string& file, const std::vector<std::string>& overrides, Mistakes& mistakes) {
  Study study;
  study.file = file;
  study.root = parse_document(read_campaign_file(file), file, mistakes);
  Node& root = study.root;
  if (root.kind != Node::Kind::map) {
    if (mistakes.empty())
      mistakes.add({file, 1, 1}, "a study is a map of keys (kind, base, ...), " + found(root));
    return study;
  }
  std::vector<std::string> of_base;
  for (std::size_t i = 0; i < overrides.size(); ++i) {
    const std::string path = overrides[i].substr(0, overrides[i].find('='));
    if (const std::string key = path.substr(0, path.find('.')); study_keys().contains(key))
      mistakes.add({"--set", static_cast<int>(i) + 1, 0},
                   fmt::format("{} is a key of the study itself, to be set in {}: --set changes its base, or "
                               "stability.KEY",
                               key, file));
    else if (overrides[i].starts_with("stability."))
      apply_override(root, overrides[i], static_cast<int>(i) + 1, mistakes);
    else
      of_base.push_back(overrides[i]);
  }
  name_levels(root, "");
  if (Node* kind = take(root, "kind"))
    study.kind = read_word<Study::Kind>(
        *kind, {{"work_precision", Study::Kind::work_precision}, {"stability", Study::Kind::stability}},
        Study::Kind::work_precision, mistakes);
  else
    mistakes.add(root.place, "\"kind\" is missing: work_precision or stability");
  if (Node* base = take(root, "base")) {
    if (const auto name = read_text(*base, "base", mistakes)) {
      study.base = (std::filesystem::path(file).parent_path() / *name).lexically_normal().string();
      try {
        study.base_text = read_campaign_file(study.base);
      } catch (const ConfigError& error) {
        mistakes.add(base->place, error.what());
      }
    }
  } else {
    mistakes.add(root.place, "\"base\" is missing: the campaign file that is studied");
  }
  if (Node* set = take_map(root, "set", mistakes)) {
    study.overrides = settings(*set);
    set->read = true;
  }
  study.overrides.insert(study.overrides.end(), of_base.begin(), of_base.end());
  study.store = std::filesystem::path(file).stem().string() + ".h5";
  if (Node* store = take(root, "store")) study.store = read_text(*store, "store", mistakes).value_or("");
  return study;
}

void check_store(const Study& study) {
  const std::filesystem::path store = study.store;
  if (store.filename().empty()) throw ConfigError({fmt::format("store \"{}\" names no file", study.store)});
  for (const char* beside : {".csv", ".png"})
    if (store.extension() == beside)
      throw ConfigError(
          {fmt::format("store {}: the study writes its {} file beside the store, by that name; "
                       "call the store .h5",
                       study.store, beside)});
  for (const std::string& file : {study.file, study.base})
    if (same_file(study.store, file))
      throw ConfigError({fmt::format("store {} would be written over {}", study.store, file)});
}

bool same_file(const std::string& a, const std::string& b) {
  return std::filesystem::weakly_canonical(std::filesystem::absolute(a)) ==
         std::filesystem::weakly_canonical(std::filesystem::absolute(b));
}

void write_file(const std::string& file, const std::string& bytes) {
  const std::string unfinished = file + ".part";
  std::ofstream stream(unfinished, std::ios::binary);
  stream << bytes;
  stream.close();
  std::string why = stream ? "" : std::strerror(errno);
  std::error_code error;
  if (stream) std::filesystem::rename(unfinished, file, error);
  if (stream && !error) return;
  if (error) why = error.message();
  std::filesystem::remove(unfinished, error);
  throw std::runtime_error(fmt::format("{}: {} bytes cannot be written: {}", file, bytes.size(), why));
}

std::string csv_cell(std::string text) {
  for (std::size_t at = 0; (at = text.find('"', at)) != std::string::npos; at += 2) text.insert(at, 1, '"');
  return '"' + text + '"';
}

Campaign campaign_of(const Study& study, const std::vector<std::string>& more, const std::string& what) {
  std::vector<std::string> overrides = study.overrides;
  overrides.insert(overrides.end(), more.begin(), more.end());
  try {
    return parse_campaign(study.base_text, study.base, overrides);
  } catch (const ConfigError& error) {
    std::vector<std::string> lines;
    for (const std::string& mistake : error.mistakes()) lines.push_back(fmt::format("{}: {}", what, mistake));
    throw ConfigError(std::move(lines));
  }
}

}  // namespace cohort
