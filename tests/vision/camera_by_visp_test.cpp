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
}

}  // namespace camera_by_visp_test
