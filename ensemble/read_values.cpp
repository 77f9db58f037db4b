#include "ensemble/read_values.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "ensemble/suggest.hpp"

namespace cohort {

namespace {

/// Whether `text` is a decimal number in the form that YAML 1.1, YAML 1.2 and a person read alike.
bool has_leading_zero(std::string_view digits) {
  return digits.size() > 1 && digits[0] == '0' && digits[1] >= '0' && digits[1] <= '9';
}

bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}
bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// Text without its sign's plus, which std::from_chars does not take.
std::string_view without_plus(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  return text;
}

std::string_view without_minus(std::string_view text) {
  if (!text.empty() && text[0] == '-') text.remove_prefix(1);
  return text;
}

}  // namespace

std::string with_unit(double value, const std::string& unit) {
  return unit.empty() || unit == "1" ? fmt::format("{}", value) : fmt::format("{} {}", value, unit);
}

std::string range(double lower, double upper, const std::string& unit) {
  return fmt::format("[{}, {}]{}", lower, upper, unit.empty() || unit == "1" ? "" : " " + unit);
}

std::string found(const Node& node) {
  switch (node.kind) {
    case Node::Kind::null:
      return "found nothing";
    case Node::Kind::sequence:
      return "found a list";
    case Node::Kind::map:
      return "found a map";
    case Node::Kind::scalar:
      break;
  }
  return fmt::format("found {}\"{}\"", node.quoted ? "the quoted text " : "", node.text);
}

std::optional<double> read_number(Node& node, const std::string& what, const std::string& unit,
                                  Mistakes& mistakes) {
  node.read = true;
  const std::string kind = unit.empty() || unit == "1" ? "a number" : "a number in " + unit;
  const std::string_view text = without_plus(node.text);
  const std::string_view digits = without_minus(text);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole_text = end == text.data() + text.size();
  const bool numeric = !digits.empty() && (is_digit(digits[0]) || digits[0] == '.');
  if (node.kind != Node::Kind::scalar || node.quoted || !numeric || !whole_text ||
      error == std::errc::invalid_argument) {
    mistakes.add(node.place, fmt::format("{} must be {}, {}", what, kind, found(node)));
    return {};
  }
  if (error == std::errc::result_out_of_range || !std::isfinite(value)) {
    mistakes.add(node.place,
                 fmt::format("{} must be {}, \"{}\" does not fit double precision", what, kind, node.text));
    return {};
  }
  if (has_leading_zero(digits)) {
    mistakes.add(node.place,
                 fmt::format("{} must be {} without leading zeros, {}; YAML readers may take it as octal",
                             what, kind, found(node)));
    return {};
  }
  return value;
}

std::optional<std::int64_t> read_whole(Node& node, const std::string& what, std::int64_t least,
                                       Mistakes& mistakes) {
  node.read = true;
  const std::string_view text = without_plus(node.text);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (node.kind != Node::Kind::scalar || node.quoted || error != std::errc() ||
      end != text.data() + text.size() || has_leading_zero(without_minus(text))) {
    mistakes.add(node.place, fmt::format("{} must be a whole number, {}", what, found(node)));
    return {};
  }
  if (value < least) {
    mistakes.add(node.place, fmt::format("{} is {}; it must be at least {}", what, value, least));
    return {};
  }
  return value;
}

std::optional<std::string> read_text(Node& node, const std::string& what, Mistakes& mistakes) {
  node.read = true;
  if (node.kind == Node::Kind::scalar && !node.text.empty()) return node.text;
  mistakes.add(node.place, fmt::format("{} must be a text, {}", what, found(node)));
  return {};
}

std::optional<bool> read_bool(Node& node, const std::string& what, Mistakes& mistakes) {
  node.read = true;
  if (node.kind == Node::Kind::scalar && !node.quoted) {
    if (node.text == "true") return true;
    if (node.text == "false") return false;
  }
  mistakes.add(node.place, fmt::format("{} must be true or false, {}", what, found(node)));
  return {};
}

std::optional<size_t> read_choice(Node& node, const std::string& what,
                                  const std::vector<std::string>& candidates, Mistakes& mistakes) {
  const auto text = read_text(node, what, mistakes);
  if (!text) return {};
  const auto it = std::find(candidates.begin(), candidates.end(), *text);
  if (it != candidates.end()) return static_cast<size_t>(it - candidates.begin());
  mistakes.add(node.place, fmt::format("{} cannot be \"{}\"{}", what, *text, suggestion(*text, candidates)));
  return {};
}

