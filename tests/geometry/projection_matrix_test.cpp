#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/projection_matrix.hpp>

namespace projection_matrix_test {

using namespace kr5;
using Catch::Matchers::Contains;

namespace {

/// A grid of 12 mm squares on two planes, Y = 0 and X = 0, as in section 3.5.
Eigen::Matrix3Xd two_planes(int columns = 7, int rows = 6) {
  Eigen::Matrix3Xd out(3, 2 * columns * rows);
  int i = 0;
  for (int r = 1; r <= rows; ++r)
    for (int c = 1; c <= columns; ++c) {
      out.col(i++) = 0.012 * Eigen::Vector3d(c, 0, r);
      out.col(i++) = 0.012 * Eigen::Vector3d(0, c, r);
    }
  return out;
}

const Pinhole camera{.width = 2448, .height = 2050, .fx = 2330, .fy = 2334, .cx = 1254, .cy = 1012};
const Plane board{.normal = Eigen::Vector3d::UnitY(), .distance = 0.0};

ProjectionMatrix true_matrix() {
  Pose T_grid_camera = Pose::Identity();
  T_grid_camera.translation() = Eigen::Vector3d(0.3, 0.3, 0.15);
  const Eigen::Vector3d z = (Eigen::Vector3d(0.03, 0.03, 0.04) - T_grid_camera.translation()).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  T_grid_camera.linear() << x, z.cross(x), z;
  return projection_matrix(camera, T_grid_camera.inverse());
}

Eigen::Matrix2Xd seen(const ProjectionMatrix& M, const Eigen::Matrix3Xd& points) {
  return (M * points.colwise().homogeneous()).colwise().hnormalized();
}

}  // namespace

TEST_CASE("a projection matrix is found from exact pixels, and takes these back onto the plane") {
  const ProjectionMatrix truth = true_matrix();
  const Eigen::Matrix3Xd points = two_planes();
  const Eigen::Matrix2Xd pixels = seen(truth, points);
  const ProjectionMatrix M = estimate_projection_matrix(points, pixels);
  CHECK((M - truth).norm() < 1e-8 * truth.norm());  // at the same scale: lambda is the depth
  for (Eigen::Index i = 0; i < points.cols(); i += 2)
    CHECK((back_project(M, pixels.col(i), board) - points.col(i)).norm() < 1e-10);
}

TEST_CASE("the exact covariance of a back-projection is that of the simulation, at every corner") {
  const Eigen::Matrix3Xd points = two_planes();
  const Eigen::Matrix2Xd pixels = seen(true_matrix(), points);
  for (const bool noisy_pixel : {false, true}) {
    const BackProjectionResult r = back_projection_uncertainty(
        points, pixels, board, {.sigma_pixel = 0.2, .noisy_pixel = noisy_pixel, .draws = 4000});
    REQUIRE(r.corners.size() == 42);
    for (const BackProjectedCorner& corner : r.corners) {
      CAPTURE(corner.index, noisy_pixel);
      // 4000 draws: a standard error of 1.6 % in a product, of which there are four.
      CHECK((corner.simulated - corner.covariance).norm() < 0.08 * corner.covariance.norm());
      CHECK(corner.covariance.col(1).norm() == 0);  // on the plane Y = 0
      CHECK(corner.simulated_mean.norm() < 0.2 * std::sqrt(corner.covariance.trace()));
    }
  }
}

TEST_CASE("back-projection errors grow in proportion to the noise, and toward the edge of the board") {
  const Eigen::Matrix3Xd points = two_planes();
  const Eigen::Matrix2Xd pixels = seen(true_matrix(), points);
  const auto deviation = [&](double noise) {
    const auto r = back_projection_uncertainty(points, pixels, board, {.sigma_pixel = noise, .draws = 2000});
    const Eigen::Matrix3d& C = r.corners[20].simulated;
    return std::pair{std::sqrt(C(0, 0)), std::sqrt(C(2, 2))};
  };
  const auto [x1, z1] = deviation(1.0);
  for (const double noise : {0.05, 0.1, 0.5}) {  // the same draws: what differs is second order
    const auto [x, z] = deviation(noise);
    CHECK(x / noise == Approx(x1).epsilon(0.02));
    CHECK(z / noise == Approx(z1).epsilon(0.02));
  }
  const auto r = back_projection_uncertainty(points, pixels, board, {.sigma_pixel = 0.1, .draws = 0});
  double centre = 1, corner = 1;
  for (const BackProjectedCorner& c : r.corners) {
    const double size = std::sqrt(c.covariance.trace());
    if ((c.point - Eigen::Vector3d(0.048, 0, 0.036)).norm() < 1e-6) centre = size;
    if ((c.point - Eigen::Vector3d(0.084, 0, 0.072)).norm() < 1e-6) corner = size;
  }
  CHECK(corner > 1.3 * centre);
}

TEST_CASE("eq. 3.56 is another number than the exact covariance, and follows the noise as it does") {
  const Eigen::Matrix3Xd points = two_planes();
  const Eigen::Matrix2Xd pixels = seen(true_matrix(), points);
  const auto at = [&](double noise, double unit = 1.0) {
    return back_projection_uncertainty(points, pixels, board, {.sigma_pixel = noise, .length_unit = unit, .draws = 0});
  };
  const auto one = at(1), half = at(0.5);
  CHECK(half.sigma_matrix == Approx(0.5 * one.sigma_matrix));
  CHECK((4 * half.corners[0].approximate - one.corners[0].approximate).norm() <
        1e-9 * one.corners[0].approximate.norm());
  CHECK((one.corners[0].approximate - one.corners[0].covariance).norm() > one.corners[0].covariance.norm());
  CHECK((at(1, 1e-3).corners[0].approximate - one.corners[0].approximate).norm() > one.corners[0].covariance.norm());
  CHECK((at(1, 1e-3).corners[0].covariance - one.corners[0].covariance).norm() == 0);  // of no unit
  // s_M is that of matrices estimated from noisy pixels, at the scale of unit depth.
  Random random(3);
  double squares = 0;
  for (int i = 0; i < 500; ++i) {
    const Eigen::VectorXd noise = random.normal_vector(2 * pixels.cols(), 0.05);
    const Eigen::Matrix2Xd noisy = pixels + Eigen::Map<const Eigen::Matrix2Xd>(noise.data(), 2, pixels.cols());
    squares += (estimate_projection_matrix(points, noisy) - one.M).squaredNorm() / (12 * 500);
  }
  CHECK(std::sqrt(squares) == Approx(0.05 * one.sigma_matrix).epsilon(0.1));
}

TEST_CASE("points that give no projection matrix, or no point, are refused") {
  const Eigen::Matrix3Xd points = two_planes();
  const Eigen::Matrix2Xd pixels = seen(true_matrix(), points);
  Eigen::Matrix3Xd flat = points;
  flat.row(1).setZero();
  CHECK_THROWS_WITH(estimate_projection_matrix(flat, pixels), Contains("lie in one plane"));
  CHECK_THROWS_WITH(estimate_projection_matrix(points.leftCols(5), pixels.leftCols(5)), Contains("found 5"));
  CHECK_THROWS_WITH(estimate_projection_matrix(points, pixels.leftCols(9)), Contains("84 points and 9 pixels"));
  Eigen::Matrix2Xd bad = pixels;
  bad(0, 3) = NAN;
  CHECK_THROWS_WITH(estimate_projection_matrix(points, bad), Contains("finite"));
  CHECK_THROWS_WITH(back_projection_uncertainty(points, pixels, {.normal = {0, 1, 0}, .distance = 1}),
                    Contains("no point lies on the plane"));
  CHECK_THROWS_WITH(back_projection_uncertainty(points, pixels, {.normal = {0, 2, 0}}), Contains("unit vector"));
  CHECK_THROWS_WITH(back_projection_uncertainty(points, pixels, board, {.sigma_pixel = 0}), Contains("sigma_pixel"));
}

}  // namespace projection_matrix_test
