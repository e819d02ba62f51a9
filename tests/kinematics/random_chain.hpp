#pragma once

#include <vector>

#include <kr5/core/random.hpp>
#include <kr5/kinematics/body.hpp>
#include <kr5/kinematics/dh_chain.hpp>

namespace kr5::test {

inline Eigen::VectorXd random_vector(Random& random, int size, double scale = 1.0) {
  return Eigen::VectorXd::NullaryExpr(size, [&] { return random.uniform(-scale, scale); });
}

inline Pose random_pose(Random& random) {
  Pose T = to_pose(Vector6(random_vector(random, 6)));
  T.linear() = exp_rotation(random_vector(random, 3, 3.0));
  return T;
}

/// A body that can exist: its inertia is that of six points.
inline kinematics::Body random_body(Random& random) {
  kinematics::Moments sum;
  for (int k = 0; k < 6; ++k) {
    const Eigen::Vector3d p = random_vector(random, 3, 0.2);
    sum += kinematics::inertial_moments({random.uniform(0.1, 2.0), p, Vector6::Zero()});
  }
  return kinematics::to_body(sum);
}

/// Every parameter at random; one joint in three slides.
inline kinematics::DhChain random_chain(Random& random, int joints) {
  kinematics::DhChain chain{random_pose(random), {}};
  for (int i = 0; i < joints; ++i) {
    const Eigen::VectorXd v = random_vector(random, 5);
    const bool slides = random.uniform(0.0, 1.0) < 1.0 / 3;
    chain.joints.push_back({slides ? kinematics::JointType::Prismatic : kinematics::JointType::Revolute, v[0], 3 * v[1],
                            v[2], 3 * v[3], v[4]});
  }
  return chain;
}

inline std::vector<kinematics::Body> random_bodies(Random& random, int count) {
  std::vector<kinematics::Body> bodies;
  for (int i = 0; i < count; ++i) bodies.push_back(random_body(random));
  return bodies;
}

}  // namespace kr5::test
