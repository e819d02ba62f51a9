#include <kr5/robot/sensing.hpp>

#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

namespace sensing_test {

using namespace kr5;
using namespace kr5::robot;
using Eigen::Vector3d;

namespace {

/// An arm of one turning joint about Z of the base, half a metre long, its tool and sensor turned against it.
SensorModel model() {
  SensorModel out;
  out.arm.joints = {{.a = 0.5}};
  out.T_flange_sensor = to_pose((Vector6() << 0.0, 0.0, 0.05, M_PI, 0.0, 0.3).finished());
  out.T_flange_tool = to_pose((Vector6() << 0.0, 0.02, 0.2, 0.1, 0.0, 0.0).finished());
  out.mass = 2.0;
  out.com = Vector3d(0.01, -0.02, 0.08);
  return out;
}

}  // namespace

TEST_CASE("a reading has the pose of the tool by the joints, and no weight where nothing touches") {
  const SensorModel arm = model();
  SensorValues values;
  values.time = 3.5;
  values.joints = JointVector::Constant(1, M_PI_2);
  values.efforts = JointVector::Constant(1, 4.0);
  values.currents = JointVector::Constant(1, 0.7);
  values.status.saturated = true;
  const Pose T_base_sensor = arm.arm.flange(values.joints) * arm.T_flange_sensor;
  const Vector3d weight = T_base_sensor.linear().transpose() * Vector3d(0, 0, -2.0 * 9.81);
  values.sensor << weight, arm.com.cross(weight);
  const RobotReading r = robot_reading(arm, values);
  CHECK(r.T_base_flange.translation().isApprox(Vector3d(0, 0.5, 0), 1e-12));
  CHECK(r.T_base_tool.translation().isApprox(Vector3d(-0.02, 0.5, 0.2), 1e-12));
  CHECK(r.wrench.norm() < 1e-12);
  CHECK(r.sensor == values.sensor);
  CHECK((r.time == 3.5 && r.joints == values.joints && r.efforts == values.efforts && r.currents == values.currents));
  CHECK(r.status.saturated);
}

TEST_CASE(
    "what touches the tool is felt about its tip, in axes of the base, and what a sensor reads of it comes back") {
  const SensorModel arm = model();
  const JointVector q = JointVector::Constant(1, 0.8);
  const Pose T_base_flange = arm.arm.flange(q);
  Vector6 wrench;
  wrench << 3.0, -4.0, 12.0, 0.2, 0.5, -0.1;
  SensorValues values;
  values.joints = q;
  values.sensor = sensed_wrench(arm, T_base_flange, wrench);
  CHECK(robot_reading(arm, values).wrench.isApprox(wrench, 1e-12));
  // A push on the tip along the line from the sensor has no moment about either.
  SensorModel bare = arm;
  bare.mass = 0.0;
  const Vector3d tip = T_base_flange * bare.T_flange_tool.translation();
  const Vector3d line = tip - T_base_flange * bare.T_flange_sensor.translation();
  Vector6 along = Vector6::Zero();
  along.head<3>() = 10.0 * line.normalized();
  CHECK(sensed_wrench(bare, T_base_flange, along).tail<3>().norm() < 1e-12);
  CHECK(sensed_wrench(bare, T_base_flange, along).head<3>().norm() == Approx(10.0));
}

TEST_CASE("joints of another arm give a pose that is no number; a model that is none is refused by name") {
  SensorValues values;
  values.joints = JointVector::Zero(2);
  CHECK(robot_reading(model(), values).T_base_tool.matrix().hasNaN());
  SensorModel bad = model();
  bad.mass = -1.0;
  CHECK_THROWS_WITH(bad.validate(), Catch::Contains("mass"));
  bad = model();
  bad.T_flange_tool.linear() *= 1.1;
  CHECK_THROWS_WITH(bad.validate(), Catch::Contains("T_flange_tool"));
}

}  // namespace sensing_test
