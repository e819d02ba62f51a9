#include <cmath>
#include <optional>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/fit/measurements/distance.hpp>
#include <kr5/fit/measurements/pixels.hpp>
#include <kr5/fit/measurements/plane_point.hpp>
#include <kr5/fit/measurements/pose.hpp>
#include <kr5/fit/measurements/position.hpp>
#include <kr5/fit/problem.hpp>
#include <support/coverage.hpp>
#include <support/trials.hpp>

#include "fit/fit_world.hpp"

namespace problem_test {

using namespace kr5;
using namespace kr5::fit;
using namespace kr5::test;
using Catch::Matchers::Contains;

TEST_CASE("exact measurements of every kind give back arm, base, tool, tip, socket, sphere and plane") {
  Random random(2);
  for (int trial = 0; trial < 10; ++trial) {
    const World w = random_world(random);
    const Pose T_world_plane = random_pose(random);
    const double radius = 0.3;
    Problem fit;
    kinematics::DhChain start = w.arm;
    start.joints[1].a += 2e-3, start.joints[2].theta_offset += 3e-3, start.joints[0].alpha -= 2e-3;
    const FitBlock arm = fit.add_arm("arm", start);
    for (int k = 0; k < 20; ++k)
      if (k != 5 + 2 && k != 10 + 1 && k != 3) fit.hold(arm, k);
    const FitBlock base = fit.add_pose("base", w.T_world_base * to_pose(Vector6(0.01 * random.normal_vector(6)))),
                   tool = fit.add_pose("tool", w.T_flange_tool * to_pose(Vector6(0.01 * random.normal_vector(6)))),
                   tip = fit.add_point("tip", w.tip + random.normal_vector(3, 0.01)),
                   socket = fit.add_point("socket", w.socket + random.normal_vector(3, 0.01)),
                   ball = fit.add_vector("ball", Eigen::VectorXd::Constant(1, 0.31), {"radius [m]"}),
                   plane = fit.add_pose("plane", T_world_plane * to_pose(Vector6(0.01 * random.normal_vector(6))));
    for (const int along : {0, 1, 5}) fit.hold(plane, along);  // a plane slides in itself
    for (int i = 0; i < 30; ++i) {
      const Eigen::VectorXd q = random.normal_vector(4);
      const Pose T = w.T_world_base * w.arm.flange(q);
      fit.add(PoseMeasurement(PoseChain().then(base).then_arm(arm, q).then(tool), T * w.T_flange_tool, 1e-4, 1e-4));
      fit.add(PositionMeasurement(PoseChain().then(base).then_arm(arm, q), tip, Eigen::Vector3d(T * w.tip), 1e-4));
      // A point of the flange that touches the socket, a sphere about it and the plane.
      const Eigen::Vector3d touching = T.inverse() * w.socket;
      fit.add(PositionMeasurement(PoseChain().then(base).then_arm(arm, q), touching, socket, 1e-4));
      fit.add(DistanceMeasurement(PoseChain().then(base).then_arm(arm, q),
                                  Eigen::Vector3d(T.inverse() * (w.socket + radius * random.direction())), socket, ball,
                                  1e-4));
      const Eigen::Vector3d on_plane = T_world_plane * Eigen::Vector3d(random.normal(), random.normal(), 0);
      fit.add(PlanePointMeasurement(PoseChain().then_inverse(plane).then(base).then_arm(arm, q),
                                    Eigen::Vector3d(T.inverse() * on_plane), 1e-4));
    }
    const Solution result = fit.solve();
    CAPTURE(trial, result.fit.message);
    CHECK(result.fit.status == FitStatus::Converged);
    CHECK(result.unidentifiable.empty());
    CHECK(pose_difference(fit.pose(base), w.T_world_base).norm() < 1e-9);
    CHECK(pose_difference(fit.pose(tool), w.T_flange_tool).norm() < 1e-9);
    CHECK((fit.values(tip) - w.tip).norm() < 1e-9);
    CHECK((fit.values(socket) - w.socket).norm() < 1e-9);
    CHECK(fit.values(ball)[0] == Approx(radius).epsilon(1e-9));
    CHECK((T_world_plane.inverse() * fit.pose(plane).translation()).z() == Approx(0).margin(1e-9));
    CHECK((T_world_plane.linear().transpose() * fit.pose(plane).linear()).col(2).z() == Approx(1).epsilon(1e-9));
    for (std::size_t i = 0; i < 4; ++i) {
      CHECK(fit.arm(arm).joints[i].a == Approx(w.arm.joints[i].a).margin(1e-9));
      CHECK(fit.arm(arm).joints[i].theta_offset == Approx(w.arm.joints[i].theta_offset).margin(1e-9));
      CHECK(fit.arm(arm).joints[i].alpha == Approx(w.arm.joints[i].alpha).margin(1e-9));
    }
  }
}

TEST_CASE("pixels give back camera, hand-eye and target, with the robot's pose errors eliminated") {
  Random random(3);
  const Pinhole camera = lens();
  Vector6 hand;
  hand << 0.02, -0.05, 0.1, 0.1, -0.2, 0.3;
  const Pose T_flange_camera = to_pose(hand);
  Eigen::Matrix3Xd points(3, 35);
  for (int k = 0; k < 35; ++k) points.col(k) << 0.03 * (k % 7) - 0.09, 0.03 * (k / 7) - 0.06, 0.0;
  Problem fit;
  Pinhole rough = camera;
  rough.fx = 980, rough.fy = 1020, rough.k1 = 0;
  const FitBlock lens_block = fit.add_camera("camera", rough);
  for (const int zero : {5, 7, 8, 9, 10, 11}) fit.hold(lens_block, zero);
  const FitBlock hand_eye =
                     fit.add_pose("T_flange_camera", T_flange_camera * to_pose(Vector6(0.005 * Vector6::Ones()))),
                 target = fit.add_pose("T_base_target", to_pose(Vector6(0.005 * Vector6::Ones())));
  std::vector<FitMeasurement> views;
  for (int i = 0; i < 25; ++i) {
    Vector6 look;
    look << random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), random.uniform(0.4, 0.6),
        random.normal_vector(3, 0.25);
    Pose T_camera_target = to_pose(look);
    const Pose T_base_flange = T_camera_target.inverse() * T_flange_camera.inverse();
    Vector6 error;
    error << random.normal_vector(3, 5e-4), random.normal_vector(3, 1e-3);
    const FitBlock wrong = fit.add_nuisance_pose("view" + std::to_string(i));
    Vector6 sigma;
    sigma << Eigen::Vector3d::Constant(5e-4), Eigen::Vector3d::Constant(1e-3);
    fit.set_prior(wrong, sigma);
    Eigen::Matrix2Xd pixels(2, points.cols());
    for (Eigen::Index k = 0; k < points.cols(); ++k)
      pixels.col(k) = camera.project(T_camera_target * Eigen::Vector3d(points.col(k))) +
                      Eigen::Vector2d(random.normal_vector(2, 0.1));
    // The true pose of the flange is the reported one times exp(e).
    views.push_back(fit.add(PixelMeasurement(PoseChain()
                                                 .then_inverse(hand_eye)
                                                 .then_inverse(wrong)
                                                 .then((T_base_flange * to_pose(error).inverse()).inverse())
                                                 .then(target),
                                             lens_block, points, pixels, 0.1)));
  }
  const Solution result = fit.solve();
  CHECK(result.fit.status == FitStatus::Converged);
  CHECK(result.unidentifiable.empty());
  CHECK(result.coordinates.size() == 18);  // six of the lens, two poses; no nuisance
  Eigen::VectorXd off(18);
  off.head<6>() << fit.camera(lens_block).parameters().head<5>() - camera.parameters().head<5>(),
      fit.camera(lens_block).p1 - camera.p1;
  off.segment<6>(6) = pose_difference(T_flange_camera, fit.pose(hand_eye));
  off.tail<6>() = to_vector(fit.pose(target));
  const double squared = off.dot(result.covariance.ldlt().solve(off));
  CHECK(squared < uncertainty::chi_square_quantile(0.999, 18));
  CHECK(squared > uncertainty::chi_square_quantile(0.001, 18));
  double distances = 0.0;
  for (const FitMeasurement view : views)
    distances += result.agreement(fit, view).squared_distance / result.agreement(fit, view).dof;
  CHECK(distances / 25 == Approx(1.0).margin(0.15));
}

