#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/kinematics/axis_chain.hpp>

namespace axis_chain_test {

using namespace kr5;
using namespace kr5::kinematics;
using Catch::Matchers::Contains;

namespace {

/// An arm with general, intersecting, parallel and slightly tilted neighbours.
DhChain arm_of(Random& random, int kind) {
  DhChain arm;
  Vector6 at;
  at << random.normal_vector(3), random.normal_vector(3, 0.8);
  arm.T_base_0 = to_pose(at);
  for (int i = 0; i < 6; ++i) {
    DhJoint joint;
    joint.b = random.uniform(-0.5, 0.5), joint.a = random.uniform(0.1, 0.6);
    joint.theta_offset = random.uniform(-3, 3), joint.alpha = random.uniform(0.3, 2.8) * (i % 2 ? 1 : -1);
    if (kind == 1 && i % 2) joint.a = 0;
    if (kind >= 2 && i == 1) joint.alpha = 0;
    if (kind == 3 && i == 1) joint.alpha = 0.01, joint.beta = -0.02;
    if (kind == 4 && i == 1) joint.alpha = M_PI;
    arm.joints.push_back(joint);
  }
  return arm;
}

}  // namespace

TEST_CASE("axes of any arm give it back to a nanometre: skew, intersecting, parallel, nearly parallel, opposed") {
  Random random(1);
  for (int kind = 0; kind < 5; ++kind)
    for (int trial = 0; trial < 40; ++trial) {
      CAPTURE(kind, trial);
      const DhChain arm = arm_of(random, kind);
      const Eigen::VectorXd q = random.normal_vector(6);
      const DhChain found = chain_from_axes(axes_of(arm, q), q, arm.flange(q));
      // What a row cannot say of the flange is the same in every posture: a place along and a turn about its z axis.
      const Pose T_found_flange = found.flange(q).inverse() * arm.flange(q);
      CHECK(T_found_flange.translation().head<2>().norm() < 1e-9);
      CHECK(T_found_flange.linear().col(2).isApprox(Eigen::Vector3d::UnitZ(), 1e-9));
      for (int k = 0; k < 5; ++k) {
        const Eigen::VectorXd other = random.normal_vector(6, 1.5);
        const Vector6 off = pose_difference(arm.flange(other), found.flange(other) * T_found_flange);
        CHECK(off.head<3>().norm() < 1e-9);
        CHECK(off.tail<3>().norm() < 1e-9);
      }
    }
}

TEST_CASE("an arm in common Denavit-Hartenberg form keeps its lengths, twists and offsets, parallel axes included") {
  Random random(2);
  for (int trial = 0; trial < 40; ++trial) {
    DhChain arm = arm_of(random, 2);
    arm.joints[1].b = 0;  // that of the second of two parallel axes is free
    arm.joints[2].b = random.uniform(-0.3, 0.3);
    const Eigen::VectorXd q = random.normal_vector(6);
    const DhChain found = chain_from_axes(axes_of(arm, q), q, arm.flange(q));
    for (std::size_t i = 1; i < 5; ++i) {
      CAPTURE(trial, i);
      // The x axis of a link may point the other way, with the twist and the length of the other sign.
      CHECK(std::abs(found.joints[i].a) == Approx(std::abs(arm.joints[i].a)).margin(1e-9));
      CHECK(std::abs(std::sin(found.joints[i].alpha)) == Approx(std::abs(std::sin(arm.joints[i].alpha))).margin(1e-9));
      CHECK(found.joints[i].beta == Approx(0).margin(1e-9));
      CHECK(found.joints[i].b == Approx(arm.joints[i].b).margin(1e-9));
    }
  }
}

TEST_CASE("links whose axes are near-parallel are those that get beta in place of b") {
  Random random(3);
  for (int kind = 0; kind < 5; ++kind) {
    const DhChain arm = arm_of(random, kind);
    const Eigen::VectorXd q = random.normal_vector(6);
    const DhChain found = chain_from_axes(axes_of(arm, q), q, arm.flange(q));
    CAPTURE(kind);
    for (std::size_t i = 0; i < 5; ++i) CHECK(has_near_parallel_axes(found.joints[i]) == (kind >= 2 && i == 1));
  }
  CHECK(has_near_parallel_axes({.beta = 0.09}));
  CHECK_FALSE(has_near_parallel_axes({.alpha = 0.08, .beta = 0.08}));
  CHECK_FALSE(has_near_parallel_axes({.alpha = 0.09}, 0.05));
}

TEST_CASE("axes that are no lines, or do not match the joint values, are refused") {
  const std::vector<AxisLine> axes(2);
  CHECK_THROWS_WITH(chain_from_axes({}, {}, Pose::Identity()), Contains("there are no axes"));
  CHECK_THROWS_WITH(chain_from_axes(axes, Eigen::VectorXd::Zero(3), Pose::Identity()), Contains("2 axes, but 3"));
  std::vector<AxisLine> bent = axes;
  bent[1].direction = Eigen::Vector3d(0, 0, 2);
  CHECK_THROWS_WITH(chain_from_axes(bent, Eigen::VectorXd::Zero(2), Pose::Identity()), Contains("axis 2"));
}

}  // namespace axis_chain_test
