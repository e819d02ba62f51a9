#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/kinematics/jacobian.hpp>

#include "kinematics/random_chain.hpp"

namespace jacobian_test {

using namespace kr5;
using namespace kr5::kinematics;

TEST_CASE("the Jacobian is the derivative of the pose, for any chain and any frame on the flange") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    Random random(seed);
    const DhChain chain = test::random_chain(random, 1 + static_cast<int>(seed % 8));
    const Eigen::VectorXd q = test::random_vector(random, static_cast<int>(chain.joints.size()), 3);
    const Pose X = test::random_pose(random);
    const Jacobian J = jacobian(chain, q, X);
    const double h = 1e-6;
    for (int k = 0; k < q.size(); ++k) {
      const Eigen::VectorXd step = h * Eigen::VectorXd::Unit(q.size(), k);
      const Pose a = chain.flange(q - step) * X, b = chain.flange(q + step) * X;
      Vector6 column;
      column << (b.translation() - a.translation()) / (2 * h),
          log_rotation(b.linear() * a.linear().transpose()) / (2 * h);
      CHECK((J.col(k) - column).norm() < 1e-8);
    }
  }
}

TEST_CASE("two parallel links stretched out lose a direction") {
  DhChain chain;
  chain.joints = {{JointType::Revolute, 0, 0, 1, 0}, {JointType::Revolute, 0, 0, 1, 0}};
  const double bent = M_PI / 2;
  const Manipulability good = manipulability(jacobian(chain, Eigen::Vector2d(0.3, bent)));
  const Jacobian stretched = jacobian(chain, Eigen::Vector2d(0.3, 0.0));
  CHECK(good.condition < 10);
  CHECK(good.volume == Approx(good.singular_values[0] * good.singular_values[1]));
  Jacobian linear = stretched;
  linear.bottomRows<3>().setZero();
  CHECK(manipulability(linear).volume < 1e-15);
  CHECK(manipulability(Jacobian::Zero(6, 2)).condition == std::numeric_limits<double>::infinity());
  CHECK_THROWS_AS(manipulability(stretched, 0.0), InvalidArgument);
}

TEST_CASE("limits name the joints outside, and may be infinite") {
  const double inf = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d lower(-1, -inf, 0), upper(1, inf, 0.5);
  CHECK(outside_limits(Eigen::Vector3d(1, 100, 0.5), lower, upper).empty());
  CHECK(outside_limits(Eigen::Vector3d(1.1, 100, -0.1), lower, upper) == std::vector<int>{0, 2});
  CHECK_THROWS_AS(outside_limits(Eigen::Vector2d(0, 0), lower, upper), InvalidArgument);
}

TEST_CASE("the flange's derivative by every joint parameter is that of finite differences") {
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const DhChain arm = test::random_chain(random, 1 + trial % 8);
    const Eigen::VectorXd q = random.normal_vector(static_cast<Eigen::Index>(arm.joints.size()));
    Pose T;
    const Jacobian J = parameter_jacobian(arm, q, &T);
    CHECK(T.isApprox(arm.flange(q), 1e-14));
    const double h = 1e-6;
    for (Eigen::Index k = 0; k < J.cols(); ++k) {
      const auto moved = [&](double by) {
        DhChain other = arm;
        DhJoint& joint = other.joints[static_cast<std::size_t>(k / 5)];
        double* const parameters[] = {&joint.b, &joint.theta_offset, &joint.a, &joint.alpha, &joint.beta};
        *parameters[k % 5] += by;
        return other.flange(q);
      };
      const Vector6 numeric = (pose_difference(T, moved(h)) - pose_difference(T, moved(-h))) / (2 * h);
      CAPTURE(trial, k);
      CHECK((numeric - J.col(k)).norm() < 1e-8);
    }
  }
}

}  // namespace jacobian_test
