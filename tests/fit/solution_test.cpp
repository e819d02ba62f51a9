#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/fit/measurements/plane_point.hpp>
#include <kr5/fit/measurements/pose.hpp>
#include <kr5/fit/measurements/position.hpp>
#include <kr5/fit/problem.hpp>
#include <support/coverage.hpp>
#include <support/trials.hpp>

#include "fit/fit_world.hpp"

namespace solution_test {

using namespace kr5;
using namespace kr5::fit;
using namespace kr5::test;
using Catch::Matchers::Contains;

TEST_CASE("a report counts priors and nuisances; an agreement, what a nuisance without a prior leaves") {
  double rms = 0.0, squared = 0.0, dof = 0.0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    Problem fit;
    const FitBlock point = fit.add_point("point", Eigen::Vector3d::Zero());
    fit.set_prior(point, Eigen::Vector3d::Constant(0.1));  // the truth lies that far from the start
    const Eigen::Vector3d truth = random.normal_vector(3, 0.1);
    std::vector<FitMeasurement> pairs;
    for (int i = 0; i < 12; ++i) {  // places seen through a frame shifted along x by an unknown length
      const FitBlock shift = fit.add_nuisance_vector("shift" + std::to_string(i), Eigen::VectorXd::Zero(1), {"x [m]"});
      kinematics::DhChain slide;
      slide.joints.resize(1);
      slide.joints[0].type = kinematics::JointType::Prismatic;
      const FitBlock arm = fit.add_arm("slide" + std::to_string(i), slide);
      fit.hold(arm);
      const Eigen::Vector3d seen = Eigen::Vector3d(0, 0, random.normal(0.5)) + truth + random.normal_vector(3, 1e-3);
      pairs.push_back(fit.add(PositionMeasurement(
          PoseChain().then_arm(arm, Eigen::VectorXd::Zero(1), shift, Eigen::MatrixXd::Ones(1, 1)), point, seen, 1e-3)));
    }
    const Solution result = fit.solve();
    rms += result.fit.final_rms * result.fit.final_rms / 20;
    for (const FitMeasurement pair : pairs) {
      CHECK(result.agreement(fit, pair).dof == 2);
      squared += result.agreement(fit, pair).squared_distance, dof += result.agreement(fit, pair).dof;
    }
    CHECK(result.undetermined.empty());
    CHECK(std::sqrt(result.covariance(2, 2)) == Approx(0.1).epsilon(1e-6));  // of z only the prior knows
    CHECK(std::abs(fit.values(point)[2]) < 1e-6);
  }
  CHECK(rms == Approx(1.0).epsilon(0.15));  // (36 + 3 - 3 - 12) x 20 degrees of freedom
  CHECK(squared / dof == Approx(1.0).epsilon(0.2));
}

TEST_CASE("what neither measurement nor prior determines has an infinite variance") {
  Problem fit;
  const FitBlock point = fit.add_point("point", Eigen::Vector3d::Zero());
  const Pose plane = Pose::Identity();
  fit.add(PlanePointMeasurement(PoseChain().then(plane), point, 1e-3));
  const Solution result = fit.solve();
  CHECK(result.undetermined == std::vector<std::string>{"point.x [m]", "point.y [m]"});
  CHECK(std::isinf(result.covariance(0, 0)));
  CHECK(std::sqrt(result.covariance(2, 2)) == Approx(1e-3));
  CHECK_THROWS_WITH(fit.solve({.loss = 1.0}), Contains("set loss to 0"));
}

