#include <cmath>
#include <limits>
#include <optional>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/fit/cell_fit.hpp>
#include <kr5/kinematics/jacobian.hpp>
#include <support/coverage.hpp>
#include <support/trials.hpp>

using namespace kr5;
using namespace kr5::fit;
using Catch::Matchers::Contains;

namespace {

Pose random_pose(Random& random, double distance = 0.5, double angle = 1.0) {
  Vector6 d;
  d << random.normal_vector(3, distance), random.normal_vector(3, angle);
  return to_pose(d);
}

kinematics::DhChain random_arm(Random& random, int joints) {
  kinematics::DhChain arm;
  for (int i = 0; i < joints; ++i) {
    kinematics::DhJoint joint;
    joint.type = random.integer(5) == 0 ? kinematics::JointType::Prismatic : kinematics::JointType::Revolute;
    joint.b = random.uniform(-0.4, 0.4);
    joint.theta_offset = random.uniform(-1, 1);
    joint.a = random.uniform(-0.5, 0.5);
    joint.alpha = random.uniform(-1.6, 1.6);
    joint.beta = random.uniform(-0.2, 0.2);
    arm.joints.push_back(joint);
  }
  return arm;
}

/// An arm measured by every kind of observation; answers are what the fit must find from wrong starts.
struct World {
  kinematics::DhChain arm;
  Pose T_world_base, T_flange_tool;
  Eigen::Vector3d tip, socket;
};

World random_world(Random& random, int joints = 4) {
  World w;
  w.arm = random_arm(random, joints);
  w.T_world_base = random_pose(random);
  w.T_flange_tool = random_pose(random, 0.1);
  w.tip = random.normal_vector(3, 0.2);
  w.socket = random.normal_vector(3, 0.5);
  return w;
}

Pinhole lens() {
  Pinhole camera;
  camera.width = 1280, camera.height = 960;
  camera.fx = 1000, camera.fy = 1010, camera.cx = 640, camera.cy = 470;
  camera.k1 = -0.1, camera.p1 = 1e-3;
  return camera;
}

}  // namespace

TEST_CASE("the flange's derivative by every joint parameter is that of finite differences") {
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const kinematics::DhChain arm = random_arm(random, 1 + trial % 8);
    const Eigen::VectorXd q = random.normal_vector(static_cast<Eigen::Index>(arm.joints.size()));
    Pose T;
    const kinematics::Jacobian J = kinematics::parameter_jacobian(arm, q, &T);
    CHECK(T.isApprox(arm.flange(q), 1e-14));
    const double h = 1e-6;
    for (Eigen::Index k = 0; k < J.cols(); ++k) {
      const auto moved = [&](double by) {
        kinematics::DhChain other = arm;
        kinematics::DhJoint& joint = other.joints[static_cast<std::size_t>(k / 5)];
        double* const parameters[] = {&joint.b, &joint.theta_offset, &joint.a, &joint.alpha, &joint.beta};
        *parameters[k % 5] += by;
        return other.flange(q);
      };
      const Vector6 numeric = (pose_difference(T, moved(h)) - pose_difference(T, moved(-h))) / (2 * h);
      CAPTURE(trial, k);
      CHECK((numeric - J.col(k)).norm() < 1e-8);
    }
  }
}

TEST_CASE("exact measurements of every kind give back arm, base, tool, tip, socket, sphere and plane") {
  Random random(2);
  for (int trial = 0; trial < 10; ++trial) {
    const World w = random_world(random);
    const Pose T_world_plane = random_pose(random);
    const double radius = 0.3;
    CellFit fit;
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
      fit.observe_pose(PoseChain().then(base).then_arm(arm, q).then(tool), T * w.T_flange_tool, 1e-4, 1e-4);
      fit.observe_position(PoseChain().then(base).then_arm(arm, q), tip, Eigen::Vector3d(T * w.tip), 1e-4);
      // A point of the flange that touches the socket, a sphere about it and the plane.
      const Eigen::Vector3d touching = T.inverse() * w.socket;
      fit.observe_position(PoseChain().then(base).then_arm(arm, q), touching, socket, 1e-4);
      fit.observe_distance(PoseChain().then(base).then_arm(arm, q),
                           Eigen::Vector3d(T.inverse() * (w.socket + radius * random.direction())), socket, 0, 1e-4,
                           ball);
      const Eigen::Vector3d on_plane = T_world_plane * Eigen::Vector3d(random.normal(), random.normal(), 0);
      fit.observe_on_plane(PoseChain().then_inverse(plane).then(base).then_arm(arm, q),
                           Eigen::Vector3d(T.inverse() * on_plane), 1e-4);
    }
    const CellFitResult result = fit.solve();
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
  CellFit fit;
  Pinhole rough = camera;
  rough.fx = 980, rough.fy = 1020, rough.k1 = 0;
  const FitBlock lens_block = fit.add_camera("camera", rough);
  for (const int zero : {5, 7, 8, 9, 10, 11}) fit.hold(lens_block, zero);
  const FitBlock hand_eye =
                     fit.add_pose("T_flange_camera", T_flange_camera * to_pose(Vector6(0.005 * Vector6::Ones()))),
                 target = fit.add_pose("T_base_target", to_pose(Vector6(0.005 * Vector6::Ones())));
  std::vector<FitObservation> views;
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
    views.push_back(fit.observe_pixels(PoseChain()
                                           .then_inverse(hand_eye)
                                           .then_inverse(wrong)
                                           .then((T_base_flange * to_pose(error).inverse()).inverse())
                                           .then(target),
                                       lens_block, points, pixels, 0.1));
  }
  const CellFitResult result = fit.solve();
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
  for (const FitObservation view : views) distances += fit.agreement(view).squared_distance / fit.agreement(view).dof;
  CHECK(distances / 25 == Approx(1.0).margin(0.15));
}

