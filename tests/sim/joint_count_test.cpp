// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/predict/fast_simulator.hpp>
#include <kr5/sim/dart_simulator.hpp>
#include <kr5/sim/driven_arm.hpp>

#include "support/arm_cells.hpp"

namespace joint_count_test {

using namespace kr5;
using cell::Kind;
using Eigen::Index;
using Eigen::VectorXd;
using test::arm_cell;
using test::ArmCase;
using test::joint_value;

namespace {

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
  const double out = noise.of(key);
  return out > 0 ? out : 1.0;
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
    {"quadratic_drag", {{"quadratic", 30.0}}},
    {"angle_friction", {{"amplitude", 15.0}, {"cycles", 3.0}}},
    {"rotor_inertia", {{"rotor_inertia", 9e-4}}},
    {"cable_spring", {{"stiffness", 60.0}, {"rest", 0.1}}},
    {"encoder_offset", {{"offset", 0.01}}},
    {"link_twist", {{"alpha", 0.3}}},
    {"link_mass", {{"mass", 9.3}}},
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

}  // namespace joint_count_test
