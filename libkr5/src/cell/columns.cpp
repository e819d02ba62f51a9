// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/columns.hpp>

#include <algorithm>
#include <map>
#include <utility>

#include <kr5/cell/servo_gain.hpp>
#include <kr5/core/error.hpp>

namespace kr5::cell {
namespace {

/// More joints than any arm has: for columns that are asked for by name alone.
constexpr int most_column_joints = 100;

/// What columns that follow each other have in common.
struct Part {
  std::string target;
  std::string subsystem;
};

struct Builder {
  int joints = 0;
  std::vector<Column> list = {};

  void given(const char* name, const char* unit, const char* label) {
    list.push_back({.name = name, .unit = unit, .label = label});
  }
  void predicted(const Part& part, const std::string& name, const char* unit, const char* noise, const char* channel,
                 std::string label, const char* group = "") {
    list.push_back({.name = name,
                    .role = Role::Predicted,
                    .unit = unit,
                    .noise = noise,
                    .group = group,
                    .target = part.target,
                    .subsystem = part.subsystem,
                    .channel = channel,
                    .label = std::move(label)});
  }
  /// Columns `name1`, `name2`, ...; what they say in words goes before "of joint 1".
  void each_joint(const std::string& name, const Column& like) {
    for (int i = 1; i <= joints; ++i) {
      Column& column = list.emplace_back(like);
      const std::string number = std::to_string(i);
      column.name = name + number;
      column.target = "joint" + number;
      column.joint = i - 1;
      column.label += " of joint " + number;
    }
  }
  void joint_readings() { each_joint("q", {.unit = "rad or m", .label = "position"}); }