TEST_CASE("poses of views as nuisances change neither the camera nor its covariance; a point may count less") {
  Random random(4);
  const Pinhole camera = lens();
  Eigen::Matrix3Xd points(3, 20);
  for (int k = 0; k < 20; ++k) points.col(k) << 0.03 * (k % 5) - 0.06, 0.03 * (k / 5) - 0.045, 0.0;
  const double infinite = std::numeric_limits<double>::infinity();
  Eigen::VectorXd sigmas = Eigen::VectorXd::Constant(20, 0.1);
  sigmas[3] = infinite, sigmas[4] = 0.3;
  CellFit as_nuisance, as_block;
  FitBlock lens_of[2];
  for (CellFit* fit : {&as_nuisance, &as_block}) {
    FitBlock& block = lens_of[fit == &as_block];
    block = fit->add_camera("camera", camera);
    for (int zero = 4; zero < 12; ++zero) fit->hold(block, zero);
  }
  for (int i = 0; i < 6; ++i) {
    Vector6 look;
    look << random.normal_vector(2, 0.05), random.uniform(0.4, 0.6), random.normal_vector(3, 0.3);
    const Pose T_camera_target = to_pose(look);
    Eigen::Matrix2Xd pixels(2, points.cols());
    for (Eigen::Index k = 0; k < points.cols(); ++k)
      pixels.col(k) = camera.project(T_camera_target * Eigen::Vector3d(points.col(k))) +
                      Eigen::Vector2d(random.normal_vector(2, 0.1));
    pixels.col(3).array() += 40;  // far off, and without a part
    for (CellFit* fit : {&as_nuisance, &as_block}) {
      const std::string name = "view" + std::to_string(i);
      const FitBlock view =
          fit == &as_block ? fit->add_pose(name, T_camera_target) : fit->add_nuisance_pose(name, T_camera_target);
      fit->set_pixel_sigmas(fit->observe_pixels(PoseChain().then(view), lens_of[fit == &as_block], points, pixels, 0.1),
                            sigmas);
    }
  }
  const CellFitResult a = as_nuisance.solve(), b = as_block.solve();
  CHECK(a.cost == Approx(b.cost).epsilon(1e-9));
  REQUIRE(a.coordinates.size() == 4);
  const Eigen::Vector4d first = as_nuisance.camera(lens_of[0]).parameters().head<4>(),
                        second = as_block.camera(lens_of[1]).parameters().head<4>();
  CHECK((first - second).norm() < 1e-5);
  CHECK(a.covariance.isApprox(b.covariance.topLeftCorner<4, 4>(), 1e-5));
  CHECK((first - camera.parameters().head<4>()).cwiseQuotient(a.covariance.diagonal().cwiseSqrt()).norm() < 4.5);
}

