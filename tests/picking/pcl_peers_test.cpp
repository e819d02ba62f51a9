// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/pcl_peers.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <kr5/core/random.hpp>
#include <kr5/picking/cylinder_fit.hpp>

namespace pcl_peers_test {

using namespace kr5;
using namespace kr5::picking;
using Catch::Matchers::Contains;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

namespace {

/// The upper half of a lying cylinder along X.
Matrix3Xd half_cylinder(Random& random, const Vector3d& centre, double radius, double noise, int count) {
  Matrix3Xd out(3, count);
  for (auto column : out.colwise()) {
    const double angle = random.uniform(0, std::numbers::pi);
    column = centre + Vector3d(random.uniform(-0.0075, 0.0075), radius * std::cos(angle), radius * std::sin(angle)) +
             Vector3d(random.normal_vector(3, noise));
  }
  return out;
}

}  // namespace

TEST_CASE("PCL and ours find the same half cylinder, and PCL's radius scatters more") {
  Random random(21);
  const double radius = 0.008;
  const Vector3d centre(0.6, -0.2, 0.1);
  double ours = 0, theirs = 0;
  const int trials = 20;
  for (int i = 0; i < trials; ++i) {
    const Matrix3Xd points = half_cylinder(random, centre, radius, 1e-4, 1500);
    const CylinderFit fit = fit_cylinder(points);
    const PclCylinder peer = pcl_cylinder(points);
    REQUIRE(fit.fit.usable());
    REQUIRE(peer.found);
    CHECK(std::abs(peer.axis.x()) > 0.99);
    CHECK((peer.point - centre).norm() < 5e-4);
    CHECK((fit.point - centre).tail<2>().norm() < 5e-5);
    CHECK(peer.height == Approx(0.015).margin(0.001));
    ours += std::pow(fit.radius - radius, 2);
    theirs += std::pow(peer.radius - radius, 2);
  }
  CHECK(std::sqrt(ours / trials) < 1e-5);
  CHECK(ours < theirs);
}

TEST_CASE("PCL's tutorial repeated finds cylinders that lie apart") {
  Random random(22);
  Bin bin;
  bin.T_base_bin.translation() = Vector3d(0.5, 0, 0);
  bin.size = Vector3d(0.1, 0.1, 0.05);
  Cloud cloud;
  cloud.points.resize(3, 6000);
  for (int k = 0; k < 3; ++k)
    cloud.points.middleCols(2000 * k, 2000) =
        half_cylinder(random, Vector3d(0.5, 0.03 * (k - 1), 0.012), 0.008, 5e-5, 2000);
  const std::vector<PclCylinder> found = pcl_find_cylinders(cloud, bin);
  REQUIRE(found.size() == 3);
  std::vector<bool> met(3);
  for (const PclCylinder& one : found) {
    const auto k = static_cast<std::size_t>(std::lround(one.point.y() / 0.03) + 1);
    met[k] = (one.point - Vector3d(0.5, one.point.y(), 0.012)).norm() < 1e-3 && std::abs(one.axis.x()) > 0.98;
  }
  CHECK(met == std::vector<bool>(3, true));
  CHECK(pcl_find_cylinders({}, bin).empty());
}

TEST_CASE("what PCL cannot fit is refused or not found") {
  Matrix3Xd points = Matrix3Xd::Zero(3, 2);
  CHECK_FALSE(pcl_cylinder(points).found);
  points(0, 0) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(pcl_cylinder(points), Contains("not finite"));
  CHECK_THROWS_WITH(pcl_cylinder(Matrix3Xd::Zero(3, 9), {.min_radius = 0.02}), Contains("max_radius"));
}

}  // namespace pcl_peers_test
