#pragma once

#include <algorithm>
#include <string>

#include <catch2/catch.hpp>

#include <kr5/cell/cell.hpp>
#include <kr5/kinematics/newton_euler.hpp>

#include "kinematics/random_chain.hpp"

/// @file
/// Arms that go to a URDF and back.

namespace kr5::test {

/// An arm with every parameter at random, and a tool.
inline cell::Cell random_cell(unsigned seed) {
  Random random(seed);
  cell::Cell cell;
  const int n = 1 + static_cast<int>(seed % 8);
  const kinematics::DhChain chain = random_chain(random, n);
  cell.robot.T_base_0 = chain.T_base_0;
  cell.robot.dh = chain.joints;
  for (const kinematics::Body& b : random_bodies(random, n)) cell.robot.links.push_back({b.mass, b.com, b.inertia});
  cell.robot.limits = cell::Limits{
      Eigen::VectorXd::Constant(n, -2), Eigen::VectorXd::Constant(n, 1.5), Eigen::VectorXd::Constant(n, 3), {}};
  const kinematics::Body b = random_body(random);
  cell.tool = cell::Tool{random_pose(random), random_pose(random), b.mass, b.com, b.inertia};
  return cell;
}

inline Eigen::VectorXd torques(const cell::Cell& cell, const Eigen::VectorXd& q, const Eigen::VectorXd& qd,
                               const Eigen::VectorXd& qdd) {
  kinematics::Dynamics dynamics(nominal_chain(cell), cell.robot.links, cell.robot.gravity);
  if (cell.tool)
    dynamics.add_body(-1, {cell.tool->mass, cell.tool->com, cell.tool->inertia}, cell.tool->T_flange_sensor);
  return dynamics.torques(q, qd, qdd);
}

/// Greatest difference of tip pose and torques at random states.
inline double difference(const cell::Cell& a, const cell::Cell& b) {
  Random random(99);
  const int n = a.robot.joints();
  double worst = 0;
  for (int k = 0; k < 20; ++k) {
    const Eigen::VectorXd q = random_vector(random, n, 3), qd = random_vector(random, n, 2),
                          qdd = random_vector(random, n, 4);
    worst = std::max(worst, (T_base_tool(a, q).matrix() - T_base_tool(b, q).matrix()).cwiseAbs().maxCoeff());
    if (a.robot.links.empty() || b.robot.links.empty()) continue;
    const Eigen::VectorXd tau = torques(a, q, qd, qdd);
    worst = std::max(worst, (tau - torques(b, q, qd, qdd)).norm() / (1 + tau.norm()));
  }
  return worst;
}

inline const std::string two_joints = R"(<?xml version="1.0"?>
<robot name="two">
  <link name="world"/>
  <link name="a"><inertial><origin xyz="0.1 0 0" rpy="0 0 1"/><mass value="2"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.2"/></inertial></link>
  <link name="b"><inertial><mass value="1"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <link name="tip"/>
  <joint name="j1" type="revolute"><origin xyz="0 0 0.3"/><parent link="world"/><child link="a"/>
    <axis xyz="0 2 0"/><limit lower="-1" upper="2" effort="0" velocity="3"/></joint>
  <joint name="j2" type="continuous"><origin xyz="0.5 0 0"/><parent link="a"/><child link="b"/>
    <axis xyz="0 0 -1"/><dynamics damping="0.1"/></joint>
  <joint name="j3" type="fixed"><origin xyz="0 0 0.1"/><parent link="b"/><child link="tip"/></joint>
</robot>)";

inline std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  REQUIRE(at != std::string::npos);
  return text.replace(at, what.size(), by);
}

}  // namespace kr5::test
