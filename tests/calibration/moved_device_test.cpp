#include <limits>

#include <catch2/catch.hpp>

#include <calibration/arm_world.hpp>
#include <kr5/calibration/moved_device.hpp>
#include <kr5/core/error.hpp>
#include <support/coverage.hpp>
#include <support/rates.hpp>
#include <support/trials.hpp>

namespace moved_device_test {

using namespace kr5;
using namespace kr5::calibration;
using namespace kr5::test;

namespace {

/// A result that knows the true arm.
KinematicsResult true_arm(const ArmWorld& w) {
  KinematicsResult out;
  out.arm = w.arm;
  out.T_world_base = w.T_world_base;
  out.T_flange_tool = w.T_flange_tool;
  out.points = w.tip;
  out.fit.status = FitStatus::Converged;
  return out;
}

void move_from(std::vector<ArmPosture>& postures, std::size_t row, const Eigen::Vector3d& jump) {
  for (std::size_t i = row; i < postures.size(); ++i)
    if (postures[i].T_world_tool)
      postures[i].T_world_tool->translation() += jump;
    else
      postures[i].points.colwise() += jump;
}

}  // namespace

TEST_CASE("a device that stays is not said to have moved, few postures or many, with outliers") {
  Random random(1);
  const int all = trials(4000, 600);
  int found = 0;
  for (int trial = 0; trial < all; ++trial) {
    ArmWorld w = make_arm_world({.seed = static_cast<unsigned>(trial + 1),
                                 .postures = trial % 3 == 0   ? 12
                                             : trial % 3 == 1 ? 30
                                                              : 80,
                                 .poses = trial % 2 == 0});
    if (trial % 5 == 0) move_from(w.postures, w.postures.size() - 1, 0.01 * random.direction());
    found += find_moved_device(true_arm(w), w.postures).has_value();
  }
  check_rare(found, all, 0.005, 0.015);
}

TEST_CASE("a device that moved is found with row, jump and its uncertainty, beside rows without a place") {
  Random random(2);
  Coverage coverage("jump of a device", 3);
  const int all = trials(1000, 250);
  int right = 0;
  for (int trial = 0; trial < all; ++trial) {
    ArmWorld w = make_arm_world({.seed = static_cast<unsigned>(trial + 1), .poses = trial % 2 == 0});
    const auto row = static_cast<std::size_t>(6 + random.integer(50));
    const Eigen::Vector3d jump = 0.001 * random.direction();
    move_from(w.postures, row, jump);
    w.postures[2].points.setConstant(3, 1, std::numeric_limits<double>::quiet_NaN());
    w.postures[2].T_world_tool.reset();
    const auto found = find_moved_device(true_arm(w), w.postures);
    REQUIRE(found);
    right += found->row == static_cast<int>(row);
    CHECK(found->chi_square > 60);
    coverage.add(found->jump - jump, found->std.cwiseAbs2().asDiagonal());
  }
  check_rate(right, all, 0.99, 0.96);
  coverage.check_rate();
}

TEST_CASE("a calibration that a jump disturbed shows it") {
  ArmWorld w = make_arm_world({.seed = 3});
  move_from(w.postures, 33, {0.002, -0.001, 0.0});
  const auto found = find_moved_device(calibrate_kinematics(w.nominal, w.postures), w.postures);
  REQUIRE(found);
  CHECK(std::abs(found->row - 33) <= 1);
  CHECK(found->jump.norm() > 5e-4);
}

TEST_CASE("compliances that were estimated take the torques") {
  ArmWorld w = make_arm_world({.seed = 4});
  KinematicsResult result = true_arm(w);
  result.compliances = Eigen::VectorXd::Constant(6, 1e-3);
  for (ArmPosture& p : w.postures) {
    p.torques = Eigen::VectorXd::Constant(6, 2.0);
    p.q.array() += 2e-3;
  }
  CHECK_FALSE(find_moved_device(result, w.postures));
  w.postures[1].torques.resize(0);
  CHECK_THROWS_AS(find_moved_device(result, w.postures), InvalidArgument);
}

TEST_CASE("too few places tell nothing; NaN and another arm are refused") {
  ArmWorld w = make_arm_world({.seed = 5, .postures = 11});
  const KinematicsResult result = true_arm(w);
  move_from(w.postures, 6, {0.1, 0, 0});
  CHECK_FALSE(find_moved_device(result, w.postures));
  CHECK_FALSE(find_moved_device(result, {}));
  CHECK_THROWS_AS(find_moved_device(result, w.postures, 0.0), InvalidArgument);
  w.postures[3].q[0] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(find_moved_device(result, w.postures), InvalidArgument);
  w.postures[3].q.resize(4);
  CHECK_THROWS_AS(find_moved_device(result, w.postures), InvalidArgument);
  ArmWorld other = make_arm_world({.seed = 5});
  KinematicsResult no_points = true_arm(other);
  no_points.points.resize(3, 0);
  CHECK_THROWS_AS(find_moved_device(no_points, other.postures), InvalidArgument);
  for (ArmPosture& p : other.postures) p.points = Eigen::Vector3d(w.T_world_base.translation());  // all at one place
  CHECK_NOTHROW(find_moved_device(true_arm(other), other.postures));
}

}  // namespace moved_device_test
