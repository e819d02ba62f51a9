// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/motors.hpp>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

namespace motors_test {

using namespace kr5;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

cell::Cell arc() { return cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"); }

}  // namespace

TEST_CASE("currents make the torques they are computed from") {
  const physics::Motors motors(arc());
  const MatrixXd torque = MatrixXd::Random(5, 6) * 50.0;
  const MatrixXd current = motors.currents(MatrixXd::Zero(5, 6), torque);
  for (Eigen::Index k = 0; k < 5; ++k)
    CHECK((motors.torques(current.row(k)) - torque.row(k).transpose()).cwiseAbs().maxCoeff() < 1e-10);
}

TEST_CASE("an accelerated rotor takes the torque of the rotor matrix") {
  const physics::Motors motors(arc());
  const VectorXd a = VectorXd::LinSpaced(6, -2.0, 3.0);
  const VectorXd current = motors.currents(a.transpose(), MatrixXd::Zero(1, 6)).transpose();
  CHECK((motors.torques(current) - motors.rotor_matrix() * a).cwiseAbs().maxCoeff() < 1e-10);
}

TEST_CASE("effects on motors replace the parameters of the cell") {
  cell::Cell cell = arc();
  cell.effects.set("torque_constant", "joint2", "torque_constant", 0.5);
  cell.effects.set("rotor_inertia", "joint1", "rotor_inertia", 7e-4);
  cell.effects.set("wrist_coupling", "motor6", "element", 3.0);
  cell.effects.set("wrist_coupling", "motor6", "value", -2.0);
  const physics::Motors motors(cell);
  CHECK(motors.torque_constant[1] == 0.5);
  CHECK(motors.rotor_inertia[0] == 7e-4);
  CHECK(motors.structure(5, 3) == -2.0);
  CHECK(motors.structure(5, 5) == arc().drives->structure(5, 5));
  cell.drives->structure.row(2).setZero();
  CHECK_THROWS_WITH(physics::Motors(cell), Catch::StartsWith("drives.structure: has no inverse"));
}

TEST_CASE("a controller reports the torques that its nominal constants make of currents") {
  cell::Cell cell = arc();
  const MatrixXd current = MatrixXd::Random(4, 6);
  const physics::Motors motors(cell);
  const MatrixXd reported = physics::reported_torques(cell, current);
  for (Eigen::Index k = 0; k < 4; ++k) {
    const VectorXd torques = motors.torques(current.row(k));
    CHECK((torques - reported.row(k).transpose()).cwiseAbs().maxCoeff() < 1e-10);
  }
  cell.effects.set("torque_constant", "joint2", "torque_constant", 0.5);  // which the controller does not know
  CHECK(physics::reported_torques(cell, current) == reported);
}

}  // namespace motors_test
