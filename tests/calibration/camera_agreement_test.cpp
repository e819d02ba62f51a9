#include <catch2/catch.hpp>

#include <kr5/calibration/camera_agreement.hpp>
#include <kr5/core/error.hpp>

namespace camera_agreement_test {

using namespace kr5;
using namespace kr5::calibration;

namespace {

/// A result whose camera is known to 1 mm and 1 mrad, behind a coordinate of the arm.
KinematicsResult found_camera() {
  KinematicsResult out;
  out.fit.status = FitStatus::Converged;
  out.T_flange_camera = to_pose((Vector6() << 0.1, 0, 0.05, 0.2, -0.1, 0.3).finished());
  for (const char* name : {"arm.joint2.a", "camera.x", "camera.y", "camera.z", "camera.rx", "camera.ry", "camera.rz"})
    out.coordinates.push_back({.name = name, .unit = "m"});
  out.covariance = 1e-6 * Eigen::MatrixXd::Identity(7, 7);
  out.covariance(0, 0) = 1.0;
  return out;
}

}  // namespace

TEST_CASE("a stated camera is as far away as its covariance says, and believed below the limit of six") {
  const KinematicsResult found = found_camera();
  KinematicsOptions stated;
  Vector6 d;
  d << 1e-3, -2e-3, 0, 1e-3, 0, 3e-3;
  stated.T_flange_camera = found.T_flange_camera * to_pose(d);
  const auto near = camera_agreement(found, stated);
  REQUIRE(near);
  CHECK(near->dof == 6);
  CHECK(near->squared_distance == Approx(15.0).epsilon(1e-6));
  CHECK(near->limit == Approx(22.458).epsilon(1e-4));  // chi-square of six, one in a thousand
  CHECK(near->believed);
  stated.T_flange_camera = found.T_flange_camera * to_pose(Vector6(1.5 * d));
  CHECK_FALSE(camera_agreement(found, stated)->believed);
}

TEST_CASE("a camera that was held, or of an unusable calibration, is compared with nothing") {
  KinematicsResult found = found_camera();
  KinematicsOptions stated;
  stated.T_flange_camera = found.T_flange_camera;
  CHECK(camera_agreement(found, stated)->squared_distance == Approx(0.0).margin(1e-12));
  found.coordinates.resize(1), found.covariance.conservativeResize(1, 1);
  CHECK_FALSE(camera_agreement(found, stated));
  found = found_camera();
  found.fit.status = FitStatus::Degenerate;
  CHECK_FALSE(camera_agreement(found, stated));
  CHECK_THROWS_AS(camera_agreement(found, stated, 0.0), InvalidArgument);
}

}  // namespace camera_agreement_test
