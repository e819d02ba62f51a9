#include <catch2/catch.hpp>

#include <kr5/fit/measurements/plane_point.hpp>
#include <kr5/fit/problem.hpp>

#include "fit/derivatives.hpp"
#include "fit/fit_world.hpp"

namespace plane_point_test {

using namespace kr5;
using namespace kr5::fit;
using namespace kr5::test;
using Catch::Matchers::Contains;

TEST_CASE("a point on a plane counts by its height above it, in standard deviations") {
  Problem problem;
  Pose T = Pose::Identity();
  T.translation() << 5, 6, 0.7;
  const FitMeasurement m = problem.add(PlanePointMeasurement(PoseChain().then(T), Eigen::Vector3d(1, 2, 0.1), 0.2));
  CHECK(problem.residuals(m)[0] == Approx(4.0).epsilon(1e-12));
}

TEST_CASE("a point on a plane changes with plane, arm and point") {
  Random random(34);
  Problem problem;
  const FitBlock plane = problem.add_pose("plane", random_pose(random)),
                 arm = problem.add_arm("arm", random_arm(random, 3)),
                 point = problem.add_point("point", random.normal_vector(3, 0.2));
  const FitMeasurement m = problem.add(
      PlanePointMeasurement(PoseChain().then_inverse(plane).then_arm(arm, random.normal_vector(3)), point, 1e-2));
  check_derivatives(problem, m, {plane, arm, point});
}

TEST_CASE("a point on a plane without a noise is refused") {
  CHECK_THROWS_WITH(PlanePointMeasurement({}, Eigen::Vector3d(0, 0, 0), -1.0), Contains("sigma must be positive [m]"));
}

}  // namespace plane_point_test
