// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/clearance.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

#include "support/trials.hpp"

namespace clearance_test {

using namespace kr5;
using namespace kr5::picking;
using Catch::Matchers::Contains;
using Eigen::Vector3d;

namespace {

Pose drawn_pose(Random& random, double spread) {
  return to_pose((Vector6() << random.normal_vector(3, spread), random.uniform(0, 3) * random.direction()).finished());
}

/// Least distance from the box of points of the cylinder: by alternating projections, another method than the
/// library's.
double brute_force(const Pose& T_box_cylinder, double radius, double height, const Vector3d& half) {
  double least = 1e9;
  for (int k = 0; k < 72; ++k)
    for (int i = 0; i <= 20; ++i)
      for (const double r : {0.0, 0.5, 1.0}) {
        const double angle = 2 * std::numbers::pi * k / 72;
        Vector3d q(r * radius * std::cos(angle), r * radius * std::sin(angle), height * (i / 20.0 - 0.5));
        for (int step = 0; step < 4; ++step) {
          const Vector3d p = T_box_cylinder * q, on_box = p.cwiseMax(-half).cwiseMin(half);
          least = std::min(least, (p - on_box).norm());
          q = T_box_cylinder.inverse() * on_box;  // back onto the cylinder
          if (const double across = q.head<2>().norm(); across > radius) q.head<2>() *= radius / across;
          q.z() = std::clamp(q.z(), -height / 2, height / 2);
        }
      }
  return least;
}

}  // namespace

TEST_CASE("the distance of a cylinder and a box is that of brute force, and never more") {
  Random random(21);
  const int trials = test::trials(20000, 1500);
  int touching = 0, close = 0;
  for (int i = 0; i < trials; ++i) {
    const Vector3d half(random.uniform(0.001, 0.1), random.uniform(0.001, 0.1), random.uniform(0.001, 0.1));
    const double radius = random.uniform(0.002, 0.03), height = random.uniform(0.005, 0.2);
    const Pose T_base_box = drawn_pose(random, 0.1), T_base_cylinder = drawn_pose(random, 0.1);
    const double exact = cylinder_box_distance(T_base_cylinder, radius, height, T_base_box, half);
    const double sampled = brute_force(T_base_box.inverse() * T_base_cylinder, radius, height, half);
    INFO("trial " << i << ": " << exact << " and by brute force " << sampled);
    REQUIRE(exact <= sampled + 1e-8);  // never unsafe
    touching += sampled < 1e-9;
    close += sampled - exact < 1e-5;
  }
  CHECK(touching > trials / 50);
  CHECK(close > 0.98 * trials);  // brute force itself is that near
}

TEST_CASE("simple places of cylinder and box have the distance one can see") {
  Pose at = Pose::Identity();
  const Vector3d half(0.1, 0.1, 0.1);
  at.translation() = Vector3d(0.2, 0, 0);
  CHECK(cylinder_box_distance(at, 0.03, 0.1, Pose::Identity(), half) == Approx(0.07).margin(1e-8));
  at.translation() = Vector3d(0, 0, 0.2);
  CHECK(cylinder_box_distance(at, 0.03, 0.1, Pose::Identity(), half) == Approx(0.05).margin(1e-8));
  at.translation() = Vector3d(0.15, 0.15, 0);  // past the edge of the box
  CHECK(cylinder_box_distance(at, 0.03, 0.1, Pose::Identity(), half) ==
        Approx(0.05 * std::sqrt(2) - 0.03).margin(1e-8));
  at.translation() = Vector3d(0.12, 0, 0);
  CHECK(cylinder_box_distance(at, 0.03, 0.1, Pose::Identity(), half) == 0);
}

TEST_CASE("the book's formula lets a rod touch where it leans aslant to a wall, the distance does not") {
  // a rod of 6 mm, 60 mm below the rim and 25 mm from a wall, at the lean that the formula just allows
  Bin bin;
  bin.size = {0.5, 0.5, 0.1};
  bin.wall_thickness = 0.002;
  const Vector3d tip(0.225, 0, 0.04);
  const double allowed[] = {6.00, 5.67, 4.76, 3.47};
  for (int k = 0; k < 4; ++k) {
    const double azimuth = 20.0 * k * std::numbers::pi / 180;
    double low = 0, high = 1.2;
    const auto outwards = [&](double lean) {
      return Vector3d(std::sin(lean) * std::cos(azimuth), std::sin(lean) * std::sin(azimuth), std::cos(lean));
    };
    for (int i = 0; i < 60; ++i) {
      const double lean = (low + high) / 2;
      (book_clearance({tip, outwards(lean)}, 0.006, bin).clears ? low : high) = lean;
    }
    // distance of the rod's axis from the rim: that of a thin rod
    const double distance =
        gripper_clearance({tip, outwards(low)}, {{.radius = 1e-6, .start = 0, .end = 0.3}}, bin, false);
    INFO("azimuth " << 20 * k);
    CHECK(1000 * distance == Approx(allowed[k]).margin(0.02));
    const double rod = gripper_clearance({tip, outwards(low)}, {{.radius = 0.006, .start = 0, .end = 0.3}}, bin, false);
    if (k > 0) CHECK(rod == 0);  // it touches
  }
}

TEST_CASE("walls end at the rim and have corners") {
  Bin bin;
  bin.size = {0.2, 0.2, 0.08};
  const std::vector<GripperPart> rod{{.radius = 0.005, .start = 0, .end = 0.2}};
  CHECK(gripper_clearance({{0, 0, 0.02}, Vector3d::UnitZ()}, rod, bin) == Approx(0.02).margin(1e-8));  // the floor
  CHECK(gripper_clearance({{0, 0, 0.02}, Vector3d::UnitZ()}, rod, bin, false) == Approx(0.095).margin(1e-8));
  CHECK(gripper_clearance({{0.09, 0.09, 0.03}, Vector3d::UnitZ()}, rod, bin) == Approx(0.005).margin(1e-8));
  CHECK(gripper_clearance({{0.15, 0, 0.09}, Vector3d::UnitZ()}, rod, bin, false) > 0.009);  // above the rim
  CHECK(gripper_clearance({{0.099, 0, 0.03}, Vector3d::UnitZ()}, rod, bin) == 0);
  const std::vector<GripperPart> wide{{.radius = 0.005, .start = 0, .end = 0.05},
                                      {.radius = 0.03, .start = 0.05, .end = 0.1}};
  CHECK(gripper_clearance({{0.08, 0, 0.02}, Vector3d::UnitZ()}, wide, bin) == 0);  // its holder is wider
  CHECK_THROWS_WITH(gripper_clearance({{0, 0, 0}, {0, 0, 2}}, rod, bin), Contains("length 1"));
  CHECK_THROWS_WITH(gripper_clearance({{0, 0, 0}, {0, 0, 1}}, {{.radius = 0}}, bin), Contains("row 0"));
  bin.size = {200, 200, 80};
  CHECK_THROWS_WITH(gripper_clearance({{0, 0, 0}, {0, 0, 1}}, rod, bin), Contains("millimetres"));
}

}  // namespace clearance_test
