
#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/target.hpp>
#include <kr5/uncertainty/confidence.hpp>
#include <kr5/vision/target_pose.hpp>
#include <support/coverage.hpp>
#include <support/trials.hpp>

namespace target_pose_test {

using namespace kr5;
using namespace kr5::vision;

namespace {

Pinhole camera() {
  Pinhole c{.width = 1280, .height = 960, .fx = 1200, .fy = 1195, .cx = 630, .cy = 485};
  c.k1 = -0.15;
  return c;
}

View seen(const Target& target, const Pose& T, double sigma, Random& random) {
  const TargetPoints all = target_points(target);
  View view{
      .name = "synthetic", .points = all.points, .pixels = Eigen::Matrix2Xd(2, all.points.cols()), .ids = all.ids};
  for (Eigen::Index i = 0; i < all.points.cols(); ++i)
    view.pixels.col(i) =
        camera().project(T * all.points.col(i)) + Eigen::Vector2d(random.normal(sigma), random.normal(sigma));
  return view;
}

Pose random_pose(Random& random, double distance) {
  Pose T = Pose::Identity();
  const double azimuth = random.uniform(0, 6.28);
  T.linear() = exp_rotation(random.uniform(0.3, 0.9) * Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0)) *
               exp_rotation(random.uniform(-3, 3) * Eigen::Vector3d::UnitZ());
  T.translation() = Eigen::Vector3d(random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), 1) * distance;
  return T;
}

}  // namespace

TEST_CASE("the 95 % region of a pose holds the truth in 95 % of the trials", "[coverage][statistics]") {
  const bool given = GENERATE(true, false);
  // Four corners leave two degrees of freedom to estimate the noise on.
  const std::string name = GENERATE("chessboard:5x7:0.02", "tag:36h11:0:0.1");
  const int trials = test::trials(2000, 500);
  const Target target = parse_target(name);
  Random random(7);
  test::Coverage coverage("pose of " + name + (given ? ", noise given" : ", noise estimated"), 6);
  const double sigma = name[0] == 'c' ? 0.2 : 0.02;
  for (int i = 0; i < trials; ++i) {
    const Pose T = random_pose(random, 0.4);
    const TargetPose pose = estimate_target_pose(seen(target, T, sigma, random), camera(),
                                                 {.sigma_pixel = given ? sigma : 0.0, .huber = 0});
    REQUIRE(pose.fit.usable());
    coverage.add(pose_difference(pose.T_camera_target, T), pose.covariance, pose.covariance_dof);
    CHECK(is_rotation(pose.T_camera_target.linear()));
    CHECK(pose.T_camera_target.translation().z() > 0);
  }
  CAPTURE(given, name, coverage.inside(), trials);
  coverage.check_mean();
  coverage.check_rate();
}

TEST_CASE("of two poses the right one comes first unless the view is called ambiguous", "[statistics]") {
  const Target tag = parse_target("tag:36h11:0:0.05");
  Random random(21);
  int sure = 0, right = 0, doubtful = 0;
  for (int i = 0; i < 600; ++i) {
    const Pose T = random_pose(random, random.uniform(0.3, 3.0));
    const TargetPose pose = estimate_target_pose(seen(tag, T, 0.15, random), camera(), {.sigma_pixel = 0.15});
    REQUIRE(pose.fit.usable());
    if (pose.ambiguous) {
      REQUIRE(pose.T_camera_target_second.has_value());
      CHECK(pose.error_ratio >= 1);
      ++doubtful;
      continue;
    }
    ++sure;
    const double error = pose_difference(pose.T_camera_target, T).tail<3>().norm();
    const double other =
        pose.T_camera_target_second ? pose_difference(*pose.T_camera_target_second, T).tail<3>().norm() : 1e9;
    right += error < other;
  }
  CAPTURE(sure, right, doubtful);
  CHECK(doubtful > 20);
  CHECK(sure > 200);
  CHECK(uncertainty::binomial_interval(right, sure, 0.95).low > 0.97);
}