TEST_CASE("a prior and a measurement of the same weight meet halfway, however far apart") {
  Vector6 far;
  far << 0.4, -0.2, 0.7, 1.2, -0.9, 1.1;
  Problem fit;
  const FitBlock pose = fit.add_pose("pose", Pose::Identity());
  fit.set_prior(pose, Vector6::Constant(0.1));
  fit.add(PoseMeasurement(PoseChain().then(pose), to_pose(far), 0.1, 0.1));
  CHECK(fit.solve().fit.status == FitStatus::Converged);
  CHECK((to_vector(fit.pose(pose)) - 0.5 * far).norm() < 1e-7);
}

TEST_CASE("gross errors hardly move a fit with a Cauchy loss") {
  Random random(7);
  const auto error_with = [&](double loss) {
    Problem fit;
    const FitBlock p = fit.add_point("p", Eigen::Vector3d::Zero());
    for (int i = 0; i < 50; ++i)
      fit.add(PositionMeasurement({}, p,
                                  Eigen::Vector3d(random.normal_vector(3, 1e-3) +
                                                  (i % 5 ? Eigen::Vector3d::Zero() : Eigen::Vector3d(0.5, 0, 0))),
                                  1e-3));
    fit.solve({.loss = loss, .uncertainty = false});
    return fit.values(p).norm();
  };
  CHECK(error_with(0.0) > 0.05);
  CHECK(error_with(2.0) < 2e-3);
}

