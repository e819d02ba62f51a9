// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/io/fields.hpp>

#include <algorithm>
#include <cctype>
#include <set>

namespace kr5::io {

Node to_node(double value) { return Node::make_scalar(value); }
Node to_node(int value) { return Node::make_scalar(std::to_string(value)); }
Node to_node(bool value) { return Node::make_scalar(std::string(value ? "true" : "false")); }

Node to_node(const std::string& value) {
  // What any YAML reader could take for a number, a date, a truth value or nothing is quoted.
  static const std::set<std::string> words = {"true", "false", "yes", "no", "on", "off", "y", "n", "null"};
  std::string lower = value;
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool plain =
      !value.empty() && (std::isalpha(static_cast<unsigned char>(value[0])) || value[0] == '_' || value[0] == '/');
  return Node::make_scalar(value, !plain || words.contains(lower));
}

Node to_node(const Eigen::Isometry3d& T) { return to_node(Eigen::MatrixXd(T.matrix())); }

}  // namespace kr5::io
