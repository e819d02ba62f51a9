#include <cstdlib>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/single_image_calibration.hpp>

namespace single_image_calibration_test {

using namespace kr5;

namespace {

/// 12 mm squares on one or two planes at a right angle, seen from about `distance`; points in the flange frame.
struct Scene {
  Pinhole camera{.width = 2456, .height = 2058, .fx = 2328.6, .fy = 2334.3, .cx = 1254.1, .cy = 1012.1, .k1 = -0.2018};
  Pose T_flange_camera;
  View view;

  Scene(Random& random, int planes, double noise, double distance = 0.35) {
    T_flange_camera = to_pose(random.normal_vector(6, 0.3));
    Pose T_camera_grid = Pose::Identity();
    T_camera_grid.translation() = Eigen::Vector3d(random.normal(0.01), random.normal(0.01), distance);
    T_camera_grid.linear() = exp_rotation(Eigen::Vector3d(2.4, 0, 0) + random.normal_vector(3, 0.1)).matrix();
    view.points.resize(3, 49 * planes);
    view.pixels.resize(2, 49 * planes);
    int n = 0;
    for (int plane = 0; plane < planes; ++plane)
      for (int i = 0; i < 7; ++i)
        for (int j = 0; j < 7; ++j, ++n) {
          const double u = 0.012 * (i - 3), v = 0.012 * (j + 1);
          const Eigen::Vector3d seen =
              T_camera_grid * (plane == 0 ? Eigen::Vector3d(u, v, 0) : Eigen::Vector3d(u, 0, v));
          view.points.col(n) = T_flange_camera * seen;
          view.pixels.col(n) = camera.project(seen) + random.normal_vector(2, noise);
        }
  }
};

}  // namespace

TEST_CASE("one exact image of two planes gives the camera on the flange") {
  Random random(1);
  for (int i = 0; i < 10; ++i) {
    const Scene scene(random, 2, 0);
    const auto result = calibrate_single_image(std::span(&scene.view, 1), scene.camera);
    REQUIRE(result.fit.status == FitStatus::Converged);
    CHECK(pose_difference(scene.T_flange_camera, result.T_flange_camera).norm() < 1e-6);
  }
}

TEST_CASE("the covariance from one image matches the scatter of its error") {
  Random random(2);
  double sum = 0;
  constexpr int trials = 400;
  for (int i = 0; i < trials; ++i) {
    const Scene scene(random, 2, 0.3);
    const auto result = calibrate_single_image(std::span(&scene.view, 1), scene.camera);
    const Vector6 e = pose_difference(scene.T_flange_camera, result.T_flange_camera);
    sum += e.dot(result.covariance.inverse() * e);
  }
  CHECK(sum / trials == Approx(6).margin(4 * std::sqrt(12.0 / trials)));  // chi-square of six, four standard errors
}

TEST_CASE("points that err together widen the covariance") {
  Random random(5);
  const Scene scene(random, 2, 0.3);
  const Matrix6 alone = calibrate_single_image(std::span(&scene.view, 1), scene.camera).covariance;
  const Matrix6 together =
      calibrate_single_image(std::span(&scene.view, 1), scene.camera, {.correlation = 2}).covariance;
  CHECK(together.isApprox(2 * alone));
  CHECK_THROWS_WITH(calibrate_single_image(std::span(&scene.view, 1), scene.camera, {.correlation = 0.5}),
                    Catch::Contains("correlation"));
}

TEST_CASE("points on one plane are noticed, and are refused when two poses explain them") {
  Random random(3);
  const Scene near(random, 1, 0.1);
  CHECK(calibrate_single_image(std::span(&near.view, 1), near.camera).fit.message.find("one plane") !=
        std::string::npos);
  int refused = 0, wrong = 0;
  constexpr int trials = 200;
  for (int i = 0; i < trials; ++i) {
    const Scene far(random, 1, 1.0, 6.0);
    const auto result = calibrate_single_image(std::span(&far.view, 1), far.camera);
    refused += !result.fit.usable();
    wrong += result.fit.usable() && pose_difference(far.T_flange_camera, result.T_flange_camera).tail<3>().norm() > 0.5;
  }
  CAPTURE(refused, wrong);
  CHECK(refused > trials / 2);
  CHECK(wrong < trials / 20);  // hardly ever the other pose without a word
}

TEST_CASE("too few points and unequal sizes are refused") {
  Random random(4);
  Scene scene(random, 2, 0);
  View few = scene.view;
  few.points.conservativeResize(3, 5), few.pixels.conservativeResize(2, 5);
  CHECK_THROWS_WITH(calibrate_single_image(std::span(&few, 1), scene.camera), Catch::Contains("at least 6"));
  few.pixels.conservativeResize(2, 4);
  CHECK_THROWS_AS(calibrate_single_image(std::span(&few, 1), scene.camera), InvalidArgument);
}

}  // namespace single_image_calibration_test
