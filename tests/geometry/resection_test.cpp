#include <algorithm>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/resection.hpp>

namespace resection_test {

using namespace kr5;

namespace {

Pinhole camera() {
  Pinhole c{.width = 1280, .height = 960, .fx = 1100, .fy = 1098, .cx = 645, .cy = 478};
  c.k1 = -0.12, c.k2 = 0.05, c.p1 = 2e-4;
  return c;
}

Eigen::Matrix3Xd board(int rows, int cols, double size) {
  Eigen::Matrix3Xd points(3, rows * cols);
  for (int row = 0; row < rows; ++row) {
    for (int col = 0; col < cols; ++col) points.col(row * cols + col) << size * col, size * row, 0.0;
  }
  return points;
}

Eigen::Matrix2Xd project(const Pinhole& c, const Pose& T, const Eigen::Matrix3Xd& points, Random* random = nullptr,
                         double sigma = 0) {
  Eigen::Matrix2Xd pixels(2, points.cols());
  for (int i = 0; i < points.cols(); ++i) {
    pixels.col(i) = c.project(T * points.col(i));
    if (random) pixels.col(i) += random->normal_vector(2, sigma);
  }
  return pixels;
}

Pose random_view(Random& random, double tilt) {
  Pose T = Pose::Identity();
  T.linear() = exp_rotation(tilt * random.uniform(0.3, 1.0) * random.direction()) *
               exp_rotation(Eigen::Vector3d(0, 0, random.uniform(-3, 3)));
  T.translation() << random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), random.uniform(0.5, 1.0);
  return T;
}

}  // namespace

TEST_CASE("the pose of exact points is exact, on a plane or in space, with four points or many") {
  const Pinhole c = camera();
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const Pose T = random_view(random, 0.7);
    const int kind = i % 4;
    Eigen::Matrix3Xd points = kind == 0 ? board(6, 9, 0.02) : kind == 1 ? board(2, 2, 0.08) : Eigen::Matrix3Xd();
    if (kind >= 2) {
      points.resize(3, kind == 2 ? 5 : 20);
      for (int k = 0; k < points.cols(); ++k) points.col(k) = random.normal_vector(3, 0.05);
    }
    if (kind == 1) points = exp_rotation({0.3, -1.2, 0.4}) * points;  // a plane need not be z = 0
    const auto found = resect(points, project(c, T, points), c);
    CAPTURE(i, kind);
    REQUIRE_FALSE(found.empty());
    CHECK(pose_difference(T, found[0].T_camera_points).norm() < 1e-6);
    CHECK(found[0].rms_px < 1e-6);
  }
}

TEST_CASE("both poses of a small planar target are offered and one of them is right") {
  const Pinhole c = camera();
  const Eigen::Matrix3Xd points = board(2, 2, 0.03);
  Random random(4);
  int first = 0, any = 0, two = 0;
  const int trials = 200;
  for (int i = 0; i < trials; ++i) {
    Pose T = random_view(random, 0.5);
    T.translation().z() = 1.2;
    const auto found = resect(points, project(c, T, points, &random, 0.3), c);
    REQUIRE_FALSE(found.empty());
    two += found.size() == 2;
    const auto right = [&](const Resection& r) {
      return pose_difference(T, r.T_camera_points).tail<3>().norm() < 0.25;
    };
    first += right(found[0]);
    any += right(found[0]) || (found.size() == 2 && right(found[1]));
  }
  CHECK(two > trials / 2);
  CHECK(any > first);
  CHECK(any > 0.95 * trials);
}

TEST_CASE("one of the two poses of a distant grid is right") {
  const Pinhole c = camera();
  const double sigma = 0.3;
  Random random(11);
  for (const auto& points : {board(2, 2, 0.05), board(3, 4, 0.03), board(10, 10, 0.01)}) {
    int right = 0;
    const int trials = 500;
    for (int i = 0; i < trials; ++i) {
      Pose T = random_view(random, 1.1);
      T.translation() = 4 * Eigen::Vector3d(random.uniform(-0.4, 0.4), random.uniform(-0.3, 0.3), 1);
      const auto found = resect(points, project(c, T, points, &random, sigma), c);
      right += std::any_of(found.begin(), found.end(), [&](const Resection& r) {
        const Vector6 d = pose_difference(r.T_camera_points, T);
        return d.dot(r.information * d) < sigma * sigma * 27.86;  // chi-square, 6 degrees of freedom, 99.99 %
      });
    }
    CAPTURE(points.cols(), right);
    // The chi-square is that of small errors; where the tilt is hardly seen they are not small.
    CHECK(right > 0.98 * trials);
  }
}

TEST_CASE("the reported information is that of the scatter") {
  const Pinhole c = camera();
  const Eigen::Matrix3Xd points = board(5, 7, 0.03);
  Random random(6);
  int inside = 0;
  const int trials = 1000;
  const double sigma = 0.4;
  for (int i = 0; i < trials; ++i) {
    const Pose T = random_view(random, 0.6);
    const auto found = resect(points, project(c, T, points, &random, sigma), c, {.huber = 0});
    REQUIRE_FALSE(found.empty());
    const Vector6 d = pose_difference(found[0].T_camera_points, T);
    inside += d.dot(found[0].information * d) / (sigma * sigma) < 12.592;  // chi-square, 6 degrees of freedom, 95 %
  }
  CHECK(std::abs(inside - 0.95 * trials) < 3.29 * std::sqrt(0.95 * 0.05 * trials));  // binomial, 99.9 %
}

TEST_CASE("a few points far off hardly move the pose and get little weight") {
  const Pinhole c = camera();
  const Eigen::Matrix3Xd points = board(6, 9, 0.025);
  Random random(7);
  for (int i = 0; i < 50; ++i) {
    const Pose T = random_view(random, 0.6);
    Eigen::Matrix2Xd pixels = project(c, T, points, &random, 0.1);
    pixels.col(3) += Eigen::Vector2d(25, -10);
    pixels.col(40) += Eigen::Vector2d(-6, 12);
    const auto found = resect(points, pixels, c);
    REQUIRE_FALSE(found.empty());
    CHECK(pose_difference(T, found[0].T_camera_points).head<3>().norm() < 2e-3);
    CHECK(found[0].weights[3] < 0.1);
    CHECK(found[0].weights[40] < 0.1);
  }
}

TEST_CASE("points on a line have no pose, and malformed input is refused") {
  const Pinhole c = camera();
  Eigen::Matrix3Xd line(3, 5);
  for (int i = 0; i < 5; ++i) line.col(i) << 0.01 * i, 0.02 * i, 0;
  Pose T = Pose::Identity();
  T.translation().z() = 0.5;
  CHECK(resect(line, project(c, T, line), c).empty());
  const Eigen::Matrix3Xd square = board(2, 2, 0.1);
  Eigen::Matrix2Xd pixels = project(c, T, square);
  CHECK_THROWS_AS(resect(square.leftCols(3), pixels.leftCols(3), c), InvalidArgument);
  CHECK_THROWS_AS(resect(square, pixels.leftCols(3), c), InvalidArgument);
  CHECK_THROWS_AS(resect(square, pixels, c, {.max_iterations = 0}), InvalidArgument);
  pixels(0, 0) = std::nan("");
  CHECK_THROWS_AS(resect(square, pixels, c), InvalidArgument);
}

}  // namespace resection_test
