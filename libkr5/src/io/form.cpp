// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/io/form.hpp>

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
      out.entries.emplace_back(key, keep_form(*wanted, *had, written));
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

bool same(const Node& a, const Node& b) {
  if (a.kind != b.kind || a.scalar != b.scalar || a.items.size() != b.items.size() ||
      a.entries.size() != b.entries.size())
    return false;
  for (std::size_t i = 0; i < a.items.size(); ++i)
    if (!same(a.items[i], b.items[i])) return false;
  for (std::size_t i = 0; i < a.entries.size(); ++i)
    if (a.entries[i].first != b.entries[i].first || !same(a.entries[i].second, b.entries[i].second)) return false;
  return true;
}

Node keep_form(const Node& now, const Node& then, const Node& source) {
  if (same(now, then)) return source;
  if (now.kind != source.kind || then.kind != source.kind) return now;
  if (now.kind == Node::Kind::Map) return merge_maps(now, then, source);
  if (now.kind != Node::Kind::Sequence || now.items.size() != source.items.size() ||
      then.items.size() != source.items.size())
    return now;
  Node out = source;
  for (std::size_t i = 0; i < now.items.size(); ++i)
    out.items[i] = keep_form(now.items[i], then.items[i], source.items[i]);
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
