#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/calibration/parallel_planes.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/kinematics/axis_chain.hpp>
#include <support/coverage.hpp>
#include <support/trials.hpp>

#include "calibration/turns_world.hpp"

namespace parallel_planes_test {

using namespace kr5;
using namespace kr5::calibration;
using Catch::Matchers::Contains;
using kinematics::DhChain;
using test::arm_of, test::degree, test::posture, test::turn_of, test::turns_of, test::with_level_wrist;

TEST_CASE("p = 800, q = 60, s = 631.5 mm have the solutions 680 and 180 mm, of which 180 is the arm's") {
  ParallelPlaneDistances d{.c_23 = 0.6, .c_35 = 0.6315, .c_16 = 0.8, .c_16_upright = 0.06, .objection = {}};
  d.covariance = Eigen::Matrix4d::Identity() * 1e-8;
  const ParallelPlaneLengths r = lengths_from_parallel_planes(d);
  REQUIRE(r.fit.usable());
  CHECK(r.a1 == Approx(0.18).margin(1e-5));  // s is printed to a tenth of a millimetre
  CHECK(r.a1_other == Approx(0.68).margin(1e-5));
  CHECK(r.a2 == 0.6);
  CHECK(r.a3 == Approx(0.12).margin(1e-5));
  CHECK(r.b4 == Approx(0.62).margin(1e-5));
  // The other solution satisfies the same equations, with elbow and forearm exchanged.
  const ParallelPlaneLengths other = lengths_from_parallel_planes(d, {.a1 = 0.6});
  CHECK(other.a1 == Approx(0.68).margin(1e-5));
  CHECK(other.a3 == Approx(r.b4).margin(1e-12));
  CHECK(other.b4 == Approx(r.a3).margin(1e-12));
  d.c_35 = std::hypot(0.12, 0.62);
  const ParallelPlaneLengths exact = lengths_from_parallel_planes(d);
  CHECK(exact.a1 == Approx(0.18).margin(1e-14));
  CHECK(exact.b4 == Approx(0.62).margin(1e-14));
}

TEST_CASE(
    "exact turns give the four lengths, however far the upper arm leans and to whichever side the forearm points") {
  Random random(1);
  for (const double lean : {0.0, 0.05, -0.2}) {
    for (int trial = 0; trial < 5; ++trial) {
      const double a1 = random.uniform(0.05, 0.4), a2 = random.uniform(0.3, 0.9), a3 = random.uniform(-0.1, 0.2),
                   b4 = random.uniform(0.4, 0.9);
      const DhChain arm = arm_of(a1, a2, a3, b4);
      CHECK(parallel_plane_objection(arm).empty());
      const ParallelPlaneLengths r =
          lengths_from_parallel_planes(parallel_plane_distances(turns_of(arm, lean, 0, random, trial % 2 == 1)));
      CAPTURE(lean, trial, r.fit.message);
      REQUIRE(r.fit.usable());
      CHECK(std::abs(r.a1 - a1) < 1e-8);
      CHECK(std::abs(r.a2 - a2) < 1e-8);
      CHECK(std::abs(r.a3 - a3) < 1e-8);
      CHECK(std::abs(r.b4 - b4) < 1e-8);
    }
  }
}

TEST_CASE("the 95 % region of the lengths holds the truth in 93 to 97 % of trials",
          "[coverage][statistics][not_sanitized]") {
  const int trials = test::trials(2000, 100);
  Random random(2);
  const DhChain arm = arm_of(0.18, 0.6, 0.12, 0.62);
  test::Coverage coverage("lengths by parallel planes", 4);
  for (int trial = 0; trial < trials; ++trial) {
    const ParallelPlaneLengths r =
        lengths_from_parallel_planes(parallel_plane_distances(turns_of(arm, 0.03, 2e-4, random)));
    REQUIRE(r.fit.usable());
    coverage.add(Eigen::Vector4d(r.a1 - 0.18, r.a2 - 0.6, r.a3 - 0.12, r.b4 - 0.62), r.covariance,
                 uncertainty::known_noise);
  }
  coverage.check_rate();
}

TEST_CASE("a wrist set by hand makes the lengths as uncertain as its tilt shifts axis 6") {
  Random random(7);
  const DhChain arm = arm_of(0.18, 0.6, 0.12, 0.62);
  for (const double tilt : {-1.5, -0.8, 0.8, 1.5}) {
    ParallelPlaneAxes axes = turns_of(arm, 0.0, 2e-5, random);
    Eigen::VectorXd q = with_level_wrist(arm, posture(0.0, false, false));
    q[4] += tilt * degree;
    axes.axis6 = turn_of(arm, q, 5, 2e-5, random, 50 * degree);
    const ParallelPlaneLengths r = lengths_from_parallel_planes(parallel_plane_distances(axes));
    CAPTURE(tilt, r.a1, r.covariance(0, 0));
    REQUIRE(r.fit.usable());
    CHECK(std::abs(r.a1 - 0.18) > 2e-4);  // ten times what the noise alone makes
    CHECK(std::abs(r.a1 - 0.18) < 2 * std::sqrt(r.covariance(0, 0)));
    CHECK(std::abs(r.a3 - 0.12) < 2 * std::sqrt(r.covariance(2, 2)));
  }
}

TEST_CASE("distances that no arm has, and solutions that cannot be told apart, are told") {
  ParallelPlaneDistances d{.c_23 = 0.6, .c_35 = 0.4, .c_16 = 0.8, .c_16_upright = 0.06, .objection = {}};
  d.covariance = Eigen::Matrix4d::Identity() * 1e-6;
  CHECK_THAT(lengths_from_parallel_planes(d).fit.message, Contains("no arm has these distances"));
  d.c_35 = 0.74 / std::sqrt(2.0) + 1e-5;  // elbow and forearm of equal length
  CHECK_FALSE(lengths_from_parallel_planes(d).fit.usable());
  CHECK_THAT(lengths_from_parallel_planes(d).fit.message, Contains("standard deviations apart"));
  d.c_35 = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(lengths_from_parallel_planes(d), InvalidArgument);
  d.c_35 = 0.63;
  CHECK_THROWS_WITH(lengths_from_parallel_planes(d, {.min_separation = -1}), Contains("min_separation"));
}

TEST_CASE("postures and arms for which the constraints do not hold are named") {
  Random random(3);
  const DhChain arm = arm_of(0.18, 0.6, 0.12, 0.62);
  ParallelPlaneAxes axes = turns_of(arm, 0.0, 1e-5, random);
  axes.axis5 = axes.axis6;
  CHECK_THAT(parallel_plane_distances(axes).objection, Contains("the axes 3 and 5 are 90.0 deg from parallel"));
  CHECK_FALSE(lengths_from_parallel_planes(parallel_plane_distances(axes)).fit.usable());
  axes.axis2.fit.status = FitStatus::Degenerate;
  CHECK_THROWS_WITH(parallel_plane_distances(axes), Contains("axis2: was not identified"));

  DhChain lateral = arm, elbow = arm, wrist = arm, short_arm = arm;
  lateral.joints[1].b = 0.135;
  CHECK_THAT(parallel_plane_objection(lateral), Contains("135.0 mm beside axis 1"));
  lateral.joints[2].b = 0.135;  // axes 2 and 3 point opposite ways: the offsets cancel
  CHECK(parallel_plane_objection(lateral).empty());
  elbow.joints[1].alpha = M_PI / 2;
  CHECK_THAT(parallel_plane_objection(elbow), Contains("axes 2 and 3 are not parallel"));
  wrist.joints[4].b = 0.1;
  CHECK_THAT(parallel_plane_objection(wrist), Contains("wrist do not meet"));
  short_arm.joints.pop_back();
  CHECK_THAT(parallel_plane_objection(short_arm), Contains("5 joints, not six"));
}

}  // namespace parallel_planes_test
