// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// @file
/// A YAML (or JSON) document as a tree that keeps the line of every node, so that each diagnostic can name file, line
/// and field. YAML::Node is not used: it drops duplicate keys, quotes and the lines of keys.

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

  static Node make_scalar(std::string text, bool quoted = false);
  /// Shortest text that reads back to the same double.
  static Node make_scalar(double value);
};

/// Same kind, text, items and entries; layout and lines are not compared.
bool operator==(const Node& a, const Node& b);

/// Parses YAML (of which JSON is a part). `source` names the text in errors.
/// @throws IoError with source and line for malformed text, a duplicate key, aliases nested beyond reason.
Node parse_yaml(std::string_view text, const std::string& source);
/// @throws IoError also when the file is missing, unreadable or empty.
Node load_yaml(const std::filesystem::path& file);
/// YAML text; `parse_yaml` gives the same tree back.
std::string to_yaml(const Node& node);

/// Whole text of a file. @throws IoError naming the file.
std::string read_text(const std::filesystem::path& file);
/// Writes beside the file and renames, so that a failure never leaves half a file; follows links, and writes straight
/// into what is no regular file. @throws IoError naming the file.
void write_text(const std::filesystem::path& file, std::string_view text);

}  // namespace kr5::io
