// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <sstream>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/predict/fast_simulator.hpp>
#include <kr5/sim/dart_simulator.hpp>
#include <kr5/sim/driven_arm.hpp>

using namespace kr5;
using cell::Kind;
using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// An arm by the types of its joints, r for revolute and p for prismatic: a SCARA-like one when it holds a slide, else
/// one whose axes cross at right angles in turn.
struct ArmCase {
  std::string joints;

  int size() const { return static_cast<int>(joints.size()); }
  bool slides(int i) const { return joints[static_cast<std::size_t>(i)] == 'p'; }
  bool planar() const { return joints.find('p') != std::string::npos; }
};

std::string list(int n, const std::function<double(int)>& value) {
  std::ostringstream out;
  out << "[";
  for (int i = 0; i < n; ++i) out << (i ? ", " : "") << value(i);
  out << "]";
  return out.str();
}

/// Lighter towards the tip, as arms are.
cell::Cell arm_cell(const ArmCase& arm) {
  const int n = arm.size();
  const double length = 1.6 / n;
  std::ostringstream out;
  out << "format: kr5-cell/1\nname: arm of " << n << " joints\nrobot:\n  T_B_0: [0, 0, 0.8, 0, 0, 0]\n  dh:\n";
  for (int i = 0; i < n; ++i) {
    const double twist = arm.planar() ? (i == 1 ? M_PI : 0.0) : (i % 2 ? M_PI_2 : -M_PI_2);
    out << "  - {type: " << (arm.slides(i) ? "prismatic" : "revolute")
        << ", theta_offset: 0, a: " << (arm.slides(i) ? 0.0 : (arm.planar() || i % 2 ? length : 0.02))
        << ", b: " << (i % 2 ? 0.03 : 0.5 * length) << ", alpha: " << twist << "}\n";
  }
  out << "  links:\n";
  for (int i = 0; i < n; ++i) {
    const double m = 12.0 * std::exp(-2.0 * i / n), l = length;
    out << "  - {mass: " << m << ", com: [" << -0.4 * l << ", 0.01, 0.02], inertia: [" << 0.02 * m << ", " << 0.03 * m
        << ", " << 0.025 * m << ", 0, 0, 0]}\n";
  }
  out << "drives:\n  structure:\n";
  for (int i = 0; i < n; ++i)
    out << "  - "
        << list(n, [&](int k) { return k == i ? (arm.slides(i) ? 600.0 : 100.0) : (k == i - 1 ? -1.0 : 0.0); }) << "\n";
  const auto falling = [&](double first) { return list(n, [=](int i) { return first * std::exp(-1.5 * i / n); }); };
  out << "  rotor_inertia: " << falling(4e-4) << "\n  torque_constant: " << falling(0.6)
      << "\n  friction: {coulomb: " << falling(20.0) << ", viscous: " << falling(25.0) << "}\n"
      << "servo: {cycle: 0.008, joint: {natural_frequency: 40, damping_ratio: 0.9, delay: 0.008}, tool: "
         "{natural_frequency: 5, damping_ratio: 0.8, delay: 0.016}}\n"
      << "tool: {T_F_E: [0, 0, 0.15, 0, 0, 0], T_F_S: [0, 0, 0.03, 0, 0, 0], mass: 1.2, com: [0.01, 0, 0.06], "
         "inertia: [0.004, 0.004, 0.002, 0, 0, 0]}\n"
      << "camera: {width: 1280, height: 1024, fx: 1400, fy: 1400, cx: 640, cy: 512, T_F_C: [0.05, 0, 0, 0, 0, 0]}\n"
      << "board: {rows: 2, cols: 3, marker: 0.03, gap: 0.01, T_B_W: [0.3, 0.1, 0, 0, 0, 0]}\n"
      << "laser: {T_F_L: [0, 0.05, 0, 0, 0, 0], target: {sphere: [0.5, 0, 0], radius: 0.05, plane: -0.1}}\n"
      << "contact: {stiffness: 20000, damping: 50, friction: 0.2}\n"
      << "noise: {current: 0.03, position: 2e-5, pose_position: 5e-5, pose_rotation: 8e-5, pixel: 0.1, force: 0.15, "
         "torque: 0.008, depth: 2e-5, laser: 4e-5}\n";
  return cell::parse_cell(out.str(), "arm of " + arm.joints);
}

