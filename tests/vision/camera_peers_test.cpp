#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/vision/camera_calibration.hpp>
#include <kr5/vision/camera_peers.hpp>

#include "support/camera_scene.hpp"

namespace camera_peers_test {

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
  CameraOptions o;
  o.lens = LensModel::K1, o.square_pixels = false, o.bent_target = false, o.robust = false, o.folds = 0;
  const CameraCalibration ours = calibrate_camera(views, c.width, c.height, o);
  for (const CameraCalibration& peer : {calibrate_camera_opencv(views, c.width, c.height, LensModel::K1),
                                        calibrate_camera_visp(views, c.width, c.height)}) {
    CAPTURE(peer.fit.message);
    REQUIRE(peer.fit.usable());
    CHECK(std::abs(peer.camera.fx - c.fx) < 5);
    CHECK(std::abs(peer.camera.k1 - c.k1) < 0.01);
    CHECK(peer.views.size() == views.size());
    CHECK(ours.rms_px <= peer.rms_px + 1e-4);
  }
  const CameraCalibration opencv = calibrate_camera_opencv(views, c.width, c.height, LensModel::K1);
  CHECK(std::sqrt(opencv.covariance(0, 0)) == Approx(std::sqrt(ours.covariance(0, 0))).epsilon(0.1));
}

TEST_CASE("lens models that a peer does not have are refused") {
  Random random(2);
  const Pinhole c = true_camera();
  const std::vector<View> views = see_many(random, c, Scene(), 3);
  CHECK_THROWS_AS(calibrate_camera_opencv(views, c.width, c.height, LensModel::Radial6), InvalidArgument);
  CHECK_THROWS_AS(calibrate_camera_visp(views, c.width, c.height, LensModel::Brown5), InvalidArgument);
  CHECK_THROWS_AS(calibrate_camera_visp({}, c.width, c.height), InvalidArgument);
}

}  // namespace camera_peers_test
