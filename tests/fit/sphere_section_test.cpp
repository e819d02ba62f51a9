#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/fit/measurements/sphere_section.hpp>
#include <kr5/fit/problem.hpp>

#include "fit/derivatives.hpp"
#include "fit/fit_world.hpp"

namespace sphere_section_test {

using namespace kr5;
using namespace kr5::fit;
using namespace kr5::test;
using Catch::Matchers::Contains;

TEST_CASE("the section of a sphere has its centre's x and z, and the radius at that height") {
  const double radius = 0.05, beside = 0.03;
  Pose T = Pose::Identity();
  T.translation() << 0.01, beside, 0.2;
  const Eigen::Vector3d centre = Eigen::Vector3d::Zero(),
                        section(0.01, 0.2, std::sqrt(radius * radius - beside * beside));
  Problem problem;
  const FitMeasurement fits = problem.add(SphereSectionMeasurement(
      PoseChain().then(T), centre, radius, section, Eigen::Matrix3d(1e-8 * Eigen::Matrix3d::Identity())));
  CHECK(problem.residuals(fits).norm() < 1e-10);
  // A section that is 0.1 mm too wide is off by that much.
  const FitMeasurement wide =
      problem.add(SphereSectionMeasurement(PoseChain().then(T), centre, radius, section + Eigen::Vector3d(0, 0, 1e-4),
                                           Eigen::Matrix3d(1e-8 * Eigen::Matrix3d::Identity())));
  CHECK(problem.residuals(wide)[2] == Approx(-1.0).epsilon(3e-3));
}

TEST_CASE("a section changes with scanner, centre and radius") {
  Random random(37);
  Problem problem;
  const FitBlock scanner = problem.add_pose("scanner", random_pose(random)),
                 centre = problem.add_point("centre", random.normal_vector(3, 0.02)),
                 radius = problem.add_vector("ball", Eigen::VectorXd::Constant(1, 0.05), {"radius [m]"});
  Eigen::Matrix3d C;
  C << 4, 1, 0, 1, 3, 0.5, 0, 0.5, 2;
  const FitMeasurement m = problem.add(
      SphereSectionMeasurement(PoseChain().then_inverse(scanner), centre, radius, Eigen::Vector3d(0.01, 0.2, 0.03), C));
  check_derivatives(problem, m, {scanner, centre, radius});
}

TEST_CASE("a section without a radius is refused") {
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  const Eigen::Matrix3d C = Eigen::Matrix3d::Identity();
  CHECK_THROWS_WITH(SphereSectionMeasurement({}, zero, 0.0, Eigen::Vector3d(0, 0, 1), C), Contains("must be positive"));
  CHECK_THROWS_WITH(SphereSectionMeasurement({}, zero, 1.0, zero, C), Contains("must be positive"));
}

}  // namespace sphere_section_test
