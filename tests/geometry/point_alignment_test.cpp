#include <limits>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/point_alignment.hpp>

namespace point_alignment_test {

using namespace kr5;

namespace {

Eigen::Matrix3Xd some_points(Random& random, Eigen::Index n) {
  return Eigen::Matrix3Xd::NullaryExpr(3, n, [&] { return random.normal(); });
}

Eigen::Matrix3Xd carried(const Pose& T, double scale, const Eigen::Matrix3Xd& points) {
  return (scale * (T.linear() * points)).colwise() + T.translation();
}

}  // namespace

TEST_CASE("exact points give the motion between them, and its scale where that is asked for") {
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const Pose T = to_pose(random.normal_vector(6, 2.0));
    const double scale = random.uniform(0.01, 100);
    const Eigen::Matrix3Xd points = some_points(random, 3 + random.integer(20));
    const PointAlignment rigid = align_points(points, carried(T, 1.0, points));
    CHECK(rigid.fit.usable());
    CHECK(rigid.scale == 1.0);
    CHECK(pose_difference(rigid.T_to_from, T).norm() < 1e-9);
    const PointAlignment scaled = align_points(points, carried(T, scale, points), {.scale = true});
    CHECK(scaled.scale == Approx(scale).epsilon(1e-12));
    CHECK(pose_difference(scaled.T_to_from, T).norm() < 1e-9);
  }
}

TEST_CASE("no other motion nearby carries noisy, weighted points nearer, and points without weight do not count") {
  Random random(2);
  for (int trial = 0; trial < 200; ++trial) {
    Eigen::Matrix3Xd from = some_points(random, 12);
    Eigen::Matrix3Xd to = carried(to_pose(random.normal_vector(6)), 1.3, from) + 0.1 * some_points(random, 12);
    Eigen::VectorXd w = Eigen::VectorXd::NullaryExpr(12, [&] { return random.uniform(0.1, 1.0); });
    w[11] = 0.0;
    const PointAlignment best = align_points(from, to, {.scale = true, .weights = w});
    const auto squares = [&](const Pose& T, double scale) {
      return (to - carried(T, scale, from)).colwise().squaredNorm().dot(w);
    };
    const double least = squares(best.T_to_from, best.scale);
    for (int k = 0; k < 10; ++k)
      CHECK(squares(best.T_to_from * to_pose(random.normal_vector(6, 1e-3)), best.scale + random.normal(1e-3)) > least);
    to.col(11).setConstant(1e6);
    CHECK(align_points(from, to, {.scale = true, .weights = w}).scale == Approx(best.scale).epsilon(1e-9));
  }
}

TEST_CASE("a mirror image gives a rotation, which leaves residuals") {
  Random random(3);
  const Eigen::Matrix3Xd points = some_points(random, 10);
  Eigen::Matrix3Xd mirrored = points;
  mirrored.row(1) *= -1;
  const PointAlignment found = align_points(points, mirrored);
  CHECK(is_rotation(found.T_to_from.linear(), 1e-12));
  CHECK((carried(found.T_to_from, 1.0, points) - mirrored).norm() > 0.5);
}

TEST_CASE("points on a plane suffice; on a line, at one place or alone they do not") {
  Random random(4);
  Eigen::Matrix3Xd flat = some_points(random, 6);
  flat.row(2).setZero();
  const Pose T = to_pose(random.normal_vector(6));
  CHECK(pose_difference(align_points(flat, carried(T, 1.0, flat)).T_to_from, T).norm() < 1e-9);
  const Eigen::Matrix3Xd line = Eigen::Vector3d(1, 2, 3) * Eigen::RowVectorXd::LinSpaced(6, -1.0, 1.0);
  const PointAlignment open = align_points(line, carried(T, 1.0, line));
  CHECK_FALSE(open.fit.usable());
  CHECK((carried(open.T_to_from, 1.0, line) - carried(T, 1.0, line)).norm() < 1e-9);
  const Eigen::Matrix3Xd same = Eigen::Vector3d(1, 2, 3).replicate(1, 4);
  const PointAlignment still = align_points(same, same, {.scale = true});
  CHECK_FALSE(still.fit.usable());
  CHECK(still.scale == 1.0);
  CHECK_FALSE(align_points(line.leftCols(1), line.leftCols(1)).fit.usable());
}

TEST_CASE("sets of different sizes, none, NaN and weights that do not fit are refused") {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Random(3, 5);
  CHECK_THROWS_AS(align_points(points, points.leftCols(4)), InvalidArgument);
  CHECK_THROWS_AS(align_points(points.leftCols(0), points.leftCols(0)), InvalidArgument);
  CHECK_THROWS_AS(align_points(points, points, {.weights = Eigen::VectorXd::Ones(4)}), InvalidArgument);
  CHECK_THROWS_AS(align_points(points, points, {.weights = Eigen::VectorXd::Zero(5)}), InvalidArgument);
  CHECK_THROWS_AS(align_points(points, points, {.weights = Eigen::VectorXd::LinSpaced(5, -1, 1)}), InvalidArgument);
  points(1, 2) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(align_points(points, Eigen::Matrix3Xd::Random(3, 5)), InvalidArgument);
}

}  // namespace point_alignment_test
