#include <limits>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/calibration/sphere_fit.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <support/coverage.hpp>
#include <support/trials.hpp>

namespace sphere_fit_test {

using namespace kr5;
using namespace kr5::calibration;
using Catch::Matchers::Contains;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

const Vector3d centre(0.7, -0.1, 0.12);
constexpr double radius = 0.0125;

/// Points of the part of the sphere within `polar` of +Z, with noise across the surface.
Matrix3Xd cap(int count, double polar, double noise, Random& random) {
  Matrix3Xd out(3, count);
  for (int k = 0; k < count;) {
    const Vector3d n = random.direction();
    if (n.z() > std::cos(polar)) out.col(k++) = centre + (radius + random.normal(noise)) * n;
  }
  return out;
}

TEST_CASE("exact points give the exact centre, from any side and from far away", "[sphere]") {
  Random random(1);
  for (const double polar : {0.3, 1.5, 3.2})
    for (const double off : {0.0, 0.005, 0.02}) {
      const Matrix3Xd points = cap(200, polar, 0.0, random);
      const SphereFit found = fit_sphere(points, radius, centre + off * Vector3d(0.6, 0, -0.8));
      REQUIRE(found.fit.usable());
      CHECK((found.centre - centre).norm() < 1e-9);
      CHECK(found.rms < 1e-9);
    }
}

TEST_CASE("a cap agrees with a sphere on either side; the start says which", "[sphere]") {
  Random random(2);
  const Matrix3Xd points = cap(200, 0.2, 0.0, random);
  const SphereFit above = fit_sphere(points, radius, centre + 2 * radius * Vector3d::UnitZ());
  REQUIRE(above.fit.usable());
  CHECK((above.centre - centre).z() == Approx(2 * radius).epsilon(0.05));
  CHECK(above.rms > 1e-5);  // which is worse
  CHECK(fit_sphere(points, radius, centre).rms < 1e-9);
}

TEST_CASE("the covariance of the centre holds its errors", "[sphere][statistics]") {
  Random random(3);
  test::Coverage few("sphere of 8 points: centre", 3), many("sphere of 60 points: centre", 3);
  for (int trial = 0; trial < test::trials(2000, 300); ++trial)
    for (const auto& [count, coverage] : {std::pair(8, &few), std::pair(60, &many)}) {
      const SphereFit found = fit_sphere(cap(count, 1.5, 2e-5, random), radius, centre);
      REQUIRE(found.fit.usable());
      coverage->add(found.centre - centre, found.covariance, count - 3);
    }
  few.check_rate(), few.check_mean();
  many.check_rate(), many.check_mean();
}

TEST_CASE("the RMS is that of the noise, and of points that are no sphere", "[sphere]") {
  Random random(4);
  CHECK(fit_sphere(cap(2000, 1.5, 2e-5, random), radius, centre).rms == Approx(2e-5).epsilon(0.05));
  Matrix3Xd plane = cap(400, 1.5, 0.0, random);
  plane.row(2).setConstant(centre.z() + radius);
  CHECK(fit_sphere(plane, radius, centre).rms > 5e-4);
}

TEST_CASE("points that do not determine a centre are told apart from an answer", "[sphere]") {
  Random random(5);
  const SphereFit three = fit_sphere(cap(3, 1.5, 0.0, random), radius, centre);
  CHECK_FALSE(three.fit.usable());
  CHECK_THAT(three.fit.message, Contains("found 3 points"));
  CHECK_FALSE(fit_sphere(Matrix3Xd(3, 0), radius, centre).fit.usable());
  Matrix3Xd line(3, 50);
  for (int k = 0; k < 50; ++k) line.col(k) = centre + Vector3d(1e-4 * k, 2e-4 * k, radius);
  CHECK_FALSE(fit_sphere(line, radius, centre).fit.usable());
  CHECK_FALSE(fit_sphere(Matrix3Xd::Ones(3, 9), radius, centre).fit.usable());
}

TEST_CASE("a start on a point is moved away from it", "[sphere]") {
  Random random(6);
  const Matrix3Xd points = cap(100, 3.2, 0.0, random);
  const SphereFit found = fit_sphere(points, radius, points.col(0));
  REQUIRE(found.fit.usable());
  CHECK((found.centre - centre).norm() < 1e-9);
}

TEST_CASE("what is no number, and no radius, is refused", "[sphere]") {
  Random random(7);
  const Matrix3Xd points = cap(20, 1.5, 0.0, random);
  Matrix3Xd broken = points;
  broken(1, 3) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(fit_sphere(broken, radius, centre), InvalidArgument);
  CHECK_THROWS_AS(fit_sphere(points, radius, broken.col(3)), InvalidArgument);
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THROWS_WITH(fit_sphere(points, bad, centre), Contains("radius"));
}

}  // namespace sphere_fit_test