double joint_value(const ArmCase& arm, int joint, double t) {
  const double reach = arm.slides(joint) ? 0.04 : 0.25, rate = 2.0 + 0.3 * joint;
  return 0.1 * (joint % 3) + reach * (1.0 - std::cos(rate * t));
}

/// The given columns of a short experiment of a kind.
cell::Experiment experiment_of(const ArmCase& arm, Kind kind, int rows) {
  cell::Experiment out;
  out.kind = kind;
  out.name = std::string(name_of(kind)) + "-1";
  for (const cell::Column& column : cell::columns(kind, arm.size()))
    if (column.role == cell::Role::Given) out.data.columns.push_back(column.name);
  out.data.values = Eigen::MatrixXd::Zero(rows, static_cast<Index>(out.data.columns.size()));
  for (int k = 0; k < rows; ++k) {
    const double t = kind == Kind::Motion || kind == Kind::Step || kind == Kind::Press ? 0.008 * k : 0.5 * k;
    for (Index c = 0; c < out.data.values.cols(); ++c) {
      const std::string& name = out.data.columns[static_cast<std::size_t>(c)];
      double& value = out.data.values(k, c);
      if (name == "t") value = t;
      if (name == "pose" || name == "view" || name == "line") value = k;
      if (name == "marker") value = k % 6;
      if (name == "speed") value = 0.01;
      if (name == "x") value = 0.001 * k;
      if (name == "zc") value = k < 10 ? 0.0 : -0.001;
      if (name[0] == 'q') value = joint_value(arm, std::stoi(name.substr(name[1] == 'c' ? 2 : 1)) - 1, t);
    }
  }
  return out;
}

double sigma(const cell::Noise& noise, const std::string& key) {
  double out = 1.0;
  cell::Noise::each_field(noise, [&](const char* name, const double& value, const char*) {
    if (key == name) out = value;
  });
  return out;
}

/// Largest RMS difference of any column of two tables, in noise; what neither shows is the same.
double difference(const cell::Cell& cell, Kind kind, const io::Table& a, const io::Table& b) {
  REQUIRE(a.columns == b.columns);
  REQUIRE(a.values.rows() == b.values.rows());
  double worst = 0.0;
  for (const cell::Column& column : cell::columns(kind, cell.robot.joints())) {
    if (a.find(column.name) < 0) continue;
    const VectorXd x = a.column(column.name), y = b.column(column.name);
    double squares = 0.0;
    for (Index k = 0; k < x.size(); ++k) {
      REQUIRE(std::isnan(x[k]) == std::isnan(y[k]));
      if (!std::isnan(x[k])) squares += (x[k] - y[k]) * (x[k] - y[k]);
    }
    worst = std::max(worst, std::sqrt(squares / static_cast<double>(x.size())) / sigma(cell.noise, column.noise));
  }
  return worst;
}

struct JointEffect {
  const char* id;
  std::vector<std::pair<std::string, double>> parameters;
};

const std::vector<JointEffect> joint_effects = {
    {"coulomb_friction", {{"coulomb", 40.0}}},
    {"load_friction", {{"coefficient", 0.2}}},
    {"rotor_inertia", {{"rotor_inertia", 9e-4}}},
    {"cable_spring", {{"stiffness", 60.0}, {"rest", 0.1}}},
    {"encoder_offset", {{"offset", 0.01}}},
    {"link_twist", {{"alpha", 0.3}}},
    {"transmission_error", {{"amplitude", 2e-3}, {"cycles", 5.0}}},
    {"joint_servo", {{"natural_frequency", 25.0}}},
    {"joint_elasticity", {{"stiffness", 5e4}}},
};

const std::vector<ArmCase> arms = {{"rrpr"}, {"rrrrrrr"}, {"rrrrrrrrrrrr"}};

}  // namespace

