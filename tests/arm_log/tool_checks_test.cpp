#include <algorithm>

#include <catch2/catch.hpp>

#include <kr5/arm_log/log_problem.hpp>

#include "arm_log/logged_arm.hpp"

namespace tool_checks_test {

using namespace kr5;
using namespace kr5::test;
using arm_log::LogProblem;
using arm_log::LogProblemKind;
using arm_log::LogRemedy;
using Catch::Matchers::Contains;

namespace {

/// Twenty postures with the tool where the cell puts it, but for `sigma`.
cell::Experiment touched(const cell::Cell& cell, Random& random, double sigma = 1e-3) {
  cell::Experiment out;
  out.name = "poses";
  out.kind = cell::Kind::Poses;
  out.data.columns = {"q1", "q2", "q3", "x", "y", "z"};
  out.data.values.resize(20, 6);
  for (Eigen::Index i = 0; i < 20; ++i) {
    const Eigen::VectorXd q = Eigen::VectorXd::NullaryExpr(3, [&] { return random.uniform(-1.2, 1.2); });
    out.data.values.row(i) << q.transpose(),
        (cell::T_base_tool(cell, q).translation() + random.normal_vector(3, sigma)).transpose();
  }
  return out;
}

auto positions(cell::Experiment& experiment) { return experiment.data.values.rightCols<3>(); }

}  // namespace

TEST_CASE("tool poses of a sound table are not objected to") {
  Random random(1);
  const cell::Cell cell = described_arm();
  for (int trial = 0; trial < 200; ++trial) CHECK(arm_log::check_positions(cell, touched(cell, random)).empty());
  cell::Experiment poses = touched(cell, random);
  positions(poses) *= 1e3;
  poses.data.values.conservativeResize(0, 6);
  CHECK(arm_log::check_positions(cell, poses).empty());
  poses = touched(cell, random);
  positions(poses) *= 1e3;
  poses.data.columns = {"a", "b", "c", "x", "y", "z"};  // without joint values nothing is known of the tool
  CHECK(arm_log::check_positions(cell, poses).empty());
}

TEST_CASE("tool positions in another unit are recognised") {
  constexpr std::pair<double, LogRemedy> units[] = {
      {1e3, LogRemedy::PositionMillimetre}, {1e2, LogRemedy::PositionCentimetre}, {1e-3, LogRemedy::PositionMetre}};
  Random random(2);
  const cell::Cell cell = described_arm();
  for (int trial = 0; trial < 210; ++trial) {
    const auto& [scale, remedy] = units[trial % 3];
    cell::Experiment poses = touched(cell, random);
    positions(poses) *= scale;
    const std::vector<LogProblem> found = arm_log::check_positions(cell, poses);
    REQUIRE(found.size() == 1);
    CHECK(found[0].kind == LogProblemKind::ToolScale);
    CHECK(found[0].remedy == remedy);
    CHECK(found[0].found == Approx(scale).epsilon(0.02));
    CHECK(found[0].experiment == "poses");
  }
}

TEST_CASE("tool positions in the frame of a device are recognised, and the device placed") {
  Random random(3);
  const cell::Cell cell = described_arm();
  for (int trial = 0; trial < 200; ++trial) {
    cell::Experiment poses = touched(cell, random);
    Vector6 d;
    d << 2 * random.direction(), random.uniform(0.5, 3.0) * random.direction();
    const Pose T_base_device = to_pose(d);
    const Eigen::Matrix3Xd seen = T_base_device.inverse() * Eigen::Matrix3Xd(positions(poses).transpose());
    positions(poses) = seen.transpose();
    const std::vector<LogProblem> found = arm_log::check_positions(cell, poses);
    REQUIRE(found.size() == 1);
    CHECK(found[0].kind == LogProblemKind::ToolFrame);
    CHECK(found[0].remedy == LogRemedy::DeviceFrame);
    CHECK(found[0].found_to < 5e-3);
    CHECK(pose_difference(found[0].T_base_device, T_base_device).norm() < 0.01);
    CHECK_THAT(text(found[0], cell),
               Contains("poses: x y z: found a tool") && Contains("after a rigid transformation"));
  }
}

TEST_CASE("a tool that is elsewhere in every frame is told") {
  Random random(4);
  const cell::Cell cell = described_arm();
  for (int trial = 0; trial < 200; ++trial) {
    cell::Experiment poses = touched(cell, random);
    for (Eigen::Index i = 0; i < 20; ++i) positions(poses).row(i) = random.normal_vector(3, 0.4).transpose();
    const std::vector<LogProblem> found = arm_log::check_positions(cell, poses);
    REQUIRE(found.size() == 1);
    CHECK(found[0].kind == LogProblemKind::ToolElsewhere);
    CHECK(found[0].remedy == LogRemedy::Check);
    CHECK_THAT(text(found[0], cell), Contains("are joint angles, their order and the cell's tool right?"));
  }
}

}  // namespace tool_checks_test
