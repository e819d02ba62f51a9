#include <kr5/arm_log/joint_unit.hpp>

#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

namespace joint_unit_test {

using namespace kr5;
using arm_log::guess_joint_unit;
using arm_log::JointUnit;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double degree = M_PI / 180;
const VectorXd lower = VectorXd::Constant(2, -110 * degree), upper = VectorXd::Constant(2, 100 * degree);

/// A motion of two joints between -1 and 1.
MatrixXd motion() {
  MatrixXd out(400, 2);
  for (Eigen::Index i = 0; i < out.rows(); ++i)
    out.row(i) << std::sin(0.05 * static_cast<double>(i)), 0.7 * std::cos(0.031 * static_cast<double>(i));
  return out;
}

}  // namespace

TEST_CASE("angles below a turn are radians, larger ones degrees") {
  CHECK(guess_joint_unit(1.9 * motion(), lower, upper).unit == JointUnit::Radian);
  CHECK(guess_joint_unit(160 * motion(), lower, upper).unit == JointUnit::Degree);
  CHECK_FALSE(guess_joint_unit(160 * motion(), lower, upper).degrees_or_percent);
}

TEST_CASE("whole numbers beyond degrees are counts of an encoder") {
  const MatrixXd counts = (2048 + (900 * motion()).array()).round();
  CHECK(guess_joint_unit(counts, lower, upper).unit == JointUnit::Tick);
  CHECK(guess_joint_unit(counts.array() + 0.25, lower, upper).unit == JointUnit::Degree);
  CHECK(guess_joint_unit((150 * motion()).array().abs().round(), lower, upper).unit == JointUnit::Degree);
}

TEST_CASE("numbers within 100 are degrees or per cent, which a rest at 100 or the limits tell") {
  const auto both = guess_joint_unit(80 * motion(), lower, upper);
  CHECK(both.unit == JointUnit::Degree);
  CHECK(both.degrees_or_percent);
  const MatrixXd at_its_end = (130 * motion()).cwiseMin(100.0).cwiseMax(-100.0);
  CHECK(guess_joint_unit(at_its_end, lower, upper).unit == JointUnit::SignedPercent);
  CHECK(guess_joint_unit(at_its_end.cwiseAbs(), lower, upper).unit == JointUnit::Percent);
  const VectorXd narrow = VectorXd::Constant(2, 40 * degree);
  CHECK(guess_joint_unit(80 * motion(), -narrow, narrow).unit == JointUnit::SignedPercent);
}

TEST_CASE("units are told without limits and with rows that lack a number") {
  MatrixXd values = 80 * motion();
  values(3, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK(guess_joint_unit(values, {}, {}).unit == JointUnit::Degree);
  CHECK(guess_joint_unit(MatrixXd::Constant(5, 2, std::nan("")), {}, {}).unit == JointUnit::Radian);
}

TEST_CASE("loads that never change their sign are sizes") {
  CHECK(arm_log::magnitudes_only(motion().cwiseAbs()));
  CHECK_FALSE(arm_log::magnitudes_only(motion()));
  CHECK_FALSE(arm_log::magnitudes_only(motion().cwiseAbs().leftCols(1)));
  MatrixXd one = motion().cwiseAbs();
  one.col(1).setConstant(0.3);
  CHECK_FALSE(arm_log::magnitudes_only(one));
}

}  // namespace joint_unit_test