TEST_CASE("what the measurements do not determine is named, and nothing else") {
  Random random(5);
  const World w = random_world(random);
  Problem fit;
  kinematics::DhChain chain = w.arm;
  for (auto& joint : chain.joints) joint.type = kinematics::JointType::Revolute;
  chain.joints[0].beta = 0;
  const FitBlock arm = fit.add_arm("arm", chain), base = fit.add_pose("base", w.T_world_base);
  for (int k = 0; k < 20; ++k)
    if (k != 0 && k != 1 && k != 7) fit.hold(arm, k);  // joint1.b, joint1.theta_offset, joint2.a
  for (int i = 0; i < 30; ++i) {
    const Eigen::VectorXd q = random.normal_vector(4);
    fit.add(PoseMeasurement(PoseChain().then(base).then_arm(arm, q), w.T_world_base * chain.flange(q), 1e-4, 1e-4));
  }
  const Solution result = fit.solve();
  // Axis 1 is the z axis of the base: its height and its zero are the base's own.
  REQUIRE(result.unidentifiable.size() == 2);
  for (const UnidentifiableDirection& direction : result.unidentifiable)
    for (const std::string& coordinate : direction.coordinates) {
      CAPTURE(coordinate);
      CHECK((coordinate == "arm.joint1.b [m]" || coordinate == "base.z [m]" ||
             coordinate == "arm.joint1.theta_offset [rad]" || coordinate == "base.rz [rad]"));
    }
  for (const UnidentifiableDirection& direction : result.unidentifiable) {
    CHECK((direction.involves("arm") && direction.involves("base")));
    CHECK_FALSE((direction.involves("ar") || direction.involves("arm.joint2") || direction.involves("")));
  }
  CHECK_THAT(result.unidentifiable[0].text, Contains("only together"));
  const int a = result.places(arm)[7];
  CHECK(result.covariance(a, a) > 0);
  CHECK(std::sqrt(result.covariance(a, a)) < 1e-3);
}

TEST_CASE("a prior holds what the measurements leave open, and its redundancy tells which") {
  Problem fit;
  const FitBlock v = fit.add_vector("v", Eigen::VectorXd::Zero(3), {"x [m]", "y [m]", "z [m]"}),
                 p = fit.add_point("p", Eigen::Vector3d::Zero());
  fit.set_prior(v, Eigen::Vector3d(1, 2, 3));
  fit.set_prior(p, Eigen::Vector3d(0.1, 0.1, std::numeric_limits<double>::infinity()));
  fit.add(PositionMeasurement({}, p, Eigen::Vector3d(1, 1, 1), 0.1));
  const Solution result = fit.solve();
  CHECK(result.free_coordinates().at(4).text() == "p.y [m]");
  CHECK(result.coordinates.at(4) == "p.y [m]");
  CHECK((fit.values(p) - Eigen::Vector3d(0.5, 0.5, 1)).norm() < 1e-7);
  CHECK(fit.values(v).norm() < 1e-12);
  CHECK(result.prior_redundancy(fit, p)[0] == Approx(0.5));
  CHECK(result.prior_redundancy(fit, v)[1] == Approx(0).margin(1e-12));
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
    Problem fit;
    const FitBlock arm = fit.add_arm("arm", w.arm);
    for (const int k : {4, 9}) fit.hold(arm, k);
    for (int i = 0; i < 15; ++i) {
      const Eigen::VectorXd q = random.normal_vector(2);
      for (int k = 0; k < 3; ++k)
        fit.add(PositionMeasurement(PoseChain().then_arm(arm, q), Eigen::Vector3d(0.2 * Eigen::Vector3d::Unit(k)),
                                    Eigen::Vector3d(w.arm.flange(q) * Eigen::Vector3d(0.2 * Eigen::Vector3d::Unit(k)) +
                                                    random.normal_vector(3, 2e-4)),
                                    2e-4));
    }
    const Solution result = fit.solve();
    if (!result.unidentifiable.empty()) continue;
    coverage.add(fit.change(arm)(Eigen::VectorXi{{0, 1, 2, 3, 5, 6, 7, 8}}), result.covariance);
  }
  REQUIRE(coverage.trials() > trials / 2);
  coverage.check_rate();
}

TEST_CASE("a prior on a pose that turns away from its start holds the direction that it was given") {
  Problem fit;
  const FitBlock pose = fit.add_pose("pose", Pose::Identity());
  Vector6 sigma = Vector6::Constant(std::numeric_limits<double>::infinity());
  sigma[0] = 1e-3;  // along x of the start, which is -y of the pose as it is seen
  fit.set_prior(pose, sigma);
  Pose seen = Pose::Identity();
  seen.linear() = exp_rotation(Eigen::Vector3d(0, 0, M_PI / 2));
  fit.add(PoseMeasurement(PoseChain().then(pose), seen, 0.1, 1e-6));
  const Solution result = fit.solve();
  CHECK(std::sqrt(result.covariance(0, 0)) == Approx(0.1).epsilon(1e-3));
  CHECK(std::sqrt(result.covariance(1, 1)) == Approx(1e-3).epsilon(1e-3));
  CHECK(result.prior_redundancy(fit, pose)[0] == Approx(0).margin(1e-3));
}

}  // namespace solution_test