  /// A force acts on what `force_targets` says in this order, or is a component of the wrench like any other.
  void wrench(const std::string& where, const std::map<std::string, std::string>& force_targets = {}) {
    const std::string sensor = "wrist sensor";
    const auto add = [&](const Part& part, const std::string& name, const char* unit, const char* noise,
                         const char* channel, const std::string& component) {
      predicted(part, name, unit, noise, channel, component + " " + where, "wrench");
      list.back().component = component;
    };
    for (const std::string axis : {"x", "y", "z"}) {
      const auto target = force_targets.find("f" + axis);
      add({target == force_targets.end() ? "f" + axis : target->second, sensor}, "f" + axis, "N", "force", "force",
          "force " + axis);
    }
    for (const std::string axis : {"x", "y", "z"})
      add({"t" + axis, sensor}, "t" + axis, "N m", "torque", "moment", "torque about " + axis);
  }
};

void motion(Builder& b) {
  b.given("t", "s", "time");
  b.each_joint("qc", {.unit = "rad or m", .label = "commanded position"});
  b.each_joint("q", {.role = Role::Predicted,
                     .unit = "rad or m",
                     .noise = "position",
                     .group = "positions",
                     .subsystem = "encoders and joint servo",
                     .channel = "joint angle",
                     .label = "position"});
  b.each_joint("i", {.role = Role::Predicted,
                     .unit = "A",
                     .noise = "current",
                     .group = "currents",
                     .subsystem = "drives",
                     .channel = "motor current",
                     .label = "current"});
  b.each_joint("tau", {.role = Role::Predicted,
                       .unit = "N m or N",
                       .noise = "torque",
                       .group = "torques",
                       .subsystem = "drives",
                       .channel = "joint torque",
                       .label = "torque"});
  b.wrench("at the wrist");
  b.list.push_back({.name = servo_gain_column,
                    .unit = "-",
                    .group = servo_gain_column,  // of its own, since it need not be there
                    .label = "gain of the torque servos over that of the cell, 0 while they are off"});
}

const Part tool{"tool", "arm geometry"};

void poses(Builder& b) {
  b.given("pose", "-", "number of the pose");
  b.given("t", "s", "time");
  b.joint_readings();
  for (const std::string axis : {"x", "y", "z"})
    b.predicted(tool, axis, "m", "pose_position", "position", "position " + axis + " of the tool");
  for (const std::string part : {"w", "x", "y", "z"})
    b.predicted(tool, "q" + part, "-", "pose_rotation", "orientation", "quaternion " + part + " of the tool",
                "orientation");
}

void views(Builder& b) {
  b.given("view", "-", "number of the view");
  b.given("t", "s", "time");
  b.joint_readings();
  b.given("marker", "-", "number of the marker");
  b.given("corner", "-", "number of the corner");
  for (const std::string axis : {"u", "v"})
    b.predicted({"camera", "camera"}, axis, "px", "pixel", "pixel", "image coordinate " + axis + " of the board");
}

void scan(Builder& b) {
  const Part scanner{"laser", "line scanner"};
  b.given("line", "-", "number of the line");
  b.given("t", "s", "time");
  b.given("speed", "m/s", "scanning speed");
  b.joint_readings();
  b.given("x", "m", "place along the profile");
  b.predicted(scanner, "z", "m", "laser", "position", "range of the scanner");
  b.predicted(scanner, "sphere", "-", "", "position", "whether the ray meets the sphere");
}

void path_correction(Builder& b, const char* label) {
  b.given("run", "-", "number of the run");
  b.given("t", "s", "time");
  b.given("zc", "m", "commanded height");
  b.predicted({"servo", "path correction"}, "z", "m", "position", "position", label);
}

void step(Builder& b) { path_correction(b, "height during steps"); }

void press(Builder& b) {
  path_correction(b, "height while pressing");
  b.wrench("while pressing", {{"fz", "contact"}});
}

void profile(Builder& b) {
  b.given("run", "-", "number of the run");
  b.given("t", "s", "time");
  b.given("tilt", "rad", "tilt of the peg");
  b.given("alpha", "rad", "direction of the tilt");
  b.given("cx", "m", "place x of the peg");
  b.given("cy", "m", "place y of the peg");
  b.given("fc", "N", "held force");
  b.predicted({"tube", "peg and tube"}, "z", "m", "depth", "position", "resting depth of the peg");
  b.wrench("on the peg");
}

}  // namespace

std::vector<Column> columns(Kind kind, int joints) {
  Builder b{joints};
  switch (kind) {
    case Kind::Motion:
      motion(b);
      break;
    case Kind::Poses:
      poses(b);
      break;
    case Kind::Views:
      views(b);
      break;
    case Kind::Scan:
      scan(b);
      break;
    case Kind::Step:
      step(b);
      break;
    case Kind::Press:
      press(b);
      break;
    case Kind::Profile:
      profile(b);
      break;
  }
  return std::move(b.list);
}

std::vector<Column> compared_columns(Kind kind, int joints) {
  std::vector<Column> out = columns(kind, joints);
  std::erase_if(out, [](const Column& c) {
    return c.role != Role::Predicted || c.noise.empty() || c.group == orientation_group;
  });
  if (kind != Kind::Poses) return out;
  Builder b{joints, std::move(out)};
  for (const std::string axis : {"x", "y", "z"})
    b.predicted(tool, "r" + axis, "rad", "pose_rotation", "orientation", "orientation of the tool about " + axis,
                orientation_group);
  return std::move(b.list);
}

const Column& find_column(Kind kind, const std::string& name) {
  using ByName = std::map<std::string, Column>;
  static const auto all = [] {
    std::map<Kind, ByName> out;
    for (const auto& [each, text] : enum_names(Kind{})) {
      for (Column& c : columns(each, most_column_joints)) out[each].emplace(c.name, std::move(c));
      for (Column& c : compared_columns(each, most_column_joints)) out[each].emplace(c.name, std::move(c));
    }
    return out;
  }();
  const ByName& columns = all.at(kind);
  const auto found = columns.find(name);
  require(found != columns.end(), std::string(name_of(kind)) + " has no column '" + name + "'");
  return found->second;
}

std::string run_column(Kind kind) {
  switch (kind) {
    case Kind::Motion:
      return "";
    case Kind::Poses:
      return "pose";
    case Kind::Views:
      return "view";
    case Kind::Scan:
      return "line";
    case Kind::Step:
    case Kind::Press:
    case Kind::Profile:
      return "run";
  }
  return "";
}

}  // namespace kr5::cell
