#pragma once

#include <set>
#include <string>
#include <vector>

namespace cohort {

/// Where something was written. The file "--set" stands for the command line, its line for the how-many-th
/// --set.
struct Place {
  std::string file;
  int line = 0;    ///< from 1; 0 where the file as a whole is meant
  int column = 0;  ///< from 1; 0 where there is none
};

struct Mistake {
  Place place;
  std::string message;
};

/// Mistakes in a campaign file, gathered so that all are told at once.
class Mistakes {
 public:
  void add(const Place& place, std::string message) { mistakes_.push_back({place, std::move(message)}); }
  bool empty() const { return mistakes_.empty(); }
  size_t size() const { return mistakes_.size(); }
  /// "file:line:column: message", in the order of the file, those of --set last.
  std::vector<std::string> lines() const;

 private:
  std::vector<Mistake> mistakes_;
};

/// One value of a YAML file with its place. A tree of our own, because yaml-cpp's nodes drop repeated keys
/// and tell neither the place of a key nor whether a scalar was quoted.
struct Node {
  enum class Kind { null, scalar, sequence, map };
  struct Entry;

  Kind kind = Kind::null;
  Place place;
  std::string text;  ///< of a scalar, as written
  bool quoted = false;
  std::vector<Node> items;     ///< of a sequence
  std::vector<Entry> entries;  ///< of a map, in the order of the file; a repeated key stands twice

  std::string path;  ///< name in messages and in the parameter table; empty for the scene and the root
  std::string name;  ///< what a message calls this level: its path, or "scene"
  std::set<std::string> known;  ///< keys of this map that are structure, not numbers
  bool read = false;            ///< what stands here has been taken

  /// The value of `key`, or null.
  Node* find(const std::string& key);
};

struct Node::Entry {
  std::string key;
  Place place;
  Node value;
};

/// Parses YAML with at most one document; anchors and aliases are refused. Adds a mistake for each syntax
/// error (the first only, as nothing after it can be trusted) and each repeated key.
Node parse_document(const std::string& text, const std::string& file, Mistakes& mistakes);

/// Parses the value of the how-many-th --set; every place in it is that of the --set.
Node parse_override(const std::string& value, int number, Mistakes& mistakes);

/// Names every level below `node` by its path.
void name_levels(Node& node, const std::string& path);

}  // namespace cohort
