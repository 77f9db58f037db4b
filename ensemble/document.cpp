#include "ensemble/document.hpp"

#include <spdlog/fmt/fmt.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <sstream>
#include <tuple>

namespace cohort {

namespace {

constexpr const char* command_line = "--set";

/// Builds the tree from yaml-cpp's events.
class TreeBuilder : public YAML::EventHandler {
 public:
  TreeBuilder(std::string file, int fixed_line, Mistakes& mistakes)
      : file_(std::move(file)), fixed_line_(fixed_line), mistakes_(mistakes) {}

  Node take() { return std::move(root_); }

  /// yaml-cpp counts lines and columns from 0, and -1 where it does not know.
  Place place(const YAML::Mark& mark) const {
    if (fixed_line_ > 0) return {file_, fixed_line_, 0};
    return {file_, std::max(mark.line, 0) + 1, std::max(mark.column, 0) + 1};
  }

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override { add(mark, Node::Kind::null, {}, false); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    mistakes_.add(place(mark), "aliases (*name) are not supported; write the value out");
    add(mark, Node::Kind::null, {}, false);
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t,
                const std::string& value) override {
    add(mark, Node::Kind::scalar, value, tag == "!");
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    open(mark, Node::Kind::sequence);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    open(mark, Node::Kind::map);
  }
  void OnMapEnd() override { close(); }

 private:
  struct Open {
    Node node;
    bool has_key = false;
    std::string key;
    Place key_place;
  };

  void open(const YAML::Mark& mark, Node::Kind kind) {
    Node node;
    node.kind = kind;
    node.place = place(mark);
    open_.push_back({std::move(node), false, {}, {}});
  }

  void close() {
    Node node = std::move(open_.back().node);
    open_.pop_back();
    attach(std::move(node));
  }

  void add(const YAML::Mark& mark, Node::Kind kind, const std::string& text, bool quoted) {
    Node node;
    node.kind = kind;
    node.place = place(mark);
    node.text = text;
    node.quoted = quoted;
    attach(std::move(node));
  }

  void attach(Node node) {
    if (open_.empty()) {
      root_ = std::move(node);
      return;
    }
    Open& parent = open_.back();
    if (parent.node.kind == Node::Kind::sequence) {
      parent.node.items.push_back(std::move(node));
    } else if (!parent.has_key) {
      if (node.kind != Node::Kind::scalar) mistakes_.add(node.place, "a key must be plain text");
      parent.has_key = true;
      parent.key = node.text;
      parent.key_place = node.place;
    } else {
      parent.has_key = false;
      // Nothing after the colon: yaml-cpp's mark is that of whatever comes next.
      if (node.kind == Node::Kind::null) node.place = parent.key_place;
      check_repeated(parent);
      parent.node.entries.push_back({parent.key, parent.key_place, std::move(node)});
    }
  }

  void check_repeated(const Open& map) {
    const auto first = std::find_if(map.node.entries.begin(), map.node.entries.end(),
                                    [&](const Node::Entry& entry) { return entry.key == map.key; });
    if (first == map.node.entries.end()) return;
    mistakes_.add(map.key_place, fmt::format("key \"{}\" stands twice; the first is in line {}", map.key,
                                             first->place.line));
  }

  std::string file_;
  int fixed_line_;
  Mistakes& mistakes_;
  Node root_;
  std::vector<Open> open_;
};

/// Adds a mistake for each line that a tab indents: yaml-cpp reads on and complains somewhere else.
bool indented_by_tabs(const std::string& text, const std::string& file, Mistakes& mistakes) {
  std::istringstream lines(text);
  int number = 0;
  bool any = false;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const size_t first = line.find_first_not_of(' ');
    if (first == std::string::npos || line[first] != '\t') continue;
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    mistakes.add({file, number, static_cast<int>(first) + 1},
                 "a tab indents this line; YAML takes spaces only");
    any = true;
  }
  return any;
}

Node parse(const std::string& text, const std::string& file, int fixed_line, Mistakes& mistakes) {
  TreeBuilder builder(file, fixed_line, mistakes);
  std::istringstream stream(text);
  try {
    YAML::Parser parser(stream);
    if (!parser.HandleNextDocument(builder)) {
      Node empty;
      empty.place = {file, fixed_line > 0 ? fixed_line : 1, fixed_line > 0 ? 0 : 1};
      return empty;
    }
    Node root = builder.take();
    TreeBuilder second(file, fixed_line, mistakes);
    if (parser.HandleNextDocument(second))
      mistakes.add(second.take().place, "a second YAML document; a campaign file holds one");
    return root;
  } catch (const YAML::Exception& error) {
    mistakes.add(builder.place(error.mark), "not YAML: " + error.msg);
    return {};
  }
}

}  // namespace

std::vector<std::string> Mistakes::lines() const {
  std::vector<Mistake> sorted = mistakes_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Mistake& a, const Mistake& b) {
    return std::tuple(a.place.file == command_line, a.place.line, a.place.column) <
           std::tuple(b.place.file == command_line, b.place.line, b.place.column);
  });
  std::vector<std::string> result;
  for (const auto& [place, message] : sorted) {
    std::string line = place.file;
    if (place.line > 0) line += fmt::format(":{}", place.line);
    if (place.column > 0) line += fmt::format(":{}", place.column);
    line += ": " + message;
    if (result.empty() || result.back() != line) result.push_back(std::move(line));
  }
  return result;
}

Node* Node::find(const std::string& key) {
  const auto it =
      std::find_if(entries.begin(), entries.end(), [&](const Entry& entry) { return entry.key == key; });
  return it == entries.end() ? nullptr : &it->value;
}

Node parse_document(const std::string& text, const std::string& file, Mistakes& mistakes) {
  if (indented_by_tabs(text, file, mistakes)) return {};
  return parse(text, file, 0, mistakes);
}

Node parse_override(const std::string& value, int number, Mistakes& mistakes) {
  return parse(value, command_line, number, mistakes);
}

void name_levels(Node& node, const std::string& path) {
  node.path = path;
  node.name = path;
  for (Node::Entry& entry : node.entries)
    name_levels(entry.value, path.empty() ? entry.key : path + "." + entry.key);
}

}  // namespace cohort
