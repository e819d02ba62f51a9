// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/columns.hpp>

namespace kr5::cell {
namespace {

struct Builder {
  int joints = 0;
  std::vector<Column> list;

  void given(const char* name, const char* unit) { list.push_back({name, Role::Given, unit, "", ""}); }
  void predicted(const std::string& name, const char* unit, const char* noise, const char* group = "") {
    list.push_back({name, Role::Predicted, unit, noise, group});
  }
  void each_joint(const std::string& name, Role role, const char* unit, const char* noise, const char* group) {
    for (int i = 1; i <= joints; ++i) list.push_back({name + std::to_string(i), role, unit, noise, group});
  }
  void joint_readings() { each_joint("q", Role::Given, "rad or m", "", ""); }
  void wrench() {
    for (const char* name : {"fx", "fy", "fz"}) predicted(name, "N", "force", "wrench");
    for (const char* name : {"tx", "ty", "tz"}) predicted(name, "N m", "torque", "wrench");
  }
};

void motion(Builder& b) {
  b.given("t", "s");
  b.each_joint("qc", Role::Given, "rad or m", "", "");
  b.each_joint("q", Role::Predicted, "rad or m", "position", "positions");
  b.each_joint("i", Role::Predicted, "A", "current", "currents");
  b.each_joint("tau", Role::Predicted, "N m or N", "torque", "torques");
  b.wrench();
}

void poses(Builder& b) {
  b.given("pose", "-");
  b.given("t", "s");
  b.joint_readings();
  for (const char* name : {"x", "y", "z"}) b.predicted(name, "m", "pose_position");
  for (const char* name : {"qw", "qx", "qy", "qz"}) b.predicted(name, "-", "pose_rotation", "orientation");
}

void views(Builder& b) {
  b.given("view", "-");
  b.given("t", "s");
  b.joint_readings();
  b.given("marker", "-");
  b.given("corner", "-");
  b.predicted("u", "px", "pixel");
  b.predicted("v", "px", "pixel");
}

void scan(Builder& b) {
  b.given("line", "-");
  b.given("t", "s");
  b.given("speed", "m/s");
  b.joint_readings();
  b.given("x", "m");
  b.predicted("z", "m", "laser");
  b.predicted("sphere", "-", "");
}

void step(Builder& b) {
  b.given("run", "-");
  b.given("t", "s");
  b.given("zc", "m");
  b.predicted("z", "m", "position");
}

void press(Builder& b) {
  step(b);
  b.wrench();
}

void profile(Builder& b) {
  b.given("run", "-");
  b.given("t", "s");
  b.given("tilt", "rad");
  b.given("alpha", "rad");
  b.given("cx", "m");
  b.given("cy", "m");
  b.given("fc", "N");
  b.predicted("z", "m", "depth");
  b.wrench();
}

}  // namespace

std::vector<Column> columns(Kind kind, int joints) {
  Builder b{joints, {}};
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
