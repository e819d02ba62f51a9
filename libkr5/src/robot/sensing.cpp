// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/robot/sensing.hpp>

#include <cmath>
#include <limits>

#include <kr5/core/error.hpp>

namespace kr5::robot {

Pose flange_pose(const kinematics::DhChain& arm, const JointVector& joints) noexcept {
  Pose T = arm.T_base_0;
  if (joints.size() != static_cast<Eigen::Index>(arm.joints.size()))
    T.matrix().setConstant(std::numeric_limits<double>::quiet_NaN());
  else
    for (Eigen::Index i = 0; i < joints.size(); ++i)
      T = T * arm.joints[static_cast<std::size_t>(i)].transform(joints[i]);
  return T;
}

void SensorModel::validate() const {
  require(arm.joints.size() <= max_joints, "arm: has more joints than a robot may have");
  require(T_flange_tool.matrix().allFinite() && is_rotation(T_flange_tool.linear()),
          "T_flange_tool: must be a rigid motion");
  require(T_flange_sensor.matrix().allFinite() && is_rotation(T_flange_sensor.linear()),
          "T_flange_sensor: must be a rigid motion");
  require(mass >= 0 && std::isfinite(mass), "mass: must not be negative [kg]");
  require(com.allFinite(), "com: must be finite [m]");
  require(gravity.allFinite(), "gravity: must be finite [m/s^2]");
}

Vector6 sensed_weight(double mass, const Eigen::Vector3d& com, const Eigen::Vector3d& gravity,
                      const Eigen::Matrix3d& R_base_sensor) noexcept {
  const Eigen::Vector3d force = mass * (R_base_sensor.transpose() * gravity);
  Vector6 out;
  out << force, com.cross(force);
  return out;
}

Vector6 sensed_wrench(const SensorModel& model, const Pose& T_base_flange, const Vector6& wrench) noexcept {
  const Pose T_base_sensor = T_base_flange * model.T_flange_sensor;
  const Eigen::Matrix3d R_sensor_base = T_base_sensor.linear().transpose();
  const Eigen::Vector3d tip = T_base_flange * model.T_flange_tool.translation(), force = wrench.head<3>();
  Vector6 out;
  out << R_sensor_base * force, R_sensor_base * (wrench.tail<3>() + (tip - T_base_sensor.translation()).cross(force));
  return out + sensed_weight(model.mass, model.com, model.gravity, T_base_sensor.linear());
}

RobotReading robot_reading(const SensorModel& model, const SensorValues& values) noexcept {
  return robot_reading(model, values, flange_pose(model.arm, values.joints));
}

RobotReading robot_reading(const SensorModel& model, const SensorValues& values, const Pose& T_base_flange) noexcept {
  RobotReading out;
  out.time = values.time;
  out.joints = values.joints;
  out.efforts = values.efforts;
  out.currents = values.currents;
  out.T_base_flange = T_base_flange;
  out.T_base_tool = T_base_flange * model.T_flange_tool;
  out.sensor = values.sensor;
  const Pose T_base_sensor = T_base_flange * model.T_flange_sensor;
  const Vector6 touch = values.sensor - sensed_weight(model.mass, model.com, model.gravity, T_base_sensor.linear());
  const Eigen::Vector3d force = T_base_sensor.linear() * touch.head<3>();
  out.wrench << force, T_base_sensor.linear() * touch.tail<3>() +
                           (T_base_sensor.translation() - out.T_base_tool.translation()).cross(force);
  out.status = values.status;
  return out;
}

}  // namespace kr5::robot
