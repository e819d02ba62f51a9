#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/fit/measurements/distance.hpp>
#include <kr5/fit/problem.hpp>

#include "fit/derivatives.hpp"
#include "fit/fit_world.hpp"

namespace distance_test {

using namespace kr5;
using namespace kr5::fit;
using namespace kr5::test;
using Catch::Matchers::Contains;

TEST_CASE("a distance is that of the carried point from the other one, known or a block, in standard deviations") {
  Problem problem;
  Pose T = Pose::Identity();
  T.translation() << 3, 0, 0;
  const FitBlock radius = problem.add_vector("ball", Eigen::VectorXd::Constant(1, 4.5), {"radius [m]"});
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero(), other(0, 4, 0);
  const FitMeasurement known = problem.add(DistanceMeasurement(PoseChain().then(T), zero, other, 4.9, 0.1)),
                       shared = problem.add(DistanceMeasurement(PoseChain().then(T), zero, other, radius, 0.1));
  CHECK(problem.residuals(known)[0] == Approx(1.0).epsilon(1e-12));  // 5 m between the points
  CHECK(problem.residuals(shared)[0] == Approx(5.0).epsilon(1e-12));
}

TEST_CASE("a distance changes with the chain, both points and its own block") {
  Random random(33);
  Problem problem;
  const FitBlock base = problem.add_pose("base", random_pose(random)),
                 point = problem.add_point("point", random.normal_vector(3, 0.2)),
                 other = problem.add_point("other", random.normal_vector(3, 0.2)),
                 radius = problem.add_vector("ball", Eigen::VectorXd::Constant(1, 0.3), {"radius [m]"});
  const FitMeasurement m = problem.add(DistanceMeasurement(PoseChain().then(base), point, other, radius, 1e-2));
  check_derivatives(problem, m, {base, point, other, radius});
}

TEST_CASE("a distance of points at one place has no direction in which to change, and is refused as a start") {
  Problem problem;
  const FitBlock point = problem.add_point("point", Eigen::Vector3d::Zero());
  const FitMeasurement m = problem.add(DistanceMeasurement({}, point, Eigen::Vector3d(0, 0, 0), 1.0, 0.1));
  CHECK(std::isinf(problem.residuals(m)[0]));
  CHECK(problem.solve().fit.status == FitStatus::Degenerate);
}

TEST_CASE("a distance without a noise, or of a block of several numbers, is refused") {
  Problem problem;
  const FitBlock two = problem.add_vector("two", Eigen::Vector2d(1, 1), {"a", "b"});
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  CHECK_THROWS_WITH(DistanceMeasurement({}, zero, zero, 1.0, 0.0), Contains("sigma must be positive"));
  CHECK_THROWS_WITH(DistanceMeasurement({}, zero, zero, NAN, 1.0), Contains("distance finite [m]"));
  CHECK_THROWS_WITH(problem.add(DistanceMeasurement({}, zero, zero, two, 1.0)),
                    Contains("distance must be a block of one number"));
}

}  // namespace distance_test