TEST_CASE("a report counts priors and nuisances; an agreement, what a nuisance without a prior leaves") {
  double rms = 0.0, squared = 0.0, dof = 0.0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    CellFit fit;
    const FitBlock point = fit.add_point("point", Eigen::Vector3d::Zero());
    fit.set_prior(point, Eigen::Vector3d::Constant(0.1));  // the truth lies that far from the start
    const Eigen::Vector3d truth = random.normal_vector(3, 0.1);
    std::vector<FitObservation> pairs;
    for (int i = 0; i < 12; ++i) {  // places seen through a frame shifted along x by an unknown length
      const FitBlock shift = fit.add_nuisance_vector("shift" + std::to_string(i), Eigen::VectorXd::Zero(1), {"x [m]"});
      kinematics::DhChain slide;
      slide.joints.resize(1);
      slide.joints[0].type = kinematics::JointType::Prismatic;
      const FitBlock arm = fit.add_arm("slide" + std::to_string(i), slide);
      fit.hold(arm);
      const Eigen::Vector3d seen = Eigen::Vector3d(0, 0, random.normal(0.5)) + truth + random.normal_vector(3, 1e-3);
      pairs.push_back(fit.observe_position(
          PoseChain().then_arm(arm, Eigen::VectorXd::Zero(1), shift, Eigen::MatrixXd::Ones(1, 1)), point, seen, 1e-3));
    }
    const CellFitResult result = fit.solve();
    rms += result.fit.final_rms * result.fit.final_rms / 20;
    for (const FitObservation pair : pairs) {
      CHECK(fit.agreement(pair).dof == 2);
      squared += fit.agreement(pair).squared_distance, dof += fit.agreement(pair).dof;
    }
    CHECK(result.undetermined.empty());
    CHECK(std::sqrt(result.covariance(2, 2)) == Approx(0.1).epsilon(1e-6));  // of z only the prior knows
    CHECK(std::abs(fit.values(point)[2]) < 1e-6);
  }
  CHECK(rms == Approx(1.0).epsilon(0.15));  // (36 + 3 - 3 - 12) x 20 degrees of freedom
  CHECK(squared / dof == Approx(1.0).epsilon(0.2));
}

TEST_CASE("what neither measurement nor prior determines has an infinite variance") {
  CellFit fit;
  const FitBlock point = fit.add_point("point", Eigen::Vector3d::Zero());
  const Pose plane = Pose::Identity();
  fit.observe_on_plane(PoseChain().then(plane), point, 1e-3);
  const CellFitResult result = fit.solve();
  CHECK(result.undetermined == std::vector<std::string>{"point.x [m]", "point.y [m]"});
  CHECK(std::isinf(result.covariance(0, 0)));
  CHECK(std::sqrt(result.covariance(2, 2)) == Approx(1e-3));
  CHECK_THROWS_WITH(fit.solve({.loss = 1.0}), Contains("set loss to 0"));
}

TEST_CASE("square pixels and the bow of a board are found, and derivatives are those of finite differences") {
  Random random(5);
  Pinhole camera = lens(), rough = camera;
  camera.fx = camera.fy = 1000, rough.fx = rough.fy = 1030;
  Eigen::Matrix3Xd points(3, 20);
  for (int k = 0; k < 20; ++k) points.col(k) << 0.03 * (k % 5) - 0.06, 0.03 * (k / 5) - 0.045, 0.0;
  FitDeformation bow;
  bow.displacements = Eigen::MatrixXd::Zero(60, 2);
  for (int k = 0; k < 20; ++k) {
    bow.displacements(3 * k + 2, 0) = points(0, k) * points(0, k) / 0.06;
    bow.displacements(3 * k, 1) = points(0, k);
    bow.displacements(3 * k + 1, 1) = -points(1, k);
  }
  const Eigen::Vector2d truth(0.03, 0.002);
  const Eigen::Matrix3Xd bent = points + (bow.displacements * truth).reshaped(3, 20);
  CellFit fit;
  const FitBlock lens_block = fit.add_camera("camera", rough);
  bow.amounts = fit.add_vector("board", Eigen::Vector2d::Zero(), {"bow", "stretch"});
  fit.tie(lens_block, 0, 1);
  for (const int held : {5, 7, 8, 9, 10, 11}) fit.hold(lens_block, held);
  std::vector<FitObservation> views;
  for (int i = 0; i < 6; ++i) {
    Vector6 look;
    look << random.normal_vector(2, 0.03), random.uniform(0.4, 0.6), random.normal_vector(3, 0.3);
    const Pose T = to_pose(look);
    Eigen::Matrix2Xd pixels(2, 20);
    for (Eigen::Index k = 0; k < 20; ++k) pixels.col(k) = camera.project(T * Eigen::Vector3d(bent.col(k)));
    const FitBlock view =
        fit.add_nuisance_pose("view" + std::to_string(i), T * to_pose(Vector6(Vector6::Constant(1e-3))));
    views.push_back(fit.observe_pixels(PoseChain().then(view), lens_block, points, pixels, 0.2, bow));
  }
  const CellFitResult result = fit.solve();
  REQUIRE(result.coordinates.size() == 7);  // f cx cy k1 p1, bow and stretch
  CHECK(result.unidentifiable.empty());
  CHECK(fit.coordinates(lens_block) == std::vector<int>{0, 0, 1, 2, 3, -1, 4, -1, -1, -1, -1, -1});
  CHECK((fit.camera(lens_block).parameters() - camera.parameters()).norm() < 1e-5);
  CHECK(fit.camera(lens_block).fx == Approx(fit.camera(lens_block).fy).epsilon(1e-14));
  CHECK((fit.values(bow.amounts) - truth).norm() < 1e-8);

  const auto at = fit.derivatives(views[2]);
  REQUIRE(at);
  CHECK(at->residuals == fit.residuals(views[2]));
  CHECK(at->by_nuisance.cols() == 6);
  const Eigen::VectorXd lens_values = fit.values(lens_block), board_values = fit.values(bow.amounts);
  const auto slope = [&](FitBlock block, const Eigen::VectorXd& values, const Eigen::VectorXd& step) {
    fit.begin_at(block, values + step);
    const Eigen::VectorXd after = fit.residuals(views[2]);
    fit.begin_at(block, values - step);
    const Eigen::VectorXd before = fit.residuals(views[2]);
    fit.begin_at(block, values);
    return Eigen::VectorXd((after - before) / (2 * step.maxCoeff()));
  };
  Eigen::VectorXd f = Eigen::VectorXd::Zero(12);
  f.head<2>().setConstant(1e-3);
  CHECK((slope(lens_block, lens_values, f) - at->by_coordinate.col(0)).norm() < 1e-6 * at->by_coordinate.col(0).norm());
  for (int k = 0; k < 2; ++k)
    CHECK((slope(bow.amounts, board_values, 1e-6 * Eigen::Vector2d::Unit(k)) - at->by_coordinate.col(5 + k)).norm() <
          1e-6 * at->by_coordinate.col(5 + k).norm());
}

