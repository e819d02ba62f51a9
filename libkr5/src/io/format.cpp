// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/io/format.hpp>

#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <kr5/geometry/pose.hpp>

namespace kr5::io {
namespace {

Node merge_maps(const Node& now, const Node& then, const Node& source) {
  Node out;
  out.kind = Node::Kind::Map;
  out.flow = source.flow;
  out.line = source.line;
  for (const auto& [key, written] : source.entries) {
    const Node *wanted = now.find(key), *had = then.find(key);
    if (wanted && had)
      out.entries.emplace_back(key, merge_preserving_format(*wanted, *had, written));
    else if (wanted)
      out.entries.emplace_back(key, *wanted);
    else if (!had)
      out.entries.emplace_back(key, written);  // a default that was spelled out, or a key of another reader
  }
  for (const auto& [key, entry] : now.entries)
    if (!source.find(key)) out.entries.emplace_back(key, entry);
  return out;
}

/// Digits that a person typed come back when the rounding of the angles is undone.
Vector6 rounded(const Vector6& v, int digits) {
  Vector6 out;
  char text[40];
  for (int i = 0; i < 6; ++i) {
    std::snprintf(text, sizeof text, "%.*g", digits, v[i]);
    out[i] = std::strtod(text, nullptr);
  }
  return out;
}

bool identical(const Pose& a, const Pose& b) {
  return std::memcmp(a.matrix().data(), b.matrix().data(), 16 * sizeof(double)) == 0;
}

}  // namespace

Node merge_preserving_format(const Node& now, const Node& then, const Node& source) {
  if (now == then) return source;
  if (now.kind != source.kind || then.kind != source.kind) return now;
  if (now.kind == Node::Kind::Map) return merge_maps(now, then, source);
  if (now.kind != Node::Kind::Sequence || now.items.size() != source.items.size() ||
      then.items.size() != source.items.size())
    return now;
  Node out = source;
  for (std::size_t i = 0; i < now.items.size(); ++i)
    out.items[i] = merge_preserving_format(now.items[i], then.items[i], source.items[i]);
  return out;
}

Node pose_node(const Pose& T) {
  const Vector6 exact = to_xyzrpy(T);
  for (const int digits : {17, 15, 16}) {
    const Vector6 v = rounded(exact, digits);
    if (identical(from_xyzrpy(v), T)) return to_node(v);
  }
  return to_node(T);
}

}  // namespace kr5::io
