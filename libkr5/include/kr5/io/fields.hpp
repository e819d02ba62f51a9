// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <kr5/core/error.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/io/diagnostic.hpp>
#include <kr5/io/node.hpp>
#include <kr5/io/reader.hpp>

/// @file
/// Any struct with a field list to and from a Node. Unknown keys and wrong types are collected as diagnostics with
/// line, field, the value found and what was expected, all in one pass.

namespace kr5::io {

Node to_node(double value);
Node to_node(int value);
Node to_node(bool value);
Node to_node(const std::string& value);
Node to_node(const Eigen::Isometry3d& T);  ///< As a 4x4 matrix, so that nothing is lost.

template <HasNames E>
Node to_node(E value) {
  return Node::make_scalar(std::string(name_of(value)));
}
template <int R, int C>
Node to_node(const Eigen::Matrix<double, R, C>& value);
template <class T>
Node to_node(const std::vector<T>& value);
template <class T>
Node to_node(const std::map<std::string, T>& value);
template <CustomSerializable T>
Node to_node(const T& value);
template <HasFields T>
requires(!CustomSerializable<T>) Node to_node(const T& value);

template <class T>
Node to_node(const std::optional<T>& value) {
  return value ? to_node(*value) : Node{};
}

template <int R, int C>
Node to_node(const Eigen::Matrix<double, R, C>& value) {
  Node node;
  node.kind = Node::Kind::Sequence;
  node.flow = true;
  for (Eigen::Index i = 0; i < value.rows(); ++i) {
    if constexpr (C == 1) {
      node.items.push_back(to_node(value(i)));
    } else {
      node.flow = false;
      Node& row = node.items.emplace_back();  // by hand: a row of a matrix without columns points nowhere in Eigen
      row.kind = Node::Kind::Sequence;
      row.flow = true;
      for (Eigen::Index j = 0; j < value.cols(); ++j) row.items.push_back(to_node(value(i, j)));
    }
  }
  return node;
}

template <class T>
Node to_node(const std::vector<T>& value) {
  Node node;
  node.kind = Node::Kind::Sequence;
  node.flow = !HasFields<T>;
  for (const auto& item : value) node.items.push_back(to_node(static_cast<const T&>(item)));
  return node;
}

template <class T>
Node to_node(const std::map<std::string, T>& value) {
  Node node;
  node.kind = Node::Kind::Map;
  for (const auto& [key, item] : value) node.entries.emplace_back(key, to_node(item));
  return node;
}

template <CustomSerializable T>
Node to_node(const T& value) {
  return value.to_node();
}

template <HasFields T>
requires(!CustomSerializable<T>) Node to_node(const T& value) {
  Node node;
  node.kind = Node::Kind::Map;
  T::each_field(value, [&](const char* name, const auto& member, const char*) {
    node.entries.emplace_back(file_key<T>(name), to_node(member));
  });
  return node;
}

/// Reads a struct from a YAML file; fields that are absent keep their defaults.
/// @throws IoError listing every problem with file, line, field, value found and what was expected.
template <HasFields T>
T load(const std::filesystem::path& file) {
  T value;
  Reader reader(file.string());
  reader.read(load_yaml(file), "", value);
  reader.finish();
  if constexpr (HasValidate<T>) value.validate();
  return value;
}

/// Writes a struct as YAML.
template <HasFields T>
void save(const T& value, const std::filesystem::path& file) {
  write_text(file, to_yaml(to_node(value)));
}

}  // namespace kr5::io