TEST_CASE("a point beyond the range of the lens model rules a camera out, unless it has no part") {
  Pinhole camera = lens();
  camera.k4 = -2.0;  // pole at a slope of 0.7
  Eigen::Matrix3Xd points(3, 4);
  points << 0.0, 0.1, 0.0, 0.8, 0.0, 0.0, 0.1, 0.0, 1.0, 1.0, 1.0, 1.0;
  CellFit fit;
  const FitBlock lens_block = fit.add_camera("camera", camera);
  for (int k = 1; k < 12; ++k) fit.hold(lens_block, k);
  const FitObservation view = fit.observe_pixels({}, lens_block, points, Eigen::Matrix2Xd::Zero(2, 4), 1.0);
  CHECK(fit.residuals(view).array().isInf().all());
  CHECK(fit.solve().fit.status == FitStatus::Degenerate);
  CHECK_FALSE(fit.derivatives(view));
  fit.set_pixel_sigmas(view, Eigen::Vector4d(1, 1, 1, std::numeric_limits<double>::infinity()));
  CHECK(fit.solve().fit.usable());
  CHECK(fit.residuals(view).allFinite());
}

TEST_CASE("condensed rows of many pixels have the squares, gradient and information of all of them") {
  Random random(8);
  for (const bool on_a_line : {false, true}) {
    Eigen::Matrix3Xd points(3, 12);
    for (int k = 0; k < 12; ++k)
      points.col(k) << 0.02 * k, on_a_line ? 0.01 * k : random.uniform(-0.1, 0.1), 0.01 * (on_a_line ? 0 : k % 3);
    const Pinhole camera = lens();
    CellFit fit;
    const FitBlock lens_block = fit.add_camera("camera", camera);
    fit.hold(lens_block);
    Pose T = random_pose(random, 0.1, 0.3);
    T.translation().z() += 0.6;
    const Pose at[3] = {random_pose(random), random_pose(random, 0.01, 0.7), random_pose(random)};
    const FitBlock blocks[3] = {fit.add_pose("a", at[0]), fit.add_nuisance_pose("error", at[1]),
                                fit.add_pose("b", at[2])};
    fit.hold(blocks[2], 1);
    const Pose between = at[0] * T * at[2].inverse() * at[1];
    Eigen::Matrix2Xd pixels(2, 12);
    for (Eigen::Index k = 0; k < 12; ++k)
      pixels.col(k) =
          camera.project(T * Eigen::Vector3d(points.col(k))) + Eigen::Vector2d(random.normal_vector(2, 2.0));
    // T = a^-1 between error^-1 b
    const FitObservation seen =
        fit.observe_pixels(PoseChain().then_inverse(blocks[0]).then(between).then_inverse(blocks[1]).then(blocks[2]),
                           lens_block, points, pixels, 0.5);
    fit.set_weight(seen, 0.0);  // does not count here
    fit.observe_pose(PoseChain().then(blocks[0]), at[0], 1.0, 1.0),
        fit.observe_pose(PoseChain().then(blocks[2]), at[2], 1.0, 1.0);
    const auto condensed = fit.derivatives(seen, true);
    REQUIRE(condensed);
    CHECK(condensed->residuals.size() == 7);
    REQUIRE(condensed->by_coordinate.cols() == 11);
    Eigen::MatrixXd derivative = Eigen::MatrixXd::Zero(7, 18);  // by the coordinates of the three blocks
    derivative.leftCols(6) = condensed->by_coordinate.leftCols(6);
    derivative.middleCols(6, 6) = condensed->by_nuisance;
    derivative.col(12) = condensed->by_coordinate.col(6);
    derivative.rightCols(4) = condensed->by_coordinate.rightCols(4);
    const Eigen::VectorXd all = fit.residuals(seen);
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(all.size(), 18);
    const double h = 1e-6;
    for (int k = 0; k < 18; ++k) {
      if (k == 13) continue;  // held
      const auto moved = [&](double by) {
        fit.begin_at(blocks[k / 6], at[k / 6] * to_pose(Vector6(by * Vector6::Unit(k % 6))));
        const Eigen::VectorXd r = fit.residuals(seen);
        fit.begin_at(blocks[k / 6], at[k / 6]);
        return r;
      };
      J.col(k) = (moved(h) - moved(-h)) / (2 * h);
    }
    CAPTURE(on_a_line);
    CHECK(condensed->residuals.squaredNorm() == Approx(all.squaredNorm()).epsilon(1e-10));
    const Eigen::MatrixXd information = J.transpose() * J;
    CHECK((derivative.transpose() * derivative - information).norm() < 1e-6 * information.norm());
    const Eigen::VectorXd gradient = J.transpose() * all;
    CHECK((derivative.transpose() * condensed->residuals - gradient).norm() < 1e-6 * gradient.norm());
  }
}

