#include <kr5/rsi/correction_total.hpp>

#include <catch2/catch.hpp>

#include "emulated_arm.hpp"

using namespace kr5;
using namespace kr5::rsi;
using kr5::test::deg;

namespace correction_total_test {

constexpr auto absolute = robot::CommandMode::Absolute;
constexpr auto relative = robot::CommandMode::Relative;

Correction axis(int number, double value) {
  Correction out;
  out.joints = robot::JointVector::Zero(6);
  out.joints[number - 1] = value;
  return out;
}

Correction tool(const Vector6& value) {
  Correction out;
  out.tool = to_pose(value);
  return out;
}

TEST_CASE("absolute corrections replace each other, relative ones add up") {
  CorrectionTotal whole({}, absolute, robot::CommandFrame::Base, 6), sum({}, relative, robot::CommandFrame::Base, 6);
  for (int i = 0; i < 3; ++i) {
    REQUIRE_FALSE(whole.take(axis(2, 1 * deg)));
    REQUIRE_FALSE(sum.take(axis(2, 1 * deg)));
  }
  CHECK(whole.joints()[1] == Approx(1 * deg));
  CHECK(sum.joints()[1] == Approx(3 * deg));
  whole.take(axis(2, 0));
  sum.take(axis(2, 0));
  CHECK(whole.joints()[1] == 0.0);
  CHECK(sum.joints()[1] == Approx(3 * deg));
}

TEST_CASE("relative motions of the tool add up in the axes of the program") {
  ControllerRules wide;
  wide.rotation_limit = 2.0;
  wide.translation_limit = 1.0;
  for (const auto frame : {robot::CommandFrame::Base, robot::CommandFrame::Tool}) {
    CorrectionTotal sum(wide, relative, frame, 6);
    REQUIRE_FALSE(sum.take(tool((Vector6() << 0, 0, 0, 0, 0, M_PI_2).finished())));  // X of the tool is Y now
    REQUIRE_FALSE(sum.take(tool((Vector6() << 0.01, 0, 0, 0, 0, 0).finished())));
    const Eigen::Vector3d at = sum.corrected(Pose::Identity()).translation();
    const bool in_tool = frame == robot::CommandFrame::Tool;
    CHECK((at - Eigen::Vector3d(in_tool ? 0 : 0.01, in_tool ? 0.01 : 0, 0)).norm() < 1e-12);
  }
}

TEST_CASE("a total at its limit passes, beyond it stops, and stays what it was") {
  CorrectionTotal total({}, absolute, robot::CommandFrame::Base, 6);
  CHECK_FALSE(total.take(axis(3, 0.0873)));
  const ProgramStop stop = total.take(axis(3, -0.0874));
  CHECK((stop.reason == ProgramStopReason::AxisLimit && stop.axis == 3));
  CHECK(total.joints()[2] == Approx(0.0873));
  CHECK_FALSE(total.take(tool((Vector6() << 0.005, -0.005, 0.005, 0, 0, 0.0873).finished())));
  CHECK(total.take(tool((Vector6() << 0, 0, 0.0051, 0, 0, 0).finished())).reason ==
        ProgramStopReason::TranslationLimit);
  CHECK(total.take(tool((Vector6() << 0, 0, 0, 0.07, 0.07, 0).finished())).reason == ProgramStopReason::RotationLimit);
}

TEST_CASE("relative corrections of which each is small stop when their total is beyond the limit") {
  CorrectionTotal total({}, relative, robot::CommandFrame::Base, 6);
  for (int i = 0; i < 87; ++i) REQUIRE_FALSE(total.take(axis(1, 0.001)));
  CHECK(total.take(axis(1, 0.001)).reason == ProgramStopReason::AxisLimit);
}

TEST_CASE("a controller that holds a correction at its limit says so") {
  ControllerRules rules;
  rules.at_limit = LimitAction::Hold;
  CorrectionTotal total(rules, absolute, robot::CommandFrame::Base, 6);
  CHECK_FALSE(total.take(axis(1, 1.0)));
  CHECK((total.joints()[0] == Approx(0.0873) && total.limited()));
  CHECK_FALSE(total.take(tool((Vector6() << 0.1, 0.001, 0, 0, 1.0, 0).finished())));
  const Vector6 held = to_vector(total.tool());
  CHECK((held[0] == Approx(0.005) && held[1] == Approx(0.001) && held[4] == Approx(0.0873) && total.limited()));
  CHECK_FALSE(total.take(axis(1, 0.01)));
}

TEST_CASE("a change in one cycle has a limit of its own") {
  ControllerRules rules;
  rules.axis_per_cycle = 0.01;
  rules.translation_per_cycle = 0.001;
  rules.rotation_per_cycle = 0.01;
  CorrectionTotal total(rules, absolute, robot::CommandFrame::Base, 6);
  CHECK_FALSE(total.take(axis(1, 0.01)));
  const ProgramStop stop = total.take(axis(1, -0.0101));
  CHECK((stop.reason == ProgramStopReason::CycleLimit && stop.axis == 1));
  CHECK_FALSE(total.take(axis(1, 0.0)));
  CHECK_FALSE(total.take(tool((Vector6() << 0.001, 0, 0, 0, 0, 0).finished())));
  CHECK(total.take(tool((Vector6() << 0.0021, 0, 0, 0, 0, 0).finished())).reason == ProgramStopReason::CycleLimit);
  CHECK(total.take(tool((Vector6() << 0.001, 0, 0, 0, 0.0101, 0).finished())).reason == ProgramStopReason::CycleLimit);
}

}  // namespace correction_total_test
