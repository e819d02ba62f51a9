#include <limits>
#include <numbers>

#include <catch2/catch.hpp>

#include <calibration/arm_world.hpp>
#include <kr5/calibration/turn_agreement.hpp>
#include <kr5/core/error.hpp>

namespace turn_agreement_test {

using namespace kr5;
using namespace kr5::calibration;
using namespace kr5::test;

namespace {

struct Stops {
  kinematics::DhChain arm = nominal_arm();
  kinematics::Rows q;
  std::vector<Pose> poses;

  Stops(Random& random, int count, double noise) : q(count, 6) {
    const Pose base = to_pose(random.normal_vector(6)), tool = to_pose(random.normal_vector(6));
    for (int i = 0; i < count; ++i) {
      q.row(i) = random_posture(random).transpose();
      poses.push_back(base * arm.flange(q.row(i).transpose()) * tool * to_pose(random.normal_vector(6, noise)));
    }
  }
};

}  // namespace

TEST_CASE("joint values agree with their poses in the frame of any base and tool, and with others they do not") {
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const Stops exact(random, 15, 0.0), noisy(random, 15, 5e-3);
    const TurnAgreement found = compare_turns(exact.arm, exact.q, exact.poses);
    CHECK(found.agrees);
    CHECK(found.turns == 14);
    CHECK(found.difference < 1e-7);
    CHECK(compare_turns(noisy.arm, noisy.q, noisy.poses).agrees);
    CHECK_FALSE(compare_turns(exact.arm, exact.q.colwise().reverse(), exact.poses).agrees);
    CHECK_FALSE(compare_turns(exact.arm, exact.q * (std::numbers::pi / 180), exact.poses).agrees);
    CHECK_FALSE(compare_turns(exact.arm, exact.q, noisy.poses).agrees);
  }
}

TEST_CASE("one stop tells nothing; NaN, other numbers of rows and another arm are refused") {
  Random random(2);
  Stops stops(random, 6, 0.0);
  const TurnAgreement one = compare_turns(stops.arm, stops.q.topRows(1), std::span(stops.poses).first(1));
  CHECK(one.turns == 0);
  CHECK(one.agrees);
  CHECK_THROWS_AS(compare_turns(stops.arm, stops.q.topRows(5), stops.poses), InvalidArgument);
  CHECK_THROWS_AS(compare_turns(stops.arm, stops.q.leftCols(5), stops.poses), InvalidArgument);
  CHECK_THROWS_AS(compare_turns(stops.arm, stops.q, stops.poses, 0.0), InvalidArgument);
  stops.poses[2].translation()[0] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(compare_turns(stops.arm, stops.q, stops.poses), InvalidArgument);
  stops.q(1, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(compare_turns(stops.arm, stops.q, stops.poses), InvalidArgument);
}

}  // namespace turn_agreement_test
