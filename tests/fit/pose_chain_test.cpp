#include <cmath>
#include <optional>

#include <catch2/catch.hpp>

#include <kr5/fit/measurements/pose.hpp>
#include <kr5/fit/problem.hpp>

#include "fit/fit_world.hpp"

namespace pose_chain_test {

using namespace kr5;
using namespace kr5::fit;
using namespace kr5::test;

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
  Problem fit;
  const FitBlock hand_eye = fit.add_pose("X", X * to_pose(Vector6(0.02 * random.normal_vector(6)))),
                 world = fit.add_pose("Z", Z * to_pose(Vector6(0.02 * random.normal_vector(6)))),
                 clock = fit.add_vector("clock", Eigen::VectorXd::Constant(1, 0.34), {"delay [s]"});
  for (double t = 0; t < 4; t += 0.1) {
    const PoseChain chain = PoseChain().then_inverse(world).then_path(path, t, clock).then(hand_eye);
    fit.add(PoseMeasurement(chain, Z.inverse() * path(t - delay)->T * X, 1e-3, 1e-3));
  }
  const Solution result = fit.solve();
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
  Problem fit;
  const FitBlock clock = fit.add_vector("clock", Eigen::VectorXd::Zero(1), {"delay [s]"});
  Pose further = Pose::Identity();
  further.translation().x() = 1.2;
  const FitMeasurement seen = fit.add(PoseMeasurement(PoseChain().then_path(path, 0.9, clock), further, 1e-3, 1e-3));
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
  Problem fit;
  const FitBlock arm = fit.add_arm("arm", w.arm),
                 c = fit.add_vector("sag", Eigen::VectorXd::Zero(3), {"c1", "c2", "c3"});
  fit.hold(arm);
  for (int i = 0; i < 20; ++i) {
    const Eigen::VectorXd q = random.normal_vector(3), load = random.normal_vector(3, 20);
    const Eigen::MatrixXd regressor = load.asDiagonal();
    const Eigen::VectorXd there = q + regressor * compliance;
    fit.add(PoseMeasurement(PoseChain().then_arm(arm, q, c, regressor), w.arm.flange(there), 1e-4, 1e-4));
    fit.add(
        PoseMeasurement(PoseChain().then_inverse_arm(arm, q, c, regressor), w.arm.flange(there).inverse(), 1e-4, 1e-4));
  }
  const Solution result = fit.solve();
  CHECK((fit.values(c) - compliance).norm() < 1e-10);
  CHECK(result.coordinates == std::vector<std::string>{"sag.c1", "sag.c2", "sag.c3"});
}

}  // namespace pose_chain_test
