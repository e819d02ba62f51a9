// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <string_view>
#include <type_traits>
#include <vector>

#include <kr5/io/fields.hpp>

/// @file
/// Writing a file with its format preserved: keys at their defaults are left out, and unchanged values keep the form in
/// which they were read.

namespace kr5::io {

/// `now` in the format of `source`, from which `then` was read: values that are equal in `now` and `then` are taken
/// from `source` as they stand there. `now` and `then` must come from the same writer.
Node merge_preserving_format(const Node& now, const Node& then, const Node& source);

/// Six numbers `x y z roll pitch yaw` where they give back exactly this pose, otherwise a 4x4 matrix.
Node pose_node(const Eigen::Isometry3d& T);

template <class T>
struct IsVector : std::false_type {};
template <class T>
struct IsVector<std::vector<T>> : std::true_type {};

/// Tree of a value without the keys that stand at their defaults, except those a struct requires.
template <class T>
Node to_short_node(const T& value);

namespace detail {

template <HasFields T>
bool is_required(std::string_view name) {
  if constexpr (HasRequired<T>) return std::find(T::required.begin(), T::required.end(), name) != T::required.end();
  return false;
}

template <HasFields T>
Node short_map(const T& value) {
  constexpr std::size_t most_on_a_line = 4;
  std::vector<Node> defaults;
  const T unset{};
  T::each_field(unset, [&](const char*, const auto& member, const char*) { defaults.push_back(to_node(member)); });
  Node node;
  node.kind = Node::Kind::Map;
  std::size_t i = 0;
  T::each_field(value, [&](const char* name, const auto& member, const char*) {
    if (!(to_node(member) == defaults[i++]) || is_required<T>(file_key<T>(name)))
      node.entries.emplace_back(file_key<T>(name), to_short_node(member));
  });
  node.flow = node.entries.size() <= most_on_a_line &&
              std::all_of(node.entries.begin(), node.entries.end(),
                          [](const auto& entry) { return entry.second.kind == Node::Kind::Scalar; });
  return node;
}

}  // namespace detail

template <class T>
Node to_short_node(const T& value) {
  if constexpr (CustomSerializable<T>) {
    return value.to_node();
  } else if constexpr (HasFields<T>) {
    return detail::short_map(value);
  } else if constexpr (std::is_same_v<T, Eigen::Isometry3d>) {
    return pose_node(value);
  } else if constexpr (IsVector<T>::value) {
    Node node = to_node(T{});
    for (const auto& item : value) node.items.push_back(to_short_node(item));
    return node;
  } else if constexpr (requires { value.has_value(); }) {
    return value ? to_short_node(*value) : Node{};
  } else {
    return to_node(value);
  }
}

}  // namespace kr5::io
