// SPDX-License-Identifier: BSD-3-Clause
#include "cell/check/diagnostic_collector.hpp"

#include <charconv>

namespace kr5::cell {
namespace {

using io::Node;

struct Place {
  const Node* node = nullptr;  ///< Null when the document has no such field.
  int line = 0;                ///< Of the field, or of what it would stand in.
};

const Node* step(const Node& node, std::string_view part) {
  if (!part.starts_with('[')) return node.find(part);
  std::size_t index = 0;
  std::from_chars(part.data() + 1, part.data() + part.size(), index);
  return index < node.items.size() ? &node.items[index] : nullptr;
}

/// Takes `name` or `[3]` off the front of a path.
std::string_view take_part(std::string_view& path) {
  if (path.starts_with('.')) path.remove_prefix(1);
  const std::size_t end = path.starts_with('[') ? path.find(']') + 1 : path.find_first_of(".[");
  const std::string_view part = path.substr(0, end);
  path.remove_prefix(part.size());
  return part;
}

Place locate(const Node& root, std::string_view path) {
  Place place{&root, root.line};
  while (!path.empty() && place.node) {
    place.node = step(*place.node, take_part(path));
    if (place.node && place.node->line > 0) place.line = place.node->line;
  }
  return place;
}

std::string shown(const Node* node) {
  constexpr std::size_t most = 9;
  if (!node || node->kind == Node::Kind::Null) return "nothing";
  if (node->kind == Node::Kind::Scalar) return io::shortened(node->scalar);
  if (node->kind == Node::Kind::Map) return "a map of " + std::to_string(node->entries.size());
  std::string text;
  for (const Node& item : node->items) {
    if (item.kind != Node::Kind::Scalar || node->items.size() > most)
      return "a list of " + std::to_string(node->items.size());
    text += (text.empty() ? "[" : ", ") + io::shortened(item.scalar);
  }
  return text.empty() ? "an empty list" : text + "]";
}

}  // namespace

std::string FieldPath::text() const {
  const std::string name(list_);
  return (index_ < 0 ? name : item(name, index_)) + std::string(rest_);
}

void DiagnosticCollector::add(const std::string& field, const std::string& expected, std::string found) {
  const Place place = locate(root_, field);
  if (found.empty()) found = shown(place.node);
  diagnostics_.push_back({file_, place.line, field, std::move(found), expected, severity_});
}

std::string listed(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += (out.empty() ? "" : ", ") + name;
  return out;
}

std::string item(const std::string& name, Eigen::Index index) { return name + "[" + std::to_string(index) + "]"; }

std::string text_of(double value) {
  char buffer[40];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

std::string rounded_text(double value) {
  char buffer[40];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general, 6).ptr};
}

}  // namespace kr5::cell