TEST_CASE("a fit that cannot be set up says why") {
  Problem fit;
  CHECK_THROWS_WITH(fit.solve(), Contains("no parameter is free"));
  const FitBlock pose = fit.add_pose("base", Pose::Identity()), point = fit.add_point("tip", Eigen::Vector3d::Zero());
  CHECK_THROWS_WITH(fit.add(PositionMeasurement(PoseChain().then(point), point, Eigen::Vector3d(0, 0, 0), 1.0)),
                    Contains("tip is no pose"));
  CHECK_THROWS_WITH(fit.add(PositionMeasurement({}, pose, Eigen::Vector3d(0, 0, 0), 1.0)),
                    Contains("base is no point"));
  CHECK_THROWS_WITH(fit.add(PoseMeasurement({}, Pose::Identity(), 0.0, 1.0)),
                    Contains("standard deviations must be positive"));
  CHECK_THROWS_WITH(
      fit.add(PositionMeasurement({}, point, Eigen::Vector3d(0, 0, 0), Eigen::Matrix3d(-Eigen::Matrix3d::Identity()))),
      Contains("positive definite"));
  CHECK_THROWS_WITH(fit.set_prior(pose, Eigen::Vector3d(1, 1, 1)), Contains("expected 6 standard deviations"));
  CHECK_THROWS_WITH(fit.hold(pose, 6), Contains("no coordinate 6"));
  CHECK_THROWS_AS(fit.pose(FitBlock{7}), InvalidArgument);
  kinematics::DhChain two;
  two.joints.resize(2);
  const FitBlock arm = fit.add_arm("arm", two);
  CHECK_THROWS_WITH(
      fit.add(PoseMeasurement(PoseChain().then_arm(arm, Eigen::VectorXd::Zero(3)), Pose::Identity(), 1, 1)),
      Contains("expected 2 finite joint values"));
  const FitBlock lens_block = fit.add_camera("camera", lens());
  const FitMeasurement view =
      fit.add(PixelMeasurement(PoseChain().then(Pose(Eigen::Translation3d(0, 0, 1))), lens_block,
                               Eigen::Matrix3Xd::Zero(3, 2), Eigen::Matrix2Xd::Zero(2, 2), 0.1));
  CHECK_THROWS_WITH(fit.measurement<PixelMeasurement>(view).set_sigmas(Eigen::Vector3d(1, 1, 1)),
                    Contains("as many pixels"));
  CHECK_THROWS_WITH(PoseChain().then_path({}, 0.0), Contains("there is no path"));
  const PosePath still = [](double) { return std::optional(PathSample{}); };
  CHECK_THROWS_WITH(fit.add(PoseMeasurement(PoseChain().then_path(still, 0.0, point), Pose::Identity(), 1, 1)),
                    Contains("tip is no delay"));
  CHECK_THROWS_WITH(fit.add(PoseMeasurement(PoseChain().then_path(still, NAN), Pose::Identity(), 1, 1)),
                    Contains("the time on a path must be finite [s]"));
  CHECK_THROWS_WITH(fit.add(PoseMeasurement({}, Pose::Identity(), Matrix6(Matrix6::Zero()))),
                    Contains("positive definite"));
  CHECK_THROWS_WITH(fit.set_covariance(view, Eigen::Matrix2d::Identity()), Contains("has no covariance"));
  CHECK_THROWS_WITH(fit.measurement<PixelMeasurement>(view).set_sigmas(Eigen::Vector2d(1, 0)),
                    Contains("sigmas must be positive [px]"));
  CHECK_THROWS_WITH(fit.tie(pose, 0, 1), Contains("base: coordinates of a pose or a nuisance cannot be tied"));
  CHECK_THROWS_WITH(fit.tie(lens_block, 0, 12), Contains("camera: there is no free coordinate 12"));
  CHECK_THROWS_WITH(fit.tie(lens_block, 3, 3), Contains("cannot be tied to itself"));
  const FitBlock bow = fit.add_vector("bow", Eigen::Vector2d::Zero(), {"x", "y"});
  CHECK_THROWS_WITH(fit.add(PixelMeasurement({}, lens_block, Eigen::Matrix3Xd::Zero(3, 2), Eigen::Matrix2Xd::Zero(2, 2),
                                             0.1, {bow, Eigen::MatrixXd::Zero(6, 3)})),
                    Contains("three rows a point and one column an amount"));
}

