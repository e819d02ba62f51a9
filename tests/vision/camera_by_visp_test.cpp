#include <algorithm>
#include <cmath>
#include <string>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/vision/camera_calibration.hpp>

#include "support/camera_scene.hpp"
#include "support/opencv_camera.hpp"

namespace camera_by_visp_test {

using namespace kr5;
using namespace kr5::vision;
using namespace kr5::test;

TEST_CASE("OpenCV and ViSP answer the same question on the same views", "[not_sanitized]") {
  Random random(1);
  Pinhole c = true_camera();
  c.k1 = -0.1, c.k2 = 0;
  Scene s;
  s.noise = 0.1;
  const std::vector<View> views = see_many(random, c, s, 10);
  CameraOptions o, visp;
  o.lens = LensModel::K1, o.square_pixels = false, o.bent_target = false, o.robust = false, o.folds = 0;
  visp.method = CameraMethod::Visp;
  const CameraCalibration ours = calibrate_camera(views, c.width, c.height, o);
  const CameraCalibration by_visp = calibrate_camera(views, c.width, c.height, visp);
  REQUIRE(by_visp.fit.usable());
  CHECK(by_visp.fit.message == "converged");
  CHECK(by_visp.lens == LensModel::K1);
  CHECK(by_visp.views.size() == views.size());
  const OpencvCamera opencv = opencv_camera(views, c.width, c.height, 1);
  for (const OpencvCamera& peer :
       {opencv, OpencvCamera{by_visp.camera, by_visp.rms_px, std::sqrt(by_visp.covariance(0, 0))}}) {
    CHECK(std::abs(peer.camera.fx - c.fx) < 5);
    CHECK(std::abs(peer.camera.k1 - c.k1) < 0.01);
    CHECK(ours.rms_px <= peer.rms_px + 1e-4);
    CHECK(peer.fx_std == Approx(std::sqrt(ours.covariance(0, 0))).epsilon(0.1));
  }
}

TEST_CASE("a corner that is far off counts fully in what ViSP's least squares say of their uncertainty",
          "[not_sanitized]") {
  const Pinhole c = true_camera();
  Random random(3);
  Pinhole simple = c;
  simple.k1 = -0.1, simple.k2 = 0;
  Scene s;
  s.noise = 0.1;
  std::vector<View> views = see_many(random, simple, s, 10);
  views[2].pixels.col(4) += Eigen::Vector2d(-30.0, 0.0);
  CameraOptions visp;
  visp.method = CameraMethod::Visp;
  const CameraCalibration result = calibrate_camera(views, c.width, c.height, visp);
  CAPTURE(result.fit.message, result.camera.fx, result.sigma_pixel);
  REQUIRE(result.fit.usable());
  const double points = 10.0 * static_cast<double>(views[0].points.cols());
  CHECK(result.sigma_pixel == Approx(std::sqrt(30 * 30 / (2 * points))).epsilon(0.1));
  CHECK(std::abs(result.camera.fx - c.fx) < 4 * std::sqrt(result.covariance(0, 0)));
}

TEST_CASE("choices that ViSP does not have are refused by name") {
  const auto refused = [](auto&& set, const std::string& field) {
    CameraOptions visp;
    visp.method = CameraMethod::Visp;
    set(visp);
    CHECK_THROWS_WITH(visp.validate(), Catch::Contains(field) && Catch::Contains("method visp"));
  };
  refused([](CameraOptions& o) { o.square_pixels = true; }, "square_pixels");
  refused([](CameraOptions& o) { o.bent_target = false; }, "bent_target");
  refused([](CameraOptions& o) { o.reject_views = false; }, "reject_views");
  refused([](CameraOptions& o) { o.false_alarm = 0.1; }, "false_alarm");
  refused([](CameraOptions& o) { o.folds = 0; }, "folds");
  refused([](CameraOptions& o) { o.max_iterations = 99; }, "max_iterations");
}

TEST_CASE("a lens model that ViSP does not have is refused") {
  Random random(2);
  const Pinhole c = true_camera();
  CameraOptions visp;
  visp.method = CameraMethod::Visp;
  CHECK_THROWS_AS(calibrate_camera({}, c.width, c.height, visp), InvalidArgument);
  visp.lens = LensModel::Brown5;
  CHECK_THROWS_WITH(calibrate_camera(see_many(random, c, Scene(), 3), c.width, c.height, visp),
                    Catch::Contains("method visp"));
}

TEST_CASE("views that do not determine the camera are told with ViSP's method, too", "[not_sanitized]") {
  Random random(7);
  const Pinhole c = true_camera();
  Scene s;
  s.tilt = 0.01;
  CameraOptions visp;
  visp.method = CameraMethod::Visp;
  const CameraCalibration result = calibrate_camera(see_many(random, c, s, 8), c.width, c.height, visp);
  CHECK_FALSE(result.fit.usable());
  CAPTURE(result.fit.message);
  CHECK(std::any_of(result.findings.begin(), result.findings.end(),
                    [](const CameraFinding& finding) { return finding.cause == "fronto_parallel"; }));
}

}  // namespace camera_by_visp_test
