// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// @file
/// A YAML (or JSON) document as a tree that remembers where it came from, so that every complaint can name
/// file, line and field.

namespace kr5::io {

/// One node of a document. Maps keep their order.
struct Node {
  enum class Kind { Null, Scalar, Sequence, Map };

  Kind kind = Kind::Null;
  std::string scalar;                                 ///< Text of a scalar, as written.
  bool quoted = false;                                ///< The scalar was quoted: text even if it looks like a number.
  bool flow = false;                                  ///< Write a sequence or map on one line.
  std::vector<Node> items;                            ///< Of a sequence.
  std::vector<std::pair<std::string, Node>> entries;  ///< Of a map.
  int line = 0;                                       ///< First line is 1; 0 when made in memory.

  // Written in node.cpp: Clang cannot make them here, where the pair that holds a Node is not complete.
  Node();
  Node(const Node& other);
  Node(Node&& other) noexcept;
  Node& operator=(const Node& other);
  Node& operator=(Node&& other) noexcept;
  ~Node();

  /// Entry of a map, or null when absent.
  const Node* find(std::string_view key) const;
  /// Entry of a map, made when absent. Turns a null node into a map.
  Node& operator[](std::string_view key);

  static Node of(std::string text, bool quoted = false);
  /// Shortest text that reads back to the same double.
  static Node of(double value);
};

/// Parses YAML (of which JSON is a part). `source` names the text in errors.
/// @throws IoError with source and line for malformed text, a duplicate key, aliases nested beyond reason.
Node parse_yaml(std::string_view text, const std::string& source);
/// @throws IoError also when the file is missing, unreadable or empty.
Node load_yaml(const std::filesystem::path& file);
/// YAML text; `parse_yaml` gives the same tree back.
std::string to_yaml(const Node& node);
/// JSON text. Scalars that look like numbers or booleans and are not quoted are written as such; NaN becomes null.
std::string to_json(const Node& node, int indent = 1);

/// Whole text of a file. @throws IoError naming the file.
std::string read_text(const std::filesystem::path& file);
/// Writes beside the file and renames, so that a failure never leaves half a file. @throws IoError naming the file.
void write_text(const std::filesystem::path& file, std::string_view text);

}  // namespace kr5::io