TEST_CASE("a camera whose pixels keep their ratio is found at another focal length") {
  Pinhole camera = lens(), rough = camera;
  rough.fx = 800, rough.fy = 1000, camera.fx = 840, camera.fy = 1050;
  Eigen::Matrix3Xd points(3, 6);
  points << -0.1, 0.1, 0.0, 0.1, -0.1, 0.05, -0.1, -0.1, 0.0, 0.1, 0.1, 0.02, 0.0, 0.0, 0.1, 0.0, 0.0, -0.1;
  Pose T = Pose::Identity();
  T.translation().z() = 0.7;
  Eigen::Matrix2Xd pixels(2, 6);
  for (int k = 0; k < 6; ++k) pixels.col(k) = camera.project(T * Eigen::Vector3d(points.col(k)));
  Problem fit;
  const FitBlock block = fit.add_camera("camera", rough);
  for (int k = 2; k < 12; ++k) fit.hold(block, k);
  fit.tie(block, 0, 1, rough.fy / rough.fx);
  fit.add(PixelMeasurement(PoseChain().then(T), block, points, pixels, 0.1));
  const Solution result = fit.solve();
  CHECK(result.coordinates.size() == 1);
  CHECK(fit.camera(block).fx == Approx(840).epsilon(1e-9));
  CHECK(fit.camera(block).fy == Approx(1050).epsilon(1e-9));
  CHECK(result.places(block)[1] == 0);
  CHECK_THROWS_WITH(fit.tie(block, 0, 1), Contains("tied already"));
}

}  // namespace problem_test
