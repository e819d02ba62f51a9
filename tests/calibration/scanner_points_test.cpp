#include <limits>

#include <catch2/catch.hpp>

#include <calibration/scanner_world.hpp>
#include <kr5/core/error.hpp>
#include <support/coverage.hpp>
#include <support/trials.hpp>

namespace scanner_points_test {

using namespace kr5;
using namespace kr5::test;
using Catch::Matchers::Contains;

TEST_CASE("the book's printed scanner pose is recovered from three points, whatever their order") {
  const Pose T = book_scanner_pose();
  const Eigen::Matrix4d printed = printed_scanner_pose();
  CHECK(printed.topLeftCorner<3, 3>().determinant() == Approx(1.00005).margin(1e-5));
  CHECK((T.linear() - printed.topLeftCorner<3, 3>()).cwiseAbs().maxCoeff() < 6.3e-5);
  CHECK(T.linear().determinant() == Approx(1.0).margin(1e-14));
  Eigen::Matrix2Xd points(2, 3);
  points << 0.03, -0.02, 0.005, 0.20, 0.19, 0.17;  // two of the surface, and a tip nearer to the scanner
  for (const auto& order : {Eigen::Vector3i(0, 1, 2), Eigen::Vector3i(1, 0, 2), Eigen::Vector3i(2, 1, 0)}) {
    Eigen::Matrix2Xd seen(2, 3);
    Eigen::Matrix3Xd known(3, 3);
    for (int k = 0; k < 3; ++k) {
      seen.col(k) = points.col(order[k]);
      known.col(k) = T * Eigen::Vector3d(seen(0, k), 0, seen(1, k));
    }
    const ScannerFromPoints found = scanner_from_points(seen, known);
    REQUIRE(found.fit.usable());
    CHECK(pose_difference(T, found.T_flange_scanner).norm() < 1e-13);
    CHECK(found.rms < 1e-14);
  }
}

TEST_CASE("equations 2.1 to 2.5 hold under their conditions of sign, and turn the scanner without them") {
  const Pose T = book_scanner_pose();
  const auto at = [&](double x, double z) { return Eigen::Vector3d(T * Eigen::Vector3d(x, 0, z)); };
  const Eigen::Vector3d right = at(0.03, 0.2), left = at(-0.02, 0.2), near = at(0.0, 0.17), far = at(0.0, 0.23);
  const auto error = [&](const Eigen::Matrix3d& R) { return log_rotation(T.linear().transpose() * R).norm(); };
  CHECK(error(hayat2022_scanner_rotation(right, left, far)) < 1e-13);
  CHECK(error(hayat2022_scanner_rotation(right, left, near, true)) < 1e-13);
  CHECK(error(hayat2022_scanner_rotation(right, left, near)) == Approx(M_PI).margin(1e-6));  // turned about X
  CHECK(error(hayat2022_scanner_rotation(left, right, far)) == Approx(M_PI).margin(1e-6));   // turned about Z
  CHECK(hayat2022_scanner_rotation(left, right, near).determinant() == Approx(1.0));
  CHECK_THROWS_WITH(hayat2022_scanner_rotation(right, left, at(0.0, 0.2)), Contains("on one line"));
}

TEST_CASE("points on one line, too few points and NaN are told") {
  Eigen::Matrix2Xd seen(2, 4);
  seen << 0.0, 0.01, 0.02, 0.03, 0.2, 0.2, 0.2, 0.2;
  Eigen::Matrix3Xd known = Eigen::Matrix3Xd::Zero(3, 4);
  known.row(0) = seen.row(0), known.row(2) = seen.row(1);
  CHECK_THAT(scanner_from_points(seen, known).fit.message, Contains("on one line"));
  CHECK_FALSE(scanner_from_points(seen, known).fit.usable());
  CHECK_FALSE(scanner_from_points(seen.leftCols(2), known.leftCols(2)).fit.usable());
  CHECK_THROWS_WITH(scanner_from_points(seen, known.leftCols(3)), Contains("4 points in the scanner and 3"));
  seen(0, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(scanner_from_points(seen, known), Contains("finite"));
}

TEST_CASE("the scanner in the camera follows from both mounts, and shared errors cancel") {
  Random random(3);
  UncertainPose camera, scanner;
  Vector6 d;
  d << random.normal_vector(3, 0.1), random.normal_vector(3, 1.0);
  camera.T = to_pose(d);
  scanner.T = book_scanner_pose();
  const Pose T = camera.T.inverse() * scanner.T;
  camera.covariance = 1e-8 * Matrix6::Identity();
  scanner.covariance = 4e-8 * Matrix6::Identity();
  CHECK(pose_difference(T, camera_scanner(camera, scanner).T).norm() < 1e-14);

  // The spread of sampled errors, which is what the covariance states.
  const int samples = 4000;
  Matrix6 spread = Matrix6::Zero();
  for (int k = 0; k < samples; ++k) {
    const Pose C = camera.T * to_pose(Vector6(random.normal_vector(6, 1e-4))),
               L = scanner.T * to_pose(Vector6(random.normal_vector(6, 2e-4)));
    const Vector6 e = pose_difference(T, C.inverse() * L);
    spread += e * e.transpose() / samples;
  }
  const Matrix6 stated = camera_scanner(camera, scanner).covariance;
  for (int k = 0; k < 6; ++k) CHECK(spread(k, k) == Approx(stated(k, k)).epsilon(0.1));  // 4.5 sigma of 4000 samples

  // One error of the flange that moves both alike, T_flange' = E T_flange, leaves the scanner in the camera as it was.
  const Matrix6 E = 1e-8 * Matrix6::Identity();
  const Matrix6 c = adjoint(camera.T.inverse()), l = adjoint(scanner.T.inverse());
  camera.covariance = c * E * c.transpose(), scanner.covariance = l * E * l.transpose();
  CHECK(camera_scanner(camera, scanner, c * E * l.transpose()).covariance.norm() < 1e-18);
  CHECK(camera_scanner(camera, scanner).covariance.norm() > 1e-9);
  CHECK_THROWS_WITH(camera_scanner(camera, scanner, Matrix6(3 * c * E * l.transpose())), Contains("camera_scanner"));
}

TEST_CASE("the book's laser covariance reaches the flange as corrected, positive definite", "[scanner]") {
  // Eq. 3.60 by eq. 3.61 with T_L gives eq. 3.68 but for its decimal slip, 0.09341 for 0.9341 (mm^2).
  Eigen::Matrix3d laser = Eigen::Matrix3d::Zero();
  laser(0, 0) = 0.0346, laser(2, 2) = 0.9298, laser(0, 2) = laser(2, 0) = -0.1104;
  CHECK(std::sqrt(laser(0, 0)) == Approx(0.186).margin(5e-4));
  CHECK(std::sqrt(laser(2, 2)) == Approx(0.964).margin(5e-4));
  const Eigen::Matrix3d R = book_scanner_pose().linear();
  const Eigen::Matrix3d found = R * laser * R.transpose() + 1e-4 * Eigen::Matrix3d::Identity();
  Eigen::Matrix3d corrected;
  corrected << 0.0187, 0.0146, -0.0663, 0.0146, 0.0115, -0.024, -0.0663, -0.024, 0.9341;
  CHECK((found - corrected).cwiseAbs().maxCoeff() < 0.0072);
  CHECK(is_covariance(found));
  corrected(2, 2) = 0.09341;
  CHECK_FALSE(is_covariance(corrected));
}

}  // namespace scanner_points_test