TEST_CASE("a prior and a measurement of the same weight meet halfway, however far apart") {
  Vector6 far;
  far << 0.4, -0.2, 0.7, 1.2, -0.9, 1.1;
  CellFit fit;
  const FitBlock pose = fit.add_pose("pose", Pose::Identity());
  fit.set_prior(pose, Vector6::Constant(0.1));
  fit.observe_pose(PoseChain().then(pose), to_pose(far), 0.1, 0.1);
  CHECK(fit.solve().fit.status == FitStatus::Converged);
  CHECK((to_vector(fit.pose(pose)) - 0.5 * far).norm() < 1e-7);
}

TEST_CASE("poses count by their covariance, which may change") {
  Random random(9);
  const auto random_covariance = [&] {
    const Eigen::MatrixXd A = Eigen::MatrixXd::NullaryExpr(6, 8, [&] { return random.normal(); });
    return Matrix6(1e-6 * A * A.transpose());
  };
  const Matrix6 C = random_covariance(), D = random_covariance();
  Vector6 d;
  d << 1e-4, -2e-4, 1e-4, 1e-5, 2e-5, -1e-5;
  CellFit fit;
  const FitBlock pose = fit.add_pose("pose", Pose::Identity());
  fit.observe_pose(PoseChain().then(pose), Pose::Identity(), C);
  const FitObservation second = fit.observe_pose(PoseChain().then(pose), to_pose(d), Matrix6(Matrix6::Identity()));
  fit.set_covariance(second, D);
  const CellFitResult result = fit.solve();
  const Matrix6 mean_covariance = (C.inverse() + D.inverse()).inverse();
  CHECK((to_vector(fit.pose(pose)) - mean_covariance * D.inverse() * d).norm() < 1e-4 * d.norm());
  CHECK(result.covariance.isApprox(mean_covariance, 1e-3));
}

TEST_CASE("a delay is found along a path with what stands at both its ends") {
  Random random(10);
  const PosePath path = [](double t) -> std::optional<PathSample> {
    const auto at = [](double time) {
      Vector6 v;
      v << 0.3 * std::sin(time), 0.2 * std::cos(2 * time), 0.1 * time, std::sin(1.5 * time), 0.5 * std::cos(time), 0.2;
      return to_pose(v);
    };
    const double h = 1e-5;
    return PathSample{at(t), pose_difference(at(t - h), at(t + h)) / (2 * h)};
  };
  const double delay = 0.37;
  const Pose X = random_pose(random), Z = random_pose(random);
  CellFit fit;
  const FitBlock hand_eye = fit.add_pose("X", X * to_pose(Vector6(0.02 * random.normal_vector(6)))),
                 world = fit.add_pose("Z", Z * to_pose(Vector6(0.02 * random.normal_vector(6)))),
                 clock = fit.add_vector("clock", Eigen::VectorXd::Constant(1, 0.34), {"delay [s]"});
  for (double t = 0; t < 4; t += 0.1) {
    const PoseChain chain = PoseChain().then_inverse(world).then_path(path, t, clock).then(hand_eye);
    fit.observe_pose(chain, Z.inverse() * path(t - delay)->T * X, 1e-3, 1e-3);
  }
  const CellFitResult result = fit.solve();
  CHECK(result.fit.status == FitStatus::Converged);
  CHECK(result.unidentifiable.empty());
  CHECK(fit.values(clock)[0] == Approx(delay).margin(1e-9));
  CHECK(pose_difference(fit.pose(hand_eye), X).norm() < 1e-8);
  CHECK(result.coordinates.back() == "clock.delay [s]");
}