std::optional<std::vector<std::string>> read_texts(Node& node, const std::string& what, Mistakes& mistakes) {
  node.read = true;
  if (node.kind != Node::Kind::sequence) {
    const auto text = read_text(node, what, mistakes);
    if (!text) return {};
    return std::vector<std::string>{*text};
  }
  std::vector<std::string> result;
  for (Node& item : node.items) {
    const auto text = read_text(item, what, mistakes);
    if (!text) return {};
    result.push_back(*text);
  }
  return result;
}

std::optional<std::vector<double>> read_numbers(Node& node, const std::string& what, const std::string& unit,
                                                size_t count, Mistakes& mistakes) {
  node.read = true;
  if (node.kind != Node::Kind::sequence || (count > 0 && node.items.size() != count)) {
    const std::string wanted = count > 0 ? fmt::format("a list of {} numbers", count) : "a list of numbers";
    const std::string given = node.kind == Node::Kind::sequence
                                  ? fmt::format("found a list of {}", node.items.size())
                                  : found(node);
    mistakes.add(node.place, fmt::format("{} must be {}, {}", what, wanted, given));
    return {};
  }
  std::vector<double> result;
  bool good = true;
  for (Node& item : node.items) {
    const auto number = read_number(item, what, unit, mistakes);
    good = good && number;
    result.push_back(number.value_or(0));
  }
  if (!good) return {};
  return result;
}

Node* take(Node& map, const std::string& key) {
  map.known.insert(key);
  return map.find(key);
}

bool expect_map(Node& node, const std::string& what, Mistakes& mistakes) {
  if (node.kind == Node::Kind::null) node.kind = Node::Kind::map;
  if (node.kind == Node::Kind::map) return true;
  node.read = true;
  mistakes.add(node.place, fmt::format("{} must be a map of keys, {}", what, found(node)));
  return false;
}

Node* take_map(Node& map, const std::string& key, Mistakes& mistakes) {
  Node* node = take(map, key);
  if (!node || !expect_map(*node, node->name, mistakes)) return nullptr;
  return node;
}

Node* require_map(Node& map, const std::string& key, Mistakes& mistakes) {
  Node* node = take(map, key);
  if (!node) {
    mistakes.add(map.place, map.name.empty() ? fmt::format("\"{}\" is missing", key)
                                             : fmt::format("\"{}\" is missing in {}", key, map.name));
    return nullptr;
  }
  return expect_map(*node, node->name, mistakes) ? node : nullptr;
}

Node::Entry* exactly_one(Node& map, const std::vector<std::string>& words, Mistakes& mistakes) {
  Node::Entry* chosen = nullptr;
  for (const std::string& word : words) map.known.insert(word);
  for (Node::Entry& entry : map.entries) {
    if (std::find(words.begin(), words.end(), entry.key) == words.end()) continue;
    if (!chosen) {
      chosen = &entry;
      continue;
    }
    entry.value.read = true;
    if (entry.key != chosen->key)
      mistakes.add(entry.place, fmt::format("{} takes one of {}; it has \"{}\" and \"{}\"", map.name,
                                            fmt::join(words, ", "), chosen->key, entry.key));
  }
  if (!chosen) {
    // A misspelt word is told by the unknown key that it is; only an absent one is told here.
    const bool misspelt = std::any_of(map.entries.begin(), map.entries.end(), [&](const Node::Entry& entry) {
      return !map.known.contains(entry.key) && suggestion(entry.key, words).starts_with("; did");
    });
    if (misspelt)
      check_keys(map, {}, mistakes);
    else
      mistakes.add(map.place, fmt::format("{} needs one of {}", map.name, fmt::join(words, ", ")));
  }
  return chosen;
}

void check_keys(Node& map, const std::vector<std::string>& also, Mistakes& mistakes) {
  std::vector<std::string> known(map.known.begin(), map.known.end());
  known.insert(known.end(), also.begin(), also.end());
  for (Node::Entry& entry : map.entries) {
    if (std::find(known.begin(), known.end(), entry.key) != known.end()) continue;
    entry.value.read = true;
    mistakes.add(entry.place,
                 fmt::format("unknown key \"{}\"{}{}", entry.key, map.name.empty() ? "" : " in " + map.name,
                             suggestion(entry.key, known)));
  }
}

bool check_name(const Node::Entry& entry, const std::string& what, Mistakes& mistakes) {
  const std::string& name = entry.key;
  const bool good = !name.empty() && is_letter(name[0]) && std::all_of(name.begin(), name.end(), [](char c) {
    return is_letter(c) || is_digit(c) || c == '_';
  });
  if (!good)
    mistakes.add(entry.place,
                 fmt::format("{} cannot be called \"{}\"; a name is a letter, then letters, digits "
                             "and underscores",
                             what, name));
  return good;
}

}  // namespace cohort
