#include <limits>

#include <catch2/catch.hpp>

#include <kr5/fit/measurements/pixels.hpp>
#include <kr5/fit/measurements/pose.hpp>
#include <kr5/fit/problem.hpp>

#include "fit/derivatives.hpp"
#include "fit/fit_world.hpp"

namespace pixels_test {

using namespace kr5;
using namespace kr5::fit;
using namespace kr5::test;

TEST_CASE("poses of views as nuisances change neither the camera nor its covariance; a point may count less") {
  Random random(4);
  const Pinhole camera = lens();
  Eigen::Matrix3Xd points(3, 20);
  for (int k = 0; k < 20; ++k) points.col(k) << 0.03 * (k % 5) - 0.06, 0.03 * (k / 5) - 0.045, 0.0;
  const double infinite = std::numeric_limits<double>::infinity();
  Eigen::VectorXd sigmas = Eigen::VectorXd::Constant(20, 0.1);
  sigmas[3] = infinite, sigmas[4] = 0.3;
  Problem as_nuisance, as_block;
  FitBlock lens_of[2];
  for (Problem* fit : {&as_nuisance, &as_block}) {
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
    for (Problem* fit : {&as_nuisance, &as_block}) {
      const std::string name = "view" + std::to_string(i);
      const FitBlock view =
          fit == &as_block ? fit->add_pose(name, T_camera_target) : fit->add_nuisance_pose(name, T_camera_target);
      PixelMeasurement seen(PoseChain().then(view), lens_of[fit == &as_block], points, pixels, 0.1);
      seen.set_sigmas(sigmas);
      fit->add(seen);
    }
  }
  const Solution a = as_nuisance.solve(), b = as_block.solve();
  CHECK(a.cost == Approx(b.cost).epsilon(1e-9));
  REQUIRE(a.coordinates.size() == 4);
  const Eigen::Vector4d first = as_nuisance.camera(lens_of[0]).parameters().head<4>(),
                        second = as_block.camera(lens_of[1]).parameters().head<4>();
  CHECK((first - second).norm() < 1e-5);
  CHECK(a.covariance.isApprox(b.covariance.topLeftCorner<4, 4>(), 1e-5));
  CHECK((first - camera.parameters().head<4>()).cwiseQuotient(a.covariance.diagonal().cwiseSqrt()).norm() < 4.5);
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
  Problem fit;
  const FitBlock lens_block = fit.add_camera("camera", rough);
  bow.amounts = fit.add_vector("board", Eigen::Vector2d::Zero(), {"bow", "stretch"});
  fit.tie(lens_block, 0, 1);
  for (const int held : {5, 7, 8, 9, 10, 11}) fit.hold(lens_block, held);
  std::vector<FitMeasurement> views;
  for (int i = 0; i < 6; ++i) {
    Vector6 look;
    look << random.normal_vector(2, 0.03), random.uniform(0.4, 0.6), random.normal_vector(3, 0.3);
    const Pose T = to_pose(look);
    Eigen::Matrix2Xd pixels(2, 20);
    for (Eigen::Index k = 0; k < 20; ++k) pixels.col(k) = camera.project(T * Eigen::Vector3d(bent.col(k)));
    const FitBlock view =
        fit.add_nuisance_pose("view" + std::to_string(i), T * to_pose(Vector6(Vector6::Constant(1e-3))));
    views.push_back(fit.add(PixelMeasurement(PoseChain().then(view), lens_block, points, pixels, 0.2, bow)));
  }
  const Solution result = fit.solve();
  REQUIRE(result.coordinates.size() == 7);  // f cx cy k1 p1, bow and stretch
  CHECK(result.unidentifiable.empty());
  CHECK(result.places(lens_block) == std::vector<int>{0, 0, 1, 2, 3, -1, 4, -1, -1, -1, -1, -1});
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
  Problem fit;
  const FitBlock lens_block = fit.add_camera("camera", camera);
  for (int k = 1; k < 12; ++k) fit.hold(lens_block, k);
  const FitMeasurement view = fit.add(PixelMeasurement({}, lens_block, points, Eigen::Matrix2Xd::Zero(2, 4), 1.0));
  CHECK(fit.residuals(view).array().isInf().all());
  CHECK(fit.solve().fit.status == FitStatus::Degenerate);
  CHECK_FALSE(fit.derivatives(view));
  fit.measurement<PixelMeasurement>(view).set_sigmas(Eigen::Vector4d(1, 1, 1, std::numeric_limits<double>::infinity()));
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
    Problem fit;
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
    const FitMeasurement seen = fit.add(
        PixelMeasurement(PoseChain().then_inverse(blocks[0]).then(between).then_inverse(blocks[1]).then(blocks[2]),
                         lens_block, points, pixels, 0.5));
    fit.set_weight(seen, 0.0);  // does not count here
    fit.add(PoseMeasurement(PoseChain().then(blocks[0]), at[0], 1.0, 1.0)),
        fit.add(PoseMeasurement(PoseChain().then(blocks[2]), at[2], 1.0, 1.0));
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

TEST_CASE("pixels change with the chain, the camera and what bends the target") {
  Random random(40);
  Pinhole camera = lens();
  camera.k2 = 0.05, camera.p2 = -5e-4, camera.k3 = 0.01;
  Eigen::Matrix3Xd points(3, 8);
  for (int k = 0; k < 8; ++k) points.col(k) << 0.03 * (k % 4) - 0.045, 0.03 * (k / 4) - 0.015, 0.0;
  Problem problem;
  const FitBlock lens_block = problem.add_camera("camera", camera), view = [&] {
    Vector6 look;
    look << random.normal_vector(2, 0.03), 0.5, random.normal_vector(3, 0.3);
    return problem.add_pose("view", to_pose(look));
  }();
  const FitBlock amounts = problem.add_vector("board", Eigen::Vector2d(0.01, -0.02), {"bow", "stretch"});
  const Eigen::MatrixXd moved = Eigen::MatrixXd::NullaryExpr(24, 2, [&] { return random.normal(0.1); });
  const FitMeasurement m = problem.add(PixelMeasurement(PoseChain().then(view), lens_block, points,
                                                        Eigen::Matrix2Xd::Constant(2, 8, 500), 0.5, {amounts, moved}));
  check_derivatives(problem, m, {lens_block, view, amounts});
}

}  // namespace pixels_test