TEST_CASE("a fit does not go where a path has no pose") {
  const PosePath path = [](double t) -> std::optional<PathSample> {
    if (t > 1.0) return std::nullopt;
    PathSample out;
    out.T.translation().x() = t;
    out.rate[0] = 1.0;
    return out;
  };
  CellFit fit;
  const FitBlock clock = fit.add_vector("clock", Eigen::VectorXd::Zero(1), {"delay [s]"});
  Pose further = Pose::Identity();
  further.translation().x() = 1.2;
  const FitObservation seen = fit.observe_pose(PoseChain().then_path(path, 0.9, clock), further, 1e-3, 1e-3);
  fit.solve();
  CHECK(fit.values(clock)[0] >= -0.1);
  fit.begin_at(clock, Eigen::VectorXd::Constant(1, -0.2));
  CHECK_FALSE(fit.derivatives(seen));
  CHECK(std::isinf(fit.residuals(seen)[0]));
}

TEST_CASE("joint errors that follow a regressor are found beside the arm") {
  Random random(4);
  const World w = random_world(random, 3);
  const Eigen::Vector3d compliance(1e-4, 2e-4, 3e-4);
  CellFit fit;
  const FitBlock arm = fit.add_arm("arm", w.arm),
                 c = fit.add_vector("sag", Eigen::VectorXd::Zero(3), {"c1", "c2", "c3"});
  fit.hold(arm);
  for (int i = 0; i < 20; ++i) {
    const Eigen::VectorXd q = random.normal_vector(3), load = random.normal_vector(3, 20);
    const Eigen::MatrixXd regressor = load.asDiagonal();
    const Eigen::VectorXd there = q + regressor * compliance;
    fit.observe_pose(PoseChain().then_arm(arm, q, c, regressor), w.arm.flange(there), 1e-4, 1e-4);
    fit.observe_pose(PoseChain().then_inverse_arm(arm, q, c, regressor), w.arm.flange(there).inverse(), 1e-4, 1e-4);
  }
  const CellFitResult result = fit.solve();
  CHECK((fit.values(c) - compliance).norm() < 1e-10);
  CHECK(result.coordinates == std::vector<std::string>{"sag.c1", "sag.c2", "sag.c3"});
}

TEST_CASE("what the measurements do not determine is named, and nothing else") {
  Random random(5);
  const World w = random_world(random);
  CellFit fit;
  kinematics::DhChain chain = w.arm;
  for (auto& joint : chain.joints) joint.type = kinematics::JointType::Revolute;
  chain.joints[0].beta = 0;
  const FitBlock arm = fit.add_arm("arm", chain), base = fit.add_pose("base", w.T_world_base);
  for (int k = 0; k < 20; ++k)
    if (k != 0 && k != 1 && k != 7) fit.hold(arm, k);  // joint1.b, joint1.theta_offset, joint2.a
  for (int i = 0; i < 30; ++i) {
    const Eigen::VectorXd q = random.normal_vector(4);
    fit.observe_pose(PoseChain().then(base).then_arm(arm, q), w.T_world_base * chain.flange(q), 1e-4, 1e-4);
  }
  const CellFitResult result = fit.solve();
  // Axis 1 is the z axis of the base: its height and its zero are the base's own.
  REQUIRE(result.unidentifiable.size() == 2);
  for (const UnidentifiableDirection& direction : result.unidentifiable)
    for (const std::string& coordinate : direction.coordinates) {
      CAPTURE(coordinate);
      CHECK((coordinate == "arm.joint1.b [m]" || coordinate == "base.z [m]" ||
             coordinate == "arm.joint1.theta_offset [rad]" || coordinate == "base.rz [rad]"));
    }
  CHECK_THAT(result.unidentifiable[0].text, Contains("only together"));
  const int a = fit.coordinates(arm)[7];
  CHECK(result.covariance(a, a) > 0);
  CHECK(std::sqrt(result.covariance(a, a)) < 1e-3);
}

