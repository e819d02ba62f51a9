#include <catch2/catch.hpp>

#include <kr5/calibration/evaluate.hpp>
#include <kr5/calibration/hand_eye.hpp>
#include <kr5/core/error.hpp>
#include <kr5/uncertainty/confidence.hpp>
#include <support/coverage.hpp>
#include <support/hand_eye_world.hpp>
#include <support/rates.hpp>
#include <support/trials.hpp>

namespace hand_eye_test {

using namespace kr5;
using namespace kr5::calibration;
using test::HandEyeWorld;
using test::HandEyeWorldOptions;

namespace {

constexpr double robot_position_noise = 0.003, robot_rotation_noise = 0.005;

HandEyeWorldOptions noisy(int views, Mount mount, std::uint64_t seed) {
  return {.mount = mount,
          .views = views,
          .sigma_robot_position = robot_position_noise,
          .sigma_robot_rotation = robot_rotation_noise,
          .seed = seed};
}

HandEyeResult solve(const HandEyeWorld& w, const HandEyeOptions& options) {
  return calibrate_hand_eye(w.views, w.camera, options);
}

/// Trials of a Monte-Carlo test: all of them on request, else a part with wider limits.
int trials(int all) { return test::trials(all, all / 20); }

/// Moves the robot pose of a view so far that nothing but a blunder explains it.
void spoil(HandEyeWorld& w, std::size_t view, Random& random) {
  Vector6 d;
  d << random.uniform(0.03, 0.2) * random.direction(), random.uniform(0.05, 0.5) * random.direction();
  w.views[view].T_base_flange = w.views[view].T_base_flange * to_pose(d);
}

}  // namespace

TEST_CASE("exact data give the exact answer, for both mounts and many points or one tag") {
  for (const Mount mount : {Mount::EyeInHand, Mount::EyeToHand})
    for (const int side : {2, 6}) {
      const HandEyeWorld w = test::make_hand_eye_world(
          {.mount = mount, .views = 8, .rows = side, .cols = side, .square = 0.18 / side, .sigma_pixel = 0});
      const HandEyeResult r = solve(w, {.mount = mount});
      CAPTURE(name_of(mount), side, r.fit.message);
      REQUIRE(r.fit.usable());
      CHECK(pose_difference(r.T_mount_camera, w.T_mount_camera).norm() < 1e-7);
      CHECK(pose_difference(r.T_fixed_target, w.T_fixed_target).norm() < 1e-7);
      for (const HandEyeViewReport& v : r.views) CHECK_FALSE(v.outlier);
    }
}

TEST_CASE("the 95 % regions of camera and target hold the truth in 95 %, noise given or estimated",
          "[coverage][statistics]") {
  const bool given = GENERATE(false, true);
  const int views = GENERATE(8, 15, 30);
  const Mount mount = views == 15 ? Mount::EyeToHand : Mount::EyeInHand;
  const std::string what = "hand-eye, " + std::to_string(views) + " views, noise " + (given ? "given" : "estimated");
  test::Coverage camera(what + ": camera", 6), target(what + ": target", 6);
  const int n = trials(2000);
  for (int i = 0; i < n; ++i) {
    const HandEyeWorld w = test::make_hand_eye_world(noisy(views, mount, 5000 + i));
    HandEyeOptions options{.mount = mount};
    if (given)
      options.sigma_pixel = 0.2, options.sigma_robot_position = robot_position_noise,
      options.sigma_robot_rotation = robot_rotation_noise;
    const HandEyeResult r = solve(w, options);
    REQUIRE(r.fit.usable());
    camera.add(pose_difference(r.T_mount_camera, w.T_mount_camera), r.covariance, r.covariance_dof);
    target.add(pose_difference(r.T_fixed_target, w.T_fixed_target), r.covariance_target, r.covariance_dof);
  }
  CAPTURE(views, given, n);
  for (const test::Coverage* c : {&camera, &target}) {
    c->check_mean();
    c->check_rate();
  }
}

TEST_CASE("the uncertainty covers corners that err together when told of it, and does not when not",
          "[coverage][statistics]") {
  const double shared = 0.4, sigma = 0.3;  // correlation of any two corners, along each axis of the image; [px]
  HandEyeWorldOptions world{.views = 12, .rows = 2, .cols = 2, .square = 0.1, .sigma_pixel = 0};
  world.sigma_robot_position = world.sigma_robot_rotation = 1e-5;
  const HandEyeOptions options{.sigma_pixel = sigma, .sigma_robot_position = 1e-5, .sigma_robot_rotation = 1e-5};
  test::Coverage told("hand-eye, corners correlated", 6), untold("hand-eye, corners correlated unawares", 6),
      estimated("hand-eye, corners correlated, noise estimated", 6);
  const int n = trials(2000);
  for (int i = 0; i < n; ++i) {
    world.seed = 70'000 + i;
    HandEyeWorld w = test::make_hand_eye_world(world);
    Random random(world.seed);
    for (HandEyeView& v : w.views) {
      v.view.pixels.colwise() += Eigen::Vector2d(random.normal_vector(2, std::sqrt(shared) * sigma));
      for (auto pixel : v.view.pixels.colwise()) pixel += random.normal_vector(2, std::sqrt(1 - shared) * sigma);
    }
    const HandEyeResult blind = solve(w, options);
    for (HandEyeView& v : w.views) v.correlation = 1 + 3 * shared;  // of four corners moving together
    const HandEyeResult r = solve(w, options);
    REQUIRE(r.fit.usable());
    told.add(pose_difference(r.T_mount_camera, w.T_mount_camera), r.covariance);
    const HandEyeResult alone = solve(w, {});
    REQUIRE(alone.fit.usable());
    estimated.add(pose_difference(alone.T_mount_camera, w.T_mount_camera), alone.covariance, alone.covariance_dof);
    untold.add(pose_difference(blind.T_mount_camera, w.T_mount_camera), blind.covariance);
  }
  CAPTURE(told.inside(), untold.inside(), estimated.inside(), n);
  for (const test::Coverage* c : {&told, &estimated}) {
    c->check_mean();
    c->check_rate();
  }
  CHECK(untold.rate(0.95).high < 0.93);
}

TEST_CASE("noise levels are estimated without bias", "[statistics]") {
  double position = 0, rotation = 0, pixel = 0;
  const int n = trials(400);
  for (int i = 0; i < n; ++i) {
    const HandEyeResult r = solve(test::make_hand_eye_world(noisy(15, Mount::EyeInHand, 100 + i)), {});
    position += r.sigma_robot_position / n;
    rotation += r.sigma_robot_rotation / n;
    pixel += r.sigma_pixel / n;
  }
  // One estimate scatters by about 1 / sqrt(2 * 39) = 11 %.
  const double margin = 4 * 0.11 / std::sqrt(n) + 0.01;
  CHECK(position == Approx(robot_position_noise).epsilon(margin));
  CHECK(rotation == Approx(robot_rotation_noise).epsilon(margin));
  CHECK(pixel == Approx(0.2).epsilon(0.01));
}

TEST_CASE("views that contradict the others are named, lose their weight and hardly hurt") {
  for (const Mount mount : {Mount::EyeInHand, Mount::EyeToHand})
    for (int trial = 0; trial < 10; ++trial) {
      HandEyeWorld w = test::make_hand_eye_world(noisy(15, mount, 300 + trial));
      const HandEyeResult sound = solve(w, {.mount = mount});
      Random random(trial);
      for (const std::size_t i : {2, 7, 12}) spoil(w, i, random);
      const HandEyeResult r = solve(w, {.mount = mount});
      CAPTURE(trial, r.fit.message);
      for (const std::size_t i : {2, 7, 12}) {
        CHECK(r.views[i].outlier);
        CHECK(r.views[i].weight < 0.1);
        CHECK(r.views[i].robot_position > 0.01);
        CHECK(r.fit.message.find(r.views[i].name) != std::string::npos);
      }
      const Vector6 moved = pose_difference(sound.T_mount_camera, r.T_mount_camera);
      CHECK(moved.dot(r.covariance.ldlt().solve(moved)) < uncertainty::chi_square_quantile(0.999, 6));
    }
}

TEST_CASE("sound sets have a view named no more often than stated", "[statistics]") {
  const double stated = 0.05;
  int alarms = 0;
  const int n = trials(1000);
  for (int i = 0; i < n; ++i) {
    const HandEyeResult r =
        solve(test::make_hand_eye_world(noisy(10, Mount::EyeInHand, 9000 + i)), {.outlier_false_alarm = stated});
    alarms += std::any_of(r.views.begin(), r.views.end(), [](const auto& v) { return v.outlier; });
  }
  CAPTURE(alarms, n);
  test::check_rare(alarms, n, 2 * stated, test::full() ? 1.5 * stated : 4 * stated);
}

TEST_CASE("points far off inside a view do not spoil it") {
  HandEyeWorld w = test::make_hand_eye_world({.views = 10, .sigma_pixel = 0.1});
  const HandEyeResult clean = solve(w, {});
  for (auto& v : w.views) v.view.pixels.col(5) += Eigen::Vector2d(12, -9);
  const HandEyeResult r = solve(w, {});
  REQUIRE(r.fit.usable());
  const double error = pose_difference(clean.T_mount_camera, r.T_mount_camera).head<3>().norm();
  CHECK(error < 1e-3);
}

TEST_CASE("a wrist that does not turn, or about one axis only, is called degenerate with the numbers") {
  for (const int axes : {0, 1}) {
    HandEyeWorldOptions o = noisy(12, Mount::EyeInHand, 4);
    o.axes = axes;
    o.sigma_robot_rotation = 1e-4;
    const HandEyeResult r = solve(test::make_hand_eye_world(o), {});
    CAPTURE(axes, r.fit.message);
    CHECK(r.fit.status == FitStatus::Degenerate);
    CHECK(r.fit.message.find(axes == 0 ? "at most" : "one axis only") != std::string::npos);
    CHECK(r.fit.message.find("deg") != std::string::npos);
  }
}

TEST_CASE("too few views with a pose of the target are said, without errors of robot poses") {
  HandEyeWorld w = test::make_hand_eye_world(noisy(4, Mount::EyeInHand, 7));
  for (const std::size_t i : {0, 1}) w.views[i].view.points.row(1).setZero();  // on a line
  const HandEyeResult r = solve(w, {});
  CHECK(r.fit.status == FitStatus::Degenerate);
  CHECK(r.fit.message == "fewer than three views give a pose of the target");
  for (const HandEyeViewReport& view : r.views) CHECK(view.robot_position == 0.0);
}

TEST_CASE("a view beyond the range of the lens model leaves the others their answer") {
  HandEyeWorld w = test::make_hand_eye_world(noisy(12, Mount::EyeInHand, 8));
  w.camera.k4 = -0.9;  // a pole outside all sound images, but not outside what wrong points may claim
  for (HandEyeView& v : w.views) {
    const Pose M = test::target_in_camera(w, Mount::EyeInHand, v.T_base_flange);
    for (Eigen::Index k = 0; k < v.view.points.cols(); ++k)
      v.view.pixels.col(k) = w.camera.project(M * Eigen::Vector3d(v.view.points.col(k)));
  }
  w.views[5].view.points *= 40;  // as large as the whole room, so that its corners lie beyond the pole
  const HandEyeResult r = solve(w, {});
  CAPTURE(r.fit.message);
  CHECK(r.fit.status == FitStatus::Converged);
  CHECK(r.views[5].weight == 0);
  CHECK((r.T_mount_camera.translation() - w.T_mount_camera.translation()).norm() < 0.02);
}

TEST_CASE("a wrist that hardly turns gives a large covariance, not nonsense") {
  HandEyeWorldOptions o = noisy(12, Mount::EyeInHand, 5);
  const HandEyeResult wide = solve(test::make_hand_eye_world(o), {});
  o.tilt = 0.12;
  const HandEyeWorld w = test::make_hand_eye_world(o);
  const HandEyeResult narrow = solve(w, {});
  REQUIRE(narrow.fit.usable());
  CHECK(narrow.covariance.topLeftCorner<3, 3>().trace() > 4 * wide.covariance.topLeftCorner<3, 3>().trace());
  const Vector6 d = pose_difference(narrow.T_mount_camera, w.T_mount_camera);
  CHECK(d.dot(narrow.covariance.ldlt().solve(d)) < uncertainty::chi_square_quantile(0.9999, 6));
}

TEST_CASE("the same data give the same answer, and a start of one's own leads to it") {
  const HandEyeWorld w = test::make_hand_eye_world(noisy(12, Mount::EyeToHand, 6));
  const HandEyeResult a = solve(w, {.mount = Mount::EyeToHand}), b = solve(w, {.mount = Mount::EyeToHand});
  CHECK(a.T_mount_camera.matrix() == b.T_mount_camera.matrix());
  CHECK(a.covariance == b.covariance);
  Vector6 off;
  off << 0.05, -0.05, 0.05, 0.1, 0.1, -0.1;
  const HandEyeResult c = solve(w, {.mount = Mount::EyeToHand, .start = w.T_mount_camera * to_pose(off)});
  CHECK(pose_difference(a.T_mount_camera, c.T_mount_camera).norm() < 1e-4);
}

TEST_CASE("too little or malformed input is refused by name") {
  HandEyeWorld w = test::make_hand_eye_world({.views = 5});
  const auto run = [&](std::span<const HandEyeView> views, const HandEyeOptions& o = {}) {
    return calibrate_hand_eye(views, w.camera, o);
  };
  CHECK_THROWS_WITH(run(std::span(w.views).first(2)), Catch::Contains("three views"));
  CHECK_THROWS_WITH(run(w.views, {.sigma_pixel = -1}), Catch::Contains("sigma_pixel"));
  auto views = w.views;
  views[3].view.pixels(0, 0) = std::nan("");
  CHECK_THROWS_WITH(run(views), Catch::Contains("view3") && Catch::Contains("finite"));
  views = w.views;
  views[1].T_base_flange.linear() *= -1;
  CHECK_THROWS_WITH(run(views), Catch::Contains("view1") && Catch::Contains("rotation"));
  views = w.views;
  views[4].correlation = 0.5;
  CHECK_THROWS_WITH(run(views), Catch::Contains("view4") && Catch::Contains("correlation"));
  views = w.views;
  views[2].view.points = Eigen::Matrix3Xd(views[2].view.points.leftCols(3));
  views[2].view.pixels = Eigen::Matrix2Xd(views[2].view.pixels.leftCols(3));
  CHECK_THROWS_WITH(run(views), Catch::Contains("view2") && Catch::Contains("four points"));
  views = w.views;
  views[4] = views[2];
  CHECK_THROWS_WITH(run(views), Catch::Contains("is the same as view") && Catch::Contains("list each view only once"));
  views = w.views;
  views[3].T_base_flange.translation().z() = 1e9;
  CHECK_THROWS_WITH(run(views), Catch::Contains("view3") && Catch::Contains("is its unit right"));
}

TEST_CASE("held-out error is that of the noise, and a wrong method is found out") {
  const HandEyeWorld w = test::make_hand_eye_world(noisy(15, Mount::EyeInHand, 7));
  const HandEyeEvaluation good = evaluate_hand_eye(w.views, w.camera, HandEyeOptions{});
  REQUIRE(good.views.size() == 15);
  CHECK(good.unjudged == 0);
  CHECK(good.rotation_rms > 0.5 * std::sqrt(3) * robot_rotation_noise);
  CHECK(good.rotation_rms < 2 * std::sqrt(3) * robot_rotation_noise);
  const HandEyeEvaluation bad = evaluate_hand_eye(w.views, w.camera, [&](auto, auto) {
    return HandEyePoses{w.T_mount_camera.inverse(), std::nullopt};
  });
  CHECK(bad.position_rms > 5 * good.position_rms);
  CHECK(evaluate_hand_eye(w.views, w.camera, HandEyeOptions{}, 5).views.size() == 15);
  CHECK_THROWS_AS(evaluate_hand_eye(std::span(w.views).first(3), w.camera, HandEyeOptions{}), InvalidArgument);
}

}  // namespace hand_eye_test
