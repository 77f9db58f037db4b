#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ensemble/document.hpp"

namespace cohort {

// Typed reads of one node. Each marks the node as read, and on a mistake adds it and returns nothing. `what`
// is the name in messages.

/// A decimal number. Octal and hexadecimal forms, leading zeros, underscores, infinities, NaN and text in
/// quotes are refused: YAML readers disagree about them.
std::optional<double> read_number(Node& node, const std::string& what, const std::string& unit,
                                  Mistakes& mistakes);
/// A whole number of at least `least`.
std::optional<std::int64_t> read_whole(Node& node, const std::string& what, std::int64_t least,
                                       Mistakes& mistakes);
std::optional<std::string> read_text(Node& node, const std::string& what, Mistakes& mistakes);
/// true or false; yes, no, on and off are refused.
std::optional<bool> read_bool(Node& node, const std::string& what, Mistakes& mistakes);
/// Index of the candidate that stands there.
std::optional<size_t> read_choice(Node& node, const std::string& what,
                                  const std::vector<std::string>& candidates, Mistakes& mistakes);
/// What the word that stands there means; `fallback` after a mistake.
template <typename Enum>
Enum read_word(Node& node, const std::vector<std::pair<std::string, Enum>>& meanings, Enum fallback,
               Mistakes& mistakes) {
  std::vector<std::string> words;
  for (const auto& [word, meaning] : meanings) words.push_back(word);
  const auto index = read_choice(node, node.path, words, mistakes);
  return index ? meanings[*index].second : fallback;
}
/// A list of texts; a single text counts as a list of one.
std::optional<std::vector<std::string>> read_texts(Node& node, const std::string& what, Mistakes& mistakes);
/// A list of numbers, with as many as `count` unless that is 0.
std::optional<std::vector<double>> read_numbers(Node& node, const std::string& what, const std::string& unit,
                                                size_t count, Mistakes& mistakes);

/// The value of a structure key of `map`, or null. Makes the key known to the check for unknown keys.
Node* take(Node& map, const std::string& key);
/// As take, for a value that is a map itself; nothing after the colon counts as an empty map.
Node* take_map(Node& map, const std::string& key, Mistakes& mistakes);
/// As take_map, and a missing key is a mistake.
Node* require_map(Node& map, const std::string& key, Mistakes& mistakes);
/// True where `node` is a map or empty; else adds a mistake.
bool expect_map(Node& node, const std::string& what, Mistakes& mistakes);

/// The one key of `map` among `words`, or null after a mistake. Marks what else stands there of them as read.
Node::Entry* exactly_one(Node& map, const std::vector<std::string>& words, Mistakes& mistakes);

/// Adds a mistake for each key of `map` that is neither known nor in `also`.
void check_keys(Node& map, const std::vector<std::string>& also, Mistakes& mistakes);
/// True where `name` can be a part of a path (a letter, then letters, digits, underscores); else adds a
/// mistake.
bool check_name(const Node::Entry& entry, const std::string& what, Mistakes& mistakes);

/// "20 mm", and "20" where the unit is "1".
std::string with_unit(double value, const std::string& unit);
/// "[0.05, 20] mm".
std::string range(double lower, double upper, const std::string& unit);
/// "found a list", "found the text "abc"", ...
std::string found(const Node& node);

}  // namespace cohort
