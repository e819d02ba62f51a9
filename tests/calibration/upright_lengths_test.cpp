#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/calibration/upright_lengths.hpp>
#include <kr5/core/error.hpp>

#include "calibration/turns_world.hpp"

namespace upright_lengths_test {

using namespace kr5;
using namespace kr5::calibration;
using Catch::Matchers::Contains;

/// An arm whose forearm stood across axis 1, and axis 6 with the forearm along it.
struct UprightTurns {
  ArmAxesResult arm;
  JointAxisResult sixth;
};

UprightTurns turns_of(const kinematics::DhChain& arm, double sigma, Random& random) {
  const Eigen::VectorXd across = test::with_level_wrist(arm, test::posture(0.03, false, false)),
                        upright = test::with_level_wrist(arm, test::posture(0.03, true, false));
  std::vector<std::vector<JointSample>> turns;
  const double arc = 50 * test::degree;
  for (int k = 0; k < static_cast<int>(arm.joints.size()); ++k)
    turns.push_back(test::turn_samples(arm, across, k, Eigen::Vector3d(0.25, 0.05, 0.2), sigma, random, arc));
  return {identify_arm_axes(turns, across), test::turn_of(arm, upright, 5, sigma, random, arc)};
}

TEST_CASE("an identified arm and one more turn of joint 6 give the four lengths") {
  Random random(1);
  for (int trial = 0; trial < 5; ++trial) {
    const double a1 = random.uniform(0.05, 0.4), a2 = random.uniform(0.3, 0.9), a3 = random.uniform(0.05, 0.2),
                 b4 = random.uniform(0.4, 0.9);
    const UprightTurns w = turns_of(test::arm_of(a1, a2, a3, b4), 1e-5, random);
    const UprightLengths r = identify_upright_lengths(w.arm, w.sixth);
    CAPTURE(trial, r.lengths.fit.message);
    REQUIRE(r.lengths.fit.usable());
    const Eigen::Vector4d error(r.lengths.a1 - a1, r.lengths.a2 - a2, r.lengths.a3 - a3, r.lengths.b4 - b4);
    for (int i = 0; i < 4; ++i) CHECK(std::abs(error[i]) < 4 * std::sqrt(r.lengths.covariance(i, i)) + 1e-5);
    CHECK(r.distances.c_23 == Approx(a2).margin(1e-3));
    CHECK(r.distances.objection.empty());
  }
}

TEST_CASE("arms whose lengths these distances do not tell are a status with the reason") {
  Random random(2);
  kinematics::DhChain long_wrist = test::book_arm();
  long_wrist.joints[4].b = 0.1;
  UprightTurns w = turns_of(long_wrist, 1e-5, random);
  const UprightLengths r = identify_upright_lengths(w.arm, w.sixth);
  CHECK_FALSE(r.lengths.fit.usable());
  CHECK_THAT(r.lengths.fit.message, Contains("do not determine the lengths of this arm") &&
                                        Contains("the axes of the wrist do not meet in one point"));
  CHECK(r.distances.objection == r.lengths.fit.message);
  w = turns_of(test::book_arm(), 1e-5, random);
  w.arm.axes.pop_back(), w.arm.arm.joints.pop_back();
  CHECK_THAT(identify_upright_lengths(w.arm, w.sixth).lengths.fit.message, Contains("the arm has 5 joints"));
}

TEST_CASE("axes that were not identified, and options that are none, are refused") {
  Random random(3);
  UprightTurns w = turns_of(test::book_arm(), 1e-5, random);
  CHECK_THROWS_WITH(identify_upright_lengths(w.arm, w.sixth, {.min_separation = -1}), Contains("min_separation"));
  w.sixth.fit.status = FitStatus::Degenerate;
  CHECK_THROWS_WITH(identify_upright_lengths(w.arm, w.sixth), Contains("axis6_upright: was not identified"));
  w.arm.fit.status = FitStatus::Degenerate;
  CHECK_THROWS_WITH(identify_upright_lengths(w.arm, w.sixth), Contains("arm: was not identified"));
}

}  // namespace upright_lengths_test
