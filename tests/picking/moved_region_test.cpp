#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/picking/moved_region.hpp>

namespace moved_region_test {

using namespace kr5;
using namespace kr5::picking;
using Catch::Matchers::Contains;
using Eigen::Vector3d;

namespace {

Pinhole a_camera() {
  Pinhole camera;
  camera.width = 320, camera.height = 240;
  camera.fx = camera.fy = 500, camera.cx = 159.5, camera.cy = 119.5;
  camera.k1 = -0.1;
  return camera;
}

/// 0.3 m above the base, looking down.
Pose T_camera_base() {
  Pose T_base_camera(Eigen::Translation3d(0.02, -0.01, 0.3));
  T_base_camera.rotate(Eigen::AngleAxisd(std::numbers::pi - 0.1, Vector3d::UnitX()));
  return T_base_camera.inverse();
}

Cloud a_cloud(Random& random, int count) {
  Cloud cloud;
  cloud.points = Eigen::Matrix3Xd::NullaryExpr(3, count, [&] { return random.uniform(-0.08, 0.08); });
  cloud.points.row(2) = (cloud.points.row(2).array() * 0.2).matrix();
  cloud.points.col(3).setConstant(std::numeric_limits<double>::quiet_NaN());
  return cloud;
}

}  // namespace

TEST_CASE("points within the margin of changed pixels are taken out, by brute force over the pixels") {
  Random random(1);
  const Pinhole camera = a_camera();
  Cloud cloud = a_cloud(random, 400);
  cloud.points.col(7) = Vector3d(3, 0, 0);  // outside the image
  for (const double margin : {0.0, 0.002, 0.006}) {
    PixelMask changed = PixelMask::Constant(240, 320, false);
    for (int k = 0; k < 12; ++k) changed(random.integer(240), random.integer(320)) = true;
    changed.block(100, 150, 20, 30).setConstant(true);
    const PrunedCloud pruned = remove_changed(cloud, changed, camera, T_camera_base(), margin);
    int removed = 0, wrong = 0;
    for (int i = 0; i < 400; ++i) {
      if (i == 3) continue;
      const Vector3d p = T_camera_base() * cloud.points.col(i);
      const Eigen::Vector2d pixel = camera.project(p);
      double nearest = 1e9;
      for (int v = 0; v < 240; ++v)
        for (int u = 0; u < 320; ++u)
          if (changed(v, u))
            nearest = std::min(nearest, std::hypot(u - std::round(pixel.x()), v - std::round(pixel.y())));
      const bool inside = i != 7 && pixel.x() > -0.5 && pixel.y() > -0.5 && pixel.x() < 319.5 && pixel.y() < 239.5;
      const bool expected = inside && nearest <= std::max(0.5, 500 * margin / p.z());
      removed += expected;
      wrong += expected != std::isnan(pruned.cloud.points(0, i));
    }
    CHECK(wrong == 0);
    CHECK(removed > 0);
    CHECK(pruned.removed == removed);
    CHECK(pruned.unseen >= 1);
    CHECK(pruned.cloud.points.cols() == 400);
  }
}

TEST_CASE("without a changed pixel the cloud stays, with all changed nothing seen does") {
  Random random(2);
  const Cloud cloud = a_cloud(random, 50);
  const PixelMask none = PixelMask::Constant(240, 320, false), all = PixelMask::Constant(240, 320, true);
  CHECK(remove_changed(cloud, none, a_camera(), T_camera_base()).removed == 0);
  const PrunedCloud pruned = remove_changed(cloud, all, a_camera(), T_camera_base());
  CHECK(pruned.removed + pruned.unseen == 49);
}

TEST_CASE("cylinders that show a changed pixel are listed, those beside it are not") {
  std::vector<Pellet> pellets(3);
  for (std::size_t i = 0; i < 3; ++i) {
    pellets[i].centre = Vector3d(0.04 * static_cast<double>(i) - 0.04, 0.01, 0.01);
    pellets[i].radius = 0.008, pellets[i].height = 0.015;
  }
  const Pinhole camera = a_camera();
  PixelMask changed = PixelMask::Constant(240, 320, false);
  const Eigen::Vector2d pixel = camera.project(T_camera_base() * (pellets[1].centre + Vector3d(0.006, 0, 0.0075)));
  changed(std::lround(pixel.y()), std::lround(pixel.x())) = true;
  CHECK(disturbed_pellets(pellets, changed, camera, T_camera_base()) == std::vector<int>{1});
  CHECK(disturbed_pellets(pellets, changed, camera, T_camera_base(), 0.045) == std::vector<int>{0, 1, 2});
  CHECK(disturbed_pellets({}, changed, camera, T_camera_base()).empty());
}

TEST_CASE("a mask of another size, a pose that is none and a margin in millimetres are refused") {
  Random random(3);
  const Cloud cloud = a_cloud(random, 10);
  const PixelMask good = PixelMask::Constant(240, 320, false), turned = PixelMask::Constant(320, 240, false);
  CHECK_THROWS_WITH(remove_changed(cloud, turned, a_camera(), T_camera_base()), Contains("changed: the mask"));
  Pose scaled = T_camera_base();
  scaled.linear() *= 1000;
  CHECK_THROWS_WITH(remove_changed(cloud, good, a_camera(), scaled), Contains("T_camera_base is no rigid motion"));
  CHECK_THROWS_WITH(remove_changed(cloud, good, a_camera(), T_camera_base(), 2.0), Contains("margin"));
  CHECK_THROWS_WITH(disturbed_pellets({}, turned, a_camera(), T_camera_base()), Contains("changed: the mask"));
}

}  // namespace moved_region_test