TEST_CASE("arms of 4, 7 and 12 joints: both simulators predict every kind, and the same") {
  for (const ArmCase& arm : arms) {
    const cell::Cell cell = arm_cell(arm);
    for (const Kind kind : {Kind::Motion, Kind::Poses, Kind::Views, Kind::Scan, Kind::Step, Kind::Press}) {
      const cell::Experiment e = experiment_of(arm, kind, kind == Kind::Motion ? 120 : 40);
      const io::Table fast = predict::FastSimulator().predict(cell, e), full = sim::DartSimulator().predict(cell, e);
      CAPTURE(arm.joints, name_of(kind));
      if (kind == Kind::Motion) CHECK(fast.columns.size() == static_cast<std::size_t>(2 * arm.size() + 6));
      CHECK(difference(cell, kind, fast, full) < 0.1);
    }
  }
}

TEST_CASE("arms of 4, 7 and 12 joints: an effect on any joint acts in both simulators, and the same") {
  for (const ArmCase& arm : arms) {
    const cell::Cell nominal = arm_cell(arm);
    const cell::Experiment e = experiment_of(arm, Kind::Motion, 60);
    const io::Table without = predict::FastSimulator().predict(nominal, e);
    const cell::Experiment resting = experiment_of(arm, Kind::Poses, 5);
    const io::Table resting_without = predict::FastSimulator().predict(nominal, resting);
    for (int joint = 0; joint < arm.size(); ++joint)
      for (const JointEffect& effect : joint_effects) {
        cell::Cell cell = nominal;
        const std::string target = "joint" + std::to_string(joint + 1);
        for (const auto& [name, value] : effect.parameters) cell::set_effect(cell, effect.id, target, name, value);
        const io::Table fast = predict::FastSimulator().predict(cell, e), full = sim::DartSimulator().predict(cell, e);
        CAPTURE(arm.joints, target, effect.id);
        // A joint may carry so little that its effect is small; the grades must agree on the effect there is.
        const double size = difference(nominal, Kind::Motion, fast, without);
        // About a vertical axis an offset does not show in loads, but in where the tool is.
        CHECK(std::max(size, difference(nominal, Kind::Poses, predict::FastSimulator().predict(cell, resting),
                                        resting_without)) > 0.0);
        CHECK(difference(nominal, Kind::Motion, fast, full) < 0.1 + 0.1 * size);
      }
  }
}

TEST_CASE("arms of 4, 7 and 12 joints: play in any joint lets the tool rest elsewhere, the same in both simulators") {
  for (const ArmCase& arm : arms) {
    const cell::Experiment e = experiment_of(arm, Kind::Poses, 10);
    double moved = 0.0;
    for (int joint = 0; joint < arm.size(); ++joint) {
      cell::Cell cell = arm_cell(arm);
      const io::Table without = predict::FastSimulator().predict(cell, e);
      cell::set_effect(cell, "backlash", "joint" + std::to_string(joint + 1), "gap", 2e-3);
      const io::Table fast = predict::FastSimulator().predict(cell, e), full = sim::DartSimulator().predict(cell, e);
      CAPTURE(arm.joints, joint);
      moved = std::max(moved, difference(cell, Kind::Poses, fast, without));
      CHECK(difference(cell, Kind::Poses, fast, full) < 0.1);
    }
    CHECK(moved > 1.0);
  }
}

TEST_CASE("arms of 4, 7 and 12 joints: motors under the currents of a motion make that motion") {
  for (const ArmCase& arm : arms) {
    const cell::Cell cell = arm_cell(arm);
    sim::DrivenArm arm_with_servos(cell), limited(cell, {0.0, VectorXd::Constant(arm.size(), 1e6)});
    VectorXd start(arm.size());
    for (int i = 0; i < arm.size(); ++i) start[i] = joint_value(arm, i, 0.0);
    arm_with_servos.reset(start), limited.reset(start);
    for (int k = 1; k <= 200; ++k) {
      VectorXd command(arm.size());
      for (int i = 0; i < arm.size(); ++i) command[i] = joint_value(arm, i, k * arm_with_servos.step());
      arm_with_servos.follow(command), limited.follow_limited(command);
    }
    CAPTURE(arm.joints);
    CHECK_FALSE(limited.read().limited);
    CHECK(limited.read().current.size() == arm.size());
    const VectorXd way = arm_with_servos.read().position - start;
    CHECK(way.norm() > 1e-3);
    CHECK((limited.read().position - arm_with_servos.read().position).norm() < 0.02 * way.norm());
  }
}
