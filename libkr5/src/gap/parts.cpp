// SPDX-License-Identifier: BSD-3-Clause
#include "gap/parts.hpp"

#include <algorithm>
#include <cmath>

namespace kr5::gap {
namespace {

bool of_wrench(const std::string& column) { return column[0] == 'f' || (column[0] == 't' && column.size() == 2); }

std::string subsystem_of(const ColumnGap& c) {
  if (of_wrench(c.column)) return "wrist sensor";
  switch (c.kind) {
    case cell::Kind::Motion:
      return c.column[0] == 'q' ? "encoders and joint servo" : "drives";
    case cell::Kind::Poses:
      return "arm geometry";
    case cell::Kind::Views:
      return "camera";
    case cell::Kind::Scan:
      return "line scanner";
    case cell::Kind::Step:
    case cell::Kind::Press:
      return "path correction";
    case cell::Kind::Profile:
      return "peg and tube";
  }
  return "";
}

std::string channel_of(const ColumnGap& c) {
  if (of_wrench(c.column)) return c.column[0] == 'f' ? "force" : "moment";
  if (c.column.starts_with("tau")) return "joint torque";
  if (c.kind == cell::Kind::Motion) return c.column[0] == 'q' ? "joint angle" : "motor current";
  if (c.kind == cell::Kind::Views) return "pixel";
  return c.column[0] == 'r' ? "orientation" : "position";
}

/// Columns of one name, first seen first; then the widest gap first.
template <typename Name>
void append(const std::vector<ColumnGap>& columns, const std::string& by, const Name& name, std::vector<GapPart>& out) {
  const auto excess = [](const ColumnGap& c) { return c.exceeds ? c.gap * c.gap - 1 : 0.0; };
  std::vector<GapPart> parts;
  double all = 0.0;
  for (const ColumnGap& c : columns) {
    const std::string own = name(c);
    auto part = std::find_if(parts.begin(), parts.end(), [&](const GapPart& p) { return p.name == own; });
    if (part == parts.end()) part = parts.insert(parts.end(), {by, own});
    part->columns += 1;
    part->exceeding += c.exceeds ? 1 : 0;
    part->gap += c.gap * c.gap;
    part->share += excess(c);
    all += excess(c);
  }
  for (GapPart& part : parts) {
    part.gap = std::sqrt(part.gap / part.columns);
    if (all > 0) part.share /= all;
  }
  std::stable_sort(parts.begin(), parts.end(), [](const GapPart& a, const GapPart& b) { return a.gap > b.gap; });
  out.insert(out.end(), parts.begin(), parts.end());
}

}  // namespace

std::string target_of(cell::Kind kind, const std::string& column) {
  switch (kind) {
    case cell::Kind::Motion:
      if (column.starts_with("tau")) return "joint" + column.substr(3);
      return column[0] == 'q' || column[0] == 'i' ? "joint" + column.substr(1) : column;
    case cell::Kind::Poses:
      return "tool";
    case cell::Kind::Views:
      return "camera";
    case cell::Kind::Scan:
      return "laser";
    case cell::Kind::Step:
      return "servo";
    case cell::Kind::Press:
      return column == "z" ? "servo" : column == "fz" ? "contact" : column;
    case cell::Kind::Profile:
      return column == "z" ? "tube" : column;
  }
  return column;
}

std::vector<GapPart> parts_of(const std::vector<ColumnGap>& columns) {
  std::vector<GapPart> out;
  append(columns, "subsystem", subsystem_of, out);
  append(
      columns, "target", [](const ColumnGap& c) { return c.target; }, out);
  append(columns, "channel", channel_of, out);
  append(
      columns, "experiment", [](const ColumnGap& c) { return c.experiment; }, out);
  return out;
}

}  // namespace kr5::gap
