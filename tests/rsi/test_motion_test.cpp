#include <kr5/rsi/test_motion.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/rsi/link_diagnosis.hpp>
#include <kr5/rsi/link_session.hpp>

#include "plain_controller.hpp"
#include "wire_messages.hpp"

using namespace kr5;
using namespace kr5::rsi;

namespace test_motion_test {

constexpr double deg = M_PI / 180;

/// An arm that follows corrections of its axes as a first-order lag, times a gain.
struct FollowingArm {
  double gain = 1.0;
  Eigen::VectorXd corrected = Eigen::VectorXd::Zero(6), moved = Eigen::VectorXd::Zero(6), most = moved,
                  commanded = moved;

  robot::RobotReading reading(double time) const {
    robot::RobotReading out;
    out.time = time;
    out.joints = moved.array() + 0.3;
    return out;
  }
  void follow(const robot::RobotCommand& command) {
    if (command.space == robot::CommandSpace::Joints) corrected += command.joints;
    moved += (gain * corrected - moved) * (1 - std::exp(-0.004 / 0.02));
    most = most.cwiseMax(moved.cwiseAbs());
    commanded = commanded.cwiseMax(corrected.cwiseAbs());
  }
};

TelegramLayout layout() { return usual_layout(Controller::Krc4); }

TEST_CASE("each axis goes its way and back, one after the other, and nothing remains") {
  const TestMotionOptions options;
  TestMotion motion(layout(), robot::CommandFrame::Base, options);
  FollowingArm arm;
  std::vector<int> order;
  for (int k = 0; k < 2500; ++k) {
    const robot::RobotCommand command = motion.step(arm.reading(7.0 + 0.004 * k));
    arm.follow(command);
    const auto moving = (arm.corrected.array().abs() > 1e-12).count();
    REQUIRE(moving <= 1);
    Eigen::Index axis = 0;
    if (moving == 1) arm.corrected.cwiseAbs().maxCoeff(&axis);
    if (moving == 1 && (order.empty() || order.back() != axis)) order.push_back(static_cast<int>(axis));
  }
  CHECK(order == std::vector<int>{0, 1, 2, 3, 4, 5});
  CHECK(arm.commanded.isApproxToConstant(options.angle, 1e-3));
  CHECK(arm.corrected.norm() < 1e-12);
  CHECK_FALSE(motion.aborted());
}

TEST_CASE("a motion that goes too far is given up and taken back") {
  const TestMotionOptions options;
  TestMotion motion(layout(), robot::CommandFrame::Base, options);
  FollowingArm arm{.gain = 180 / M_PI};
  for (int k = 0; k < 2500; ++k) arm.follow(motion.step(arm.reading(0.004 * k)));
  CHECK(motion.aborted());
  CHECK(arm.corrected.norm() < 1e-12);
  CHECK(arm.most[0] < 2 * options.abort_ratio * options.angle);  // what the lag adds
  CHECK(arm.most.tail(5).norm() == 0.0);
}

TEST_CASE("after an interruption, a stop or without values of the axes nothing is moved any more") {
  for (const int how : {0, 1, 2}) {
    TestMotion motion(layout(), robot::CommandFrame::Base, {});
    FollowingArm arm;
    for (int k = 0; k < 150; ++k) arm.follow(motion.step(arm.reading(0.004 * k)));
    robot::RobotReading odd = arm.reading(how == 0 ? 1.0 : 0.6);
    if (how == 1) odd.status.stopped = true;
    if (how == 2) odd.joints.resize(0);
    CHECK(motion.step(odd).space == robot::CommandSpace::None);
    CHECK(motion.aborted());
    for (int k = 0; k < 500; ++k) REQUIRE(motion.step(arm.reading(1.0 + 0.004 * k)).space == robot::CommandSpace::None);
  }
}

TEST_CASE("the tool is moved where the layout corrects no axes") {
  TestMotionOptions options;
  TestMotion motion(usual_layout(Controller::Krc4, CorrectionSpace::Cartesian), robot::CommandFrame::Tool, options);
  Vector6 sum = Vector6::Zero(), most = sum;
  robot::RobotReading reading;
  for (int k = 0; k < 2500; ++k) {
    reading.time = 0.004 * k;
    const robot::RobotCommand command = motion.step(reading);
    if (command.space != robot::CommandSpace::Tool) continue;
    REQUIRE((command.mode == robot::CommandMode::Relative && command.frame == robot::CommandFrame::Tool));
    sum += to_vector(command.tool);
    most = most.cwiseMax(sum.cwiseAbs());
  }
  CHECK(most.head(3).isApproxToConstant(options.translation, 1e-3));
  CHECK(most.tail(3).isApproxToConstant(options.angle, 1e-3));
  CHECK(sum.norm() < 1e-9);
}

/// A link whose arm answers corrections by a gain, at rest but for the test.
LinkObservations tested_link(double gain) {
  const TelegramLayout layout = test::wire_layout("krc4_ros_rsi_ethernet.xml");
  TestMotion motion(layout, robot::CommandFrame::Base, {});
  LinkSession session(layout, {}, {}, [&](const robot::RobotReading& r) noexcept { return motion.step(r); });
  LinkObservations out{.port = layout.port};
  std::array<double, 6> axes = test::home, moved{};
  for (int k = 0; k < 2400; ++k) {
    Exchange e{.time = 0.004 * k, .wall_time = 0.004 * k, .sender = "a", .duration = 1e-4};
    for (std::size_t i = 0; i < 6; ++i) axes[i] = test::home[i] + moved[i];
    e.telegram = test::plain_rob(1000 + 4 * static_cast<unsigned>(k), axes);
    e.answer = session.answer(e.telegram, 1, std::int64_t{4'000'000} * k);
    out.duration = e.time;
    for (std::size_t i = 0; i < 6; ++i)
      moved[i] += (gain * test::plain_value(e.answer, "AK", "A" + std::to_string(i + 1)) - moved[i]) * 0.15;
    out.exchanges.push_back(std::move(e));
  }
  return out;
}

TEST_CASE("what a test motion through a link shows is judged") {
  const TelegramLayout layout = test::wire_layout("krc4_ros_rsi_ethernet.xml");
  LinkDiagnosis d = examine_link(tested_link(1.0), layout);
  CHECK((d.motion_compared && d.findings.empty()));
  d = examine_link(tested_link(-1.0), layout);
  REQUIRE(d.findings.size() == 1);
  CHECK((d.findings[0].kind == LinkFindingKind::CorrectionSign && d.findings[0].names.size() == 6));
  d = examine_link(tested_link(180 / M_PI), layout);  // it is given up at the first axis
  REQUIRE(d.findings.size() == 1);
  CHECK(
      (d.findings[0].kind == LinkFindingKind::CorrectionUnit && d.findings[0].names == std::vector<std::string>{"A1"}));
}

TEST_CASE("options of a test motion are checked by their names, and so is the layout") {
  const auto refused = [](auto change, const std::string& field) {
    TestMotionOptions options;
    change(options);
    CHECK_THROWS_WITH(TestMotion(layout(), robot::CommandFrame::Base, options), Catch::StartsWith(field));
  };
  refused([](auto& o) { o.angle = 2 * deg; }, "angle");
  refused([](auto& o) { o.translation = 0.01; }, "translation");
  refused([](auto& o) { o.duration = NAN; }, "duration");
  refused([](auto& o) { o.rest = 0; }, "rest");
  refused([](auto& o) { o.abort_ratio = 1; }, "abort_ratio");
  TelegramLayout mute = layout();
  mute.receive.clear();
  CHECK_THROWS_WITH(TestMotion(mute, robot::CommandFrame::Base, {}), Catch::StartsWith("receive"));
}

}  // namespace test_motion_test
