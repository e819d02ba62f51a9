// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/cylinder_fit.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/pose.hpp>

#include "support/coverage.hpp"
#include "support/trials.hpp"

namespace cylinder_fit_test {

using namespace kr5;
using namespace kr5::picking;
using Catch::Matchers::Contains;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

namespace {

/// Points of a side that covers `arc`, with noise in all directions.
struct DrawnPatch {
  Pose T_base_cylinder = Pose::Identity();
  double radius = 0.008;
  Matrix3Xd points;
};
DrawnPatch drawn_patch(Random& random, double arc, int count, double noise) {
  DrawnPatch out;
  out.T_base_cylinder =
      to_pose((Vector6() << random.normal_vector(3, 0.1), random.uniform(0, 3) * random.direction()).finished());
  out.radius = random.uniform(0.0075, 0.0085);
  out.points.resize(3, count);
  for (int i = 0; i < count; ++i) {
    const double angle = random.uniform(-arc / 2, arc / 2);
    const Vector3d local(out.radius * std::cos(angle), out.radius * std::sin(angle), random.uniform(-0.0075, 0.0075));
    out.points.col(i) = out.T_base_cylinder * local + Vector3d(random.normal_vector(3, noise));
  }
  return out;
}

/// Errors in the order of the covariance.
Eigen::Matrix<double, 5, 1> errors_of(const CylinderFit& fit, const DrawnPatch& truth) {
  Vector3d axis = truth.T_base_cylinder.linear().col(2);
  if (axis.dot(fit.axis) < 0) axis = -axis;
  const Vector3d from = truth.T_base_cylinder.translation() - fit.point;
  const Vector3d at_level = from - axis * (from.dot(fit.axis) / axis.dot(fit.axis));  // where the true axis crosses
  const Vector3d tilt = fit.axis.cross(axis);
  Eigen::Matrix<double, 5, 1> out;
  out << fit.across.transpose() * at_level, fit.across.transpose() * tilt, truth.radius - fit.radius;
  return out;
}

}  // namespace

TEST_CASE("the covariance of a cylinder covers the truth for arcs of 40 to 180 degrees", "[statistics]") {
  Random random(11);
  test::Coverage known("cylinder, noise known", 5), estimated("cylinder, noise from the residuals", 5);
  const int trials = test::trials(2000, 200);
  for (int i = 0; i < trials; ++i) {
    const double arc = random.uniform(40, 180) * std::numbers::pi / 180, noise = random.uniform(2e-5, 1e-4);
    const DrawnPatch patch = drawn_patch(random, arc, 200 + random.integer(400), noise);
    const CylinderFit given = fit_cylinder(patch.points, {.noise = noise});
    const CylinderFit free = fit_cylinder(patch.points);
    REQUIRE(given.fit.usable());
    REQUIRE(free.fit.usable());
    known.add(errors_of(given, patch), given.covariance);
    estimated.add(errors_of(free, patch), free.covariance, static_cast<double>(free.points) - 5);
  }
  known.check_rate();
  estimated.check_rate();
}

TEST_CASE("the radius has no bias where the noise is a thirteenth of it") {
  Random random(12);
  const int trials = 60;
  double sum = 0, variance = 0;
  for (int i = 0; i < trials; ++i) {
    const DrawnPatch patch = drawn_patch(random, std::numbers::pi, 2000, 6e-4);
    const CylinderFit fit = fit_cylinder(patch.points);
    sum += fit.radius - patch.radius;
    variance += fit.covariance(4, 4);
  }
  CHECK(std::abs(sum) < 3.5 * std::sqrt(variance));
  // without the term sigma^2 / 2 r the mean would be off by 22 um, many times its standard deviation
  CHECK(trials * 22e-6 > 5 * std::sqrt(variance));
}

TEST_CASE("a radius known beforehand is kept, and makes the axis more certain") {
  Random random(13);
  const DrawnPatch patch = drawn_patch(random, 0.9, 300, 1e-4);
  const CylinderFit free = fit_cylinder(patch.points), held = fit_cylinder(patch.points, {.radius = patch.radius});
  REQUIRE(held.fit.usable());
  CHECK(held.radius == patch.radius);
  CHECK(held.covariance(4, 4) == 0);
  CHECK(held.covariance.topLeftCorner<2, 2>().trace() < 0.3 * free.covariance.topLeftCorner<2, 2>().trace());
  const CylinderFit prior = fit_cylinder(patch.points, {.radius = 0.008, .sigma_radius = 3e-4});
  CHECK(prior.covariance(4, 4) < std::min(free.covariance(4, 4), 3e-4 * 3e-4));
  CHECK(held.arc == Approx(0.9).margin(0.05));
  CHECK(held.length == Approx(0.015).margin(0.0005));
}

TEST_CASE("points of something else are left out of a cylinder") {
  Random random(14);
  DrawnPatch patch = drawn_patch(random, 2.0, 400, 5e-5);
  for (int i = 0; i < 60; ++i) patch.points.col(i) += Vector3d(random.normal_vector(3, 0.003));
  const CylinderFit fit = fit_cylinder(patch.points);
  REQUIRE(fit.fit.usable());
  CHECK(fit.outliers > 45);
  CHECK(errors_of(fit, patch).head<2>().norm() < 5e-5);
  CHECK(std::abs(fit.radius - patch.radius) < 5e-5);
}

TEST_CASE("what determines no cylinder is refused in words") {
  Random random(15);
  Matrix3Xd plane(3, 200);
  for (int i = 0; i < 200; ++i) plane.col(i) = Vector3d(random.uniform(), random.uniform(), random.normal(1e-4)) * 0.01;
  const CylinderFit flat = fit_cylinder(plane);
  CHECK_FALSE(flat.fit.usable());
  const DrawnPatch short_arc = drawn_patch(random, 0.8, 200, 1e-4);
  const CylinderFit usable = fit_cylinder(short_arc.points);
  REQUIRE(usable.fit.usable());
  const double std_radius = std::sqrt(usable.covariance(4, 4)) / usable.radius;
  const CylinderFit doubtful = fit_cylinder(short_arc.points, {.accepted_std = 0.8 * std_radius});
  CHECK_FALSE(doubtful.fit.usable());
  CHECK_THAT(doubtful.fit.message, Contains("arc is too short"));
  CHECK_FALSE(fit_cylinder(plane.leftCols(5)).fit.usable());
  CHECK_THAT(fit_cylinder(plane.leftCols(5)).fit.message, Contains("too few points"));
  plane(1, 3) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(fit_cylinder(plane), Contains("not finite"));
  CHECK_THROWS_WITH(fit_cylinder(short_arc.points, {.radius = -1}), Contains("radius"));
}

}  // namespace cylinder_fit_test