TEST_CASE("a prior holds what the measurements leave open, and its redundancy tells which") {
  CellFit fit;
  const FitBlock v = fit.add_vector("v", Eigen::VectorXd::Zero(3), {"x [m]", "y [m]", "z [m]"}),
                 p = fit.add_point("p", Eigen::Vector3d::Zero());
  fit.set_prior(v, Eigen::Vector3d(1, 2, 3));
  fit.set_prior(p, Eigen::Vector3d(0.1, 0.1, std::numeric_limits<double>::infinity()));
  fit.observe_position({}, p, Eigen::Vector3d(1, 1, 1), 0.1);
  const CellFitResult result = fit.solve();
  CHECK((fit.values(p) - Eigen::Vector3d(0.5, 0.5, 1)).norm() < 1e-7);
  CHECK(fit.values(v).norm() < 1e-12);
  CHECK(fit.prior_redundancy(p)[0] == Approx(0.5));
  CHECK(fit.prior_redundancy(v)[1] == Approx(0).margin(1e-12));
  CHECK(result.covariance(1, 1) == Approx(4.0));
  CHECK(result.covariance(3, 3) == Approx(0.005));
}

TEST_CASE("the 95 % region of an arm's parameters holds the truth in 93 to 97 % of trials", "[coverage][statistics]") {
  Random random(6);
  test::Coverage coverage("cell fit, arm from points", 8);
  const int trials = test::trials(2000, 400);
  for (int trial = 0; trial < trials; ++trial) {
    World w = random_world(random, 2);
    for (auto& joint : w.arm.joints) joint.type = kinematics::JointType::Revolute;
    CellFit fit;
    const FitBlock arm = fit.add_arm("arm", w.arm);
    for (const int k : {4, 9}) fit.hold(arm, k);
    for (int i = 0; i < 15; ++i) {
      const Eigen::VectorXd q = random.normal_vector(2);
      for (int k = 0; k < 3; ++k)
        fit.observe_position(PoseChain().then_arm(arm, q), Eigen::Vector3d(0.2 * Eigen::Vector3d::Unit(k)),
                             Eigen::Vector3d(w.arm.flange(q) * Eigen::Vector3d(0.2 * Eigen::Vector3d::Unit(k)) +
                                             random.normal_vector(3, 2e-4)),
                             2e-4);
    }
    const CellFitResult result = fit.solve();
    if (!result.unidentifiable.empty()) continue;
    coverage.add(fit.change(arm)(Eigen::VectorXi{{0, 1, 2, 3, 5, 6, 7, 8}}), result.covariance);
  }
  REQUIRE(coverage.trials() > trials / 2);
  coverage.check_rate();
}

TEST_CASE("gross errors hardly move a fit with a Cauchy loss") {
  Random random(7);
  const auto error_with = [&](double loss) {
    CellFit fit;
    const FitBlock p = fit.add_point("p", Eigen::Vector3d::Zero());
    for (int i = 0; i < 50; ++i)
      fit.observe_position({}, p,
                           Eigen::Vector3d(random.normal_vector(3, 1e-3) +
                                           (i % 5 ? Eigen::Vector3d::Zero() : Eigen::Vector3d(0.5, 0, 0))),
                           1e-3);
    fit.solve({.loss = loss, .uncertainty = false});
    return fit.values(p).norm();
  };
  CHECK(error_with(0.0) > 0.05);
  CHECK(error_with(2.0) < 2e-3);
}