TEST_CASE("a target in space has one pose") {
  Target map;
  map.kind = TargetKind::MarkerMap;
  Pose side = Pose::Identity();
  side.linear() = exp_rotation(Eigen::Vector3d(0, 0.9, 0));
  side.translation() = Eigen::Vector3d(0.09, 0, 0.03);
  map.map = {{0, 0.05, Pose::Identity()}, {1, 0.05, side}};
  Random random(3);
  Pose T = Pose::Identity();
  T.translation().z() = 0.4;
  const TargetPose pose = estimate_target_pose(seen(map, T, 0.1, random), camera());
  REQUIRE(pose.fit.usable());
  CHECK_FALSE(pose.ambiguous);
  CHECK(pose_difference(pose.T_camera_target, T).norm() < 0.01);
}

TEST_CASE("views that hold no pose get a status, broken ones an exception") {
  View view;
  view.points = Eigen::Matrix3Xd::Zero(3, 3);
  view.pixels = Eigen::Matrix2Xd::Zero(2, 3);
  CHECK_FALSE(estimate_target_pose(view, camera()).fit.usable());
  view.points = Eigen::Matrix3Xd::Zero(3, 5);
  view.points.row(0) = Eigen::RowVectorXd::LinSpaced(5, 0, 0.1);
  view.pixels = Eigen::Matrix2Xd::Constant(2, 5, 400);
  view.pixels.row(0) = Eigen::RowVectorXd::LinSpaced(5, 500, 700);
  CHECK_FALSE(estimate_target_pose(view, camera()).fit.usable());
  view.pixels(0, 0) = std::nan("");
  CHECK_THROWS_AS(estimate_target_pose(view, camera()), InvalidArgument);
  view.pixels = Eigen::Matrix2Xd::Zero(2, 4);
  CHECK_THROWS_AS(estimate_target_pose(view, camera()), InvalidArgument);
  CHECK_THROWS_AS(estimate_target_pose(view, camera(), {.ambiguous_from = 0.9}), InvalidArgument);
}

TEST_CASE("of few points the noise is that of their detection, of many that of the view", "[target_pose]") {
  Random random(31);
  const Pose T = random_pose(random, 0.4);
  for (const std::string name : {"tag:36h11:5:0.05", "chessboard:5x7:0.02"}) {
    Detection found;
    found.status = DetectStatus::Found;
    found.view = seen(parse_target(name), T, 0.02, random);
    found.sigma = Eigen::VectorXd::Constant(found.view.pixels.cols(), 0.3);
    found.correlation = 2.0;
    const bool few = found.sigma.size() == 4;
    const TargetPose pose = estimate_target_pose(found, camera());
    const TargetPose same =
        estimate_target_pose(found.view, camera(), {.sigma_pixel = few ? 0.3 : 0.0, .correlation = 2.0});
    REQUIRE(pose.fit.usable());
    CHECK(pose.covariance == same.covariance);
    CHECK((few ? pose.sigma_pixel == 0.3 : pose.sigma_pixel < 0.05));
  }
  Detection rough;  // not refined
  rough.view = seen(parse_target("tag:36h11:5:0.05"), T, 0.02, random);
  rough.sigma = Eigen::VectorXd::Zero(4);
  CHECK(estimate_target_pose(rough, camera()).covariance_dof == 2);
  CHECK_FALSE(estimate_target_pose(Detection(), camera()).fit.usable());
}

TEST_CASE("the pose of a marker is that of its corners", "[target_pose]") {
  Random random(32);
  const Pose T = random_pose(random, 0.4);
  const View view = seen(parse_target("tag:36h11:5:0.05"), T, 0.02, random);
  TagDetection tag;
  tag.family = "36h11", tag.id = 5, tag.corners = view.pixels, tag.correlation = 3.0;
  tag.sigma.setConstant(0.02);
  const View own = tag_view(tag, 0.05);
  CHECK(own.points.isApprox(view.points, 1e-12));
  CHECK(own.ids == view.ids);
  const TargetPose pose = estimate_tag_pose(tag, 0.05, camera());
  REQUIRE(pose.fit.usable());
  CHECK(pose.covariance == estimate_target_pose(view, camera(), {.sigma_pixel = 0.02, .correlation = 3.0}).covariance);
  CHECK(pose_difference(estimate_tag_pose(tag, 0.1, camera()).T_camera_target, T).head<3>().norm() > 0.3);
  for (const double size : {0.0, -1.0, std::nan("")})
    CHECK_THROWS_AS(estimate_tag_pose(tag, size, camera()), InvalidArgument);
  tag.corners(0, 0) = std::nan("");
  CHECK_THROWS_AS(estimate_tag_pose(tag, 0.05, camera()), InvalidArgument);
}

}  // namespace target_pose_test
