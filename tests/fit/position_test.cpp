#include <catch2/catch.hpp>

#include <kr5/fit/measurements/position.hpp>
#include <kr5/fit/problem.hpp>

#include "fit/derivatives.hpp"
#include "fit/fit_world.hpp"

namespace position_test {

using namespace kr5;
using namespace kr5::fit;
using namespace kr5::test;
using Catch::Matchers::Contains;

TEST_CASE("a position is where the chain carries its point, less where it was seen, in standard deviations") {
  Random random(31);
  const Pose T = random_pose(random);
  const Eigen::Vector3d point(0.1, -0.2, 0.3), seen(0.4, 0.5, -0.6);
  Problem problem;
  const FitMeasurement m = problem.add(PositionMeasurement(PoseChain().then(T), point, seen, 0.02));
  CHECK((problem.residuals(m) - (T * point - seen) / 0.02).norm() < 1e-12);
  Eigen::Matrix3d C;
  C << 4, 1, 0, 1, 3, 0.5, 0, 0.5, 2;
  problem.set_covariance(m, C);
  const Eigen::Vector3d off = T * point - seen;
  CHECK(problem.residuals(m).squaredNorm() == Approx(off.dot(C.inverse() * off)).epsilon(1e-12));
}

TEST_CASE("a position changes with base, arm, joint errors, point and the place that was seen") {
  Random random(32);
  Problem problem;
  const FitBlock base = problem.add_pose("base", random_pose(random)),
                 arm = problem.add_arm("arm", random_arm(random, 4)),
                 terms = problem.add_vector("terms", random.normal_vector(2, 0.01), {"a", "b"}),
                 point = problem.add_point("point", random.normal_vector(3, 0.2)),
                 seen = problem.add_point("seen", random.normal_vector(3, 0.2));
  const Eigen::MatrixXd regressor = Eigen::MatrixXd::NullaryExpr(4, 2, [&] { return random.normal(); });
  const Eigen::VectorXd q = random.normal_vector(4);
  const FitMeasurement forward =
      problem.add(PositionMeasurement(PoseChain().then(base).then_arm(arm, q, terms, regressor), point, seen, 1e-2));
  check_derivatives(problem, forward, {base, arm, terms, point, seen});
  const FitMeasurement back = problem.add(PositionMeasurement(
      PoseChain().then_inverse_arm(arm, q, terms, regressor).then_inverse(base), point, seen, 1e-2));
  check_derivatives(problem, back, {base, arm, terms, point, seen});
}

TEST_CASE("a position without a noise, of the wrong block or of a point that is none is refused") {
  Problem problem;
  const FitBlock pose = problem.add_pose("base", Pose::Identity());
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  CHECK_THROWS_WITH(PositionMeasurement({}, zero, zero, 0.0), Contains("sigma must be positive [m]"));
  CHECK_THROWS_WITH(PositionMeasurement({}, zero, zero, Eigen::Matrix3d(-Eigen::Matrix3d::Identity())),
                    Contains("positive definite"));
  CHECK_THROWS_WITH(problem.add(PositionMeasurement({}, pose, zero, 1.0)), Contains("base is no point"));
  CHECK_THROWS_WITH(problem.add(PositionMeasurement({}, zero, Eigen::Vector3d(0, NAN, 0), 1.0)),
                    Contains("a point must be finite"));
}

}  // namespace position_test
