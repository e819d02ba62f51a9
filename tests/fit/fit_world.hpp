#pragma once

#include <kr5/core/random.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// What the tests of fits measure.

namespace kr5::test {

inline Pose random_pose(Random& random, double distance = 0.5, double angle = 1.0) {
  Vector6 d;
  d << random.normal_vector(3, distance), random.normal_vector(3, angle);
  return to_pose(d);
}

inline kinematics::DhChain random_arm(Random& random, int joints) {
  kinematics::DhChain arm;
  for (int i = 0; i < joints; ++i) {
    kinematics::DhJoint joint;
    joint.type = random.integer(5) == 0 ? kinematics::JointType::Prismatic : kinematics::JointType::Revolute;
    joint.b = random.uniform(-0.4, 0.4);
    joint.theta_offset = random.uniform(-1, 1);
    joint.a = random.uniform(-0.5, 0.5);
    joint.alpha = random.uniform(-1.6, 1.6);
    joint.beta = random.uniform(-0.2, 0.2);
    arm.joints.push_back(joint);
  }
  return arm;
}

/// An arm measured by every kind of measurement; answers are what the fit must find from wrong starts.
struct World {
  kinematics::DhChain arm;
  Pose T_world_base, T_flange_tool;
  Eigen::Vector3d tip, socket;
};

inline World random_world(Random& random, int joints = 4) {
  World w;
  w.arm = random_arm(random, joints);
  w.T_world_base = random_pose(random);
  w.T_flange_tool = random_pose(random, 0.1);
  w.tip = random.normal_vector(3, 0.2);
  w.socket = random.normal_vector(3, 0.5);
  return w;
}

inline Pinhole lens() {
  Pinhole camera;
  camera.width = 1280, camera.height = 960;
  camera.fx = 1000, camera.fy = 1010, camera.cx = 640, camera.cy = 470;
  camera.k1 = -0.1, camera.p1 = 1e-3;
  return camera;
}

}  // namespace kr5::test
