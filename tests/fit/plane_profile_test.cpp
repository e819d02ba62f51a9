#include <catch2/catch.hpp>

#include <kr5/fit/measurements/plane_profile.hpp>
#include <kr5/fit/problem.hpp>

#include "fit/derivatives.hpp"
#include "fit/fit_world.hpp"

namespace plane_profile_test {

using namespace kr5;
using namespace kr5::fit;
using namespace kr5::test;
using Catch::Matchers::Contains;

TEST_CASE("points of a profile count by their heights above the plane, by the covariance of these") {
  Random random(35);
  const Pose T = random_pose(random);
  const Eigen::Matrix3Xd points = Eigen::Matrix3Xd::NullaryExpr(3, 2, [&] { return random.normal(); });
  Eigen::Matrix2d C;
  C << 2, 0.5, 0.5, 1;
  Problem problem;
  const FitMeasurement m = problem.add(PlaneProfileMeasurement(PoseChain().then(T), points, C));
  const Eigen::Vector2d height = (T.linear() * points).row(2).transpose().array() + T.translation().z();
  CHECK(problem.residuals(m).squaredNorm() == Approx(height.dot(C.inverse() * height)).epsilon(1e-12));
  problem.set_covariance(m, 4 * C);
  CHECK(problem.residuals(m).squaredNorm() == Approx(height.dot(C.inverse() * height) / 4).epsilon(1e-12));
}

TEST_CASE("points of a profile change with plane and scanner") {
  Random random(36);
  Problem problem;
  const FitBlock plane = problem.add_pose("plane", random_pose(random)),
                 scanner = problem.add_pose("scanner", random_pose(random));
  const Eigen::Matrix3Xd points = Eigen::Matrix3Xd::NullaryExpr(3, 5, [&] { return random.normal(); });
  const FitMeasurement m =
      problem.add(PlaneProfileMeasurement(PoseChain().then_inverse(plane).then(random_pose(random)).then(scanner),
                                          points, Eigen::MatrixXd::Identity(5, 5)));
  check_derivatives(problem, m, {plane, scanner});
}

TEST_CASE("a profile without points, or with the covariance of others, is refused") {
  CHECK_THROWS_WITH(PlaneProfileMeasurement({}, Eigen::Matrix3Xd(3, 0), Eigen::MatrixXd()), Contains("at least one"));
  CHECK_THROWS_WITH(PlaneProfileMeasurement({}, Eigen::Matrix3Xd::Zero(3, 2), Eigen::Matrix3d::Identity()),
                    Contains("as many rows as there are numbers"));
}

}  // namespace plane_profile_test