TEST_CASE("a fit that cannot be set up says why") {
  CellFit fit;
  CHECK_THROWS_WITH(fit.solve(), Contains("no parameter is free"));
  const FitBlock pose = fit.add_pose("base", Pose::Identity()), point = fit.add_point("tip", Eigen::Vector3d::Zero());
  CHECK_THROWS_WITH(fit.observe_position(PoseChain().then(point), point, Eigen::Vector3d(0, 0, 0), 1.0),
                    Contains("tip is no pose"));
  CHECK_THROWS_WITH(fit.observe_position({}, pose, Eigen::Vector3d(0, 0, 0), 1.0), Contains("base is no point"));
  CHECK_THROWS_WITH(fit.observe_pose({}, Pose::Identity(), 0.0, 1.0), Contains("standard deviations must be positive"));
  CHECK_THROWS_WITH(
      fit.observe_position({}, point, Eigen::Vector3d(0, 0, 0), Eigen::Matrix3d(-Eigen::Matrix3d::Identity())),
      Contains("positive definite"));
  CHECK_THROWS_WITH(fit.set_prior(pose, Eigen::Vector3d(1, 1, 1)), Contains("expected 6 standard deviations"));
  CHECK_THROWS_WITH(fit.hold(pose, 6), Contains("no coordinate 6"));
  CHECK_THROWS_AS(fit.pose(FitBlock{7}), InvalidArgument);
  kinematics::DhChain two;
  two.joints.resize(2);
  const FitBlock arm = fit.add_arm("arm", two);
  CHECK_THROWS_WITH(fit.observe_pose(PoseChain().then_arm(arm, Eigen::VectorXd::Zero(3)), Pose::Identity(), 1, 1),
                    Contains("expected 2 finite joint values"));
  const FitBlock lens_block = fit.add_camera("camera", lens());
  const FitObservation view = fit.observe_pixels(PoseChain().then(Pose(Eigen::Translation3d(0, 0, 1))), lens_block,
                                                 Eigen::Matrix3Xd::Zero(3, 2), Eigen::Matrix2Xd::Zero(2, 2), 0.1);
  CHECK_THROWS_WITH(fit.set_pixel_sigmas(view, Eigen::Vector3d(1, 1, 1)), Contains("as many pixels"));
  CHECK_THROWS_WITH(PoseChain().then_path({}, 0.0), Contains("there is no path"));
  const PosePath still = [](double) { return std::optional(PathSample{}); };
  CHECK_THROWS_WITH(fit.observe_pose(PoseChain().then_path(still, 0.0, point), Pose::Identity(), 1, 1),
                    Contains("tip is no delay"));
  CHECK_THROWS_WITH(fit.observe_pose(PoseChain().then_path(still, NAN), Pose::Identity(), 1, 1),
                    Contains("the time on a path must be finite [s]"));
  CHECK_THROWS_WITH(fit.observe_pose({}, Pose::Identity(), Matrix6(Matrix6::Zero())), Contains("positive definite"));
  CHECK_THROWS_WITH(fit.set_covariance(view, Eigen::Matrix2d::Identity()), Contains("has no covariance"));
  CHECK_THROWS_WITH(fit.set_pixel_sigmas(view, Eigen::Vector2d(1, 0)), Contains("sigmas must be positive [px]"));
  CHECK_THROWS_WITH(fit.tie(pose, 0, 1), Contains("base: coordinates of a pose or a nuisance cannot be tied"));
  CHECK_THROWS_WITH(fit.tie(lens_block, 0, 12), Contains("camera: there is no free coordinate 12"));
  CHECK_THROWS_WITH(fit.tie(lens_block, 3, 3), Contains("cannot be tied to itself"));
  const FitBlock bow = fit.add_vector("bow", Eigen::Vector2d::Zero(), {"x", "y"});
  CHECK_THROWS_WITH(fit.observe_pixels({}, lens_block, Eigen::Matrix3Xd::Zero(3, 2), Eigen::Matrix2Xd::Zero(2, 2), 0.1,
                                       {bow, Eigen::MatrixXd::Zero(6, 3)}),
                    Contains("three rows a point and one column an amount"));
}

TEST_CASE("a prior on a pose that turns away from its start holds the direction that it was given") {
  CellFit fit;
  const FitBlock pose = fit.add_pose("pose", Pose::Identity());
  Vector6 sigma = Vector6::Constant(std::numeric_limits<double>::infinity());
  sigma[0] = 1e-3;  // along x of the start, which is -y of the pose as it is seen
  fit.set_prior(pose, sigma);
  Pose seen = Pose::Identity();
  seen.linear() = exp_rotation(Eigen::Vector3d(0, 0, M_PI / 2));
  fit.observe_pose(PoseChain().then(pose), seen, 0.1, 1e-6);
  const CellFitResult result = fit.solve();
  CHECK(std::sqrt(result.covariance(0, 0)) == Approx(0.1).epsilon(1e-3));
  CHECK(std::sqrt(result.covariance(1, 1)) == Approx(1e-3).epsilon(1e-3));
  CHECK(fit.prior_redundancy(pose)[0] == Approx(0).margin(1e-3));
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
  CellFit fit;
  const FitBlock block = fit.add_camera("camera", rough);
  for (int k = 2; k < 12; ++k) fit.hold(block, k);
  fit.tie(block, 0, 1, rough.fy / rough.fx);
  fit.observe_pixels(PoseChain().then(T), block, points, pixels, 0.1);
  const CellFitResult result = fit.solve();
  CHECK(result.coordinates.size() == 1);
  CHECK(fit.camera(block).fx == Approx(840).epsilon(1e-9));
  CHECK(fit.camera(block).fy == Approx(1050).epsilon(1e-9));
  CHECK(fit.coordinates(block)[1] == 0);
  CHECK_THROWS_WITH(fit.tie(block, 0, 1), Contains("tied already"));
}

TEST_CASE("a pose may be seen without its orientation") {
  CellFit fit;
  const FitBlock pose = fit.add_pose("pose", Pose::Identity());
  Pose seen = Pose::Identity();
  seen.translation() << 0.1, 0.2, 0.3;
  fit.observe_pose(PoseChain().then(pose), seen, 1e-3, std::numeric_limits<double>::infinity());
  const CellFitResult result = fit.solve();
  CHECK((fit.pose(pose).translation() - seen.translation()).norm() < 1e-9);
  CHECK(result.unidentifiable.size() == 3);
}
