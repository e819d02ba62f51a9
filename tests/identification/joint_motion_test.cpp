#include <limits>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/identification/joint_motion.hpp>

namespace joint_motion_test {

using namespace kr5;
using namespace kr5::identification;
using Catch::Matchers::Contains;

namespace {

JointMotion sound_motion() {
  const Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(4, 2);
  return {Eigen::Vector4d(0, 0.01, 0.5, 0.51), zero, zero, zero, zero, {0, 2}};
}

}  // namespace

TEST_CASE("names field and row of what is wrong in a motion") {
  CHECK_NOTHROW(sound_motion().validate());
  JointMotion motion = sound_motion();
  motion.tau(2, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(motion.validate(), Contains("tau: row 2, joint 2"));
  motion = sound_motion();
  motion.qd.resize(3, 2);
  CHECK_THROWS_WITH(motion.validate(), Contains("qd: expected 4 x 2"));
  motion = sound_motion();
  motion.t[3] = motion.t[2];
  CHECK_THROWS_WITH(motion.validate(), Contains("t: row 3"));
  motion = sound_motion();
  motion.t[2] = -7;  // another run may begin at any time
  motion.t[3] = -6;
  CHECK_NOTHROW(motion.validate());
  motion.run_starts = {2};
  CHECK_THROWS_WITH(motion.validate(), Contains("run_starts"));
}

TEST_CASE("motions are merged run by run, with temperatures where all have them") {
  JointMotion first = sound_motion(), second = sound_motion();
  second.run_starts.clear();
  second.q.setConstant(7);
  second.speed_noise = Eigen::Vector2d(1e-3, 2e-3);
  first.temperature = Eigen::MatrixXd::Constant(4, 2, 30.0);
  const std::vector<JointMotion> both = {first, second};
  JointMotion merged = merged_motion(both);
  CHECK_NOTHROW(merged.validate());
  CHECK(merged.samples() == 8);
  CHECK(merged.run_starts == std::vector<int>{0, 2, 4});
  CHECK(merged.q(3, 0) == 0);
  CHECK(merged.q(4, 0) == 7);
  CHECK(merged.temperature.size() == 0);
  CHECK(merged.speed_noise == second.speed_noise);
  second.temperature = Eigen::MatrixXd::Constant(4, 2, 40.0);
  merged = merged_motion(std::vector<JointMotion>{first, second});
  CHECK(merged.temperature(3, 1) == 30);
  CHECK(merged.temperature(4, 1) == 40);
  CHECK_THROWS_WITH(merged_motion({}), Contains("at least one"));
}

}  // namespace joint_motion_test
