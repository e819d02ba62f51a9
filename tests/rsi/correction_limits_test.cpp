#include <kr5/rsi/correction_limits.hpp>

#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

using namespace kr5;
using namespace kr5::rsi;
using robot::CommandFrame;
using robot::CommandMode;
using robot::CommandSpace;
using robot::JointVector;
using robot::RobotCommand;

namespace correction_limits_test {

constexpr double cycle = 0.012;

RobotCommand joints_command(const JointVector& values, CommandMode mode = CommandMode::Absolute) {
  RobotCommand out;
  out.space = CommandSpace::Joints;
  out.mode = mode;
  out.joints = values;
  return out;
}

ControllerState standing() {
  ControllerState out;
  out.joints = JointVector::Constant(6, 0.3);
  out.tool = to_pose((Vector6() << 0.5, 0.1, 0.7, 0.2, 2.0, -1.0).finished());
  return out;
}

/// What a controller makes of corrections, by the rules of its modes.
class Path {
 public:
  Path(CommandMode mode, CommandFrame frame, const ControllerState& start) : mode_(mode), frame_(frame), start_(start) {
    joints = start.joints;
    tool = *start.tool;
  }
  void apply(const Correction& c) {
    const bool relative = mode_ == CommandMode::Relative;
    if (c.joints.size()) joints = (relative ? joints : start_.joints) + c.joints;
    if (!c.tool) return;
    const Pose from = relative ? tool : *start_.tool;
    if (frame_ == CommandFrame::Tool) {
      tool = from * *c.tool;
    } else {
      tool.translation() = from.translation() + c.tool->translation();
      tool.linear() = c.tool->linear() * from.linear();
    }
  }
  JointVector joints;
  Pose tool;

 private:
  CommandMode mode_;
  CommandFrame frame_;
  ControllerState start_;
};

TEST_CASE("commands bring the path where they say, in either mode and frame, with and without setpoints") {
  for (const CommandMode mode : {CommandMode::Absolute, CommandMode::Relative})
    for (const CommandFrame frame : {CommandFrame::Base, CommandFrame::Tool})
      for (const bool setpoints : {true, false}) {
        ControllerState state = standing();
        if (setpoints) {
          state.joint_setpoints = state.joints;
          state.tool_setpoint = state.tool;
        }
        const TelegramLayout layout = book_layout();
        PathCorrection correction(layout, {}, mode, frame, cycle);
        correction.begin(state, state);
        Path path(mode, frame, state);
        const JointVector goal = state.joints + JointVector::LinSpaced(6, -0.05, 0.05);
        for (int k = 0; k < 200; ++k) path.apply(correction.step(joints_command(goal), state));
        CHECK((path.joints - goal).norm() < 1e-9);
        CHECK(correction.outcome() == CommandOutcome::Followed);
        Pose wanted = *state.tool * to_pose((Vector6() << 1e-3, -2e-3, 3e-3, 0.03, -0.02, 0.01).finished());
        for (int k = 0; k < 200; ++k) path.apply(correction.step(robot::tool_command(wanted), state));
        CHECK((path.tool.matrix() - wanted.matrix()).norm() < 1e-9);
        CHECK((path.joints - goal).norm() < 1e-9);
        const Pose before = path.tool;
        const Pose motion(Eigen::Translation3d(2e-4, 0, 0));
        path.apply(correction.step(robot::tool_motion(motion, CommandFrame::Tool), state));
        path.apply(correction.hold());
        CHECK((path.tool.translation() - (before * motion).translation()).norm() < 2e-4);
      }
}

TEST_CASE("a tool whose orientation is free turns all the way round, and further") {
  CorrectionLimits limits;
  limits.rotation = {3.0, 30.0, M_PI};
  for (const CommandFrame frame : {CommandFrame::Base, CommandFrame::Tool}) {
    const ControllerState state = standing();
    PathCorrection correction(usual_layout(Controller::Krc4, CorrectionSpace::Cartesian), limits, CommandMode::Absolute,
                              frame, cycle);
    correction.begin(state, state);
    Path path(CommandMode::Absolute, frame, state);
    const Eigen::Vector3d axis = Eigen::Vector3d(1, -2, 2) / 3.0;
    Eigen::Matrix3d before = path.tool.linear();
    for (int k = 1; k <= 1200; ++k) {  // to seven rad, within the limits from the start
      const double share = k / 1200.0, angle = 7.0 * share * share * (3 - 2 * share);
      Pose wanted = *state.tool;
      wanted.linear() = Eigen::AngleAxisd(angle, axis) * state.tool->linear();
      path.apply(correction.step(robot::tool_command(wanted), state));
      REQUIRE((path.tool.matrix() - wanted.matrix()).norm() < 1e-9);
      REQUIRE(correction.outcome() == CommandOutcome::Followed);
      REQUIRE(log_rotation(path.tool.linear() * before.transpose()).norm() < 1.5 * 7.0 / 1200 + 1e-9);
      before = path.tool.linear();
    }
  }
}

TEST_CASE("a jump of a free orientation is followed within speed and acceleration, and a stop slows it down") {
  CorrectionLimits limits;
  limits.rotation = {0.5, 5.0, M_PI};
  const ControllerState state = standing();
  PathCorrection correction(usual_layout(Controller::Krc4, CorrectionSpace::Cartesian), limits, CommandMode::Absolute,
                            CommandFrame::Base, cycle);
  correction.begin(state, state);
  Path path(CommandMode::Absolute, CommandFrame::Base, state);
  Pose wanted = *state.tool;
  wanted.linear() = Eigen::AngleAxisd(2.8, Eigen::Vector3d(2, 1, -2) / 3.0) * state.tool->linear();
  Eigen::Matrix3d before = path.tool.linear();
  Eigen::Vector3d speed = Eigen::Vector3d::Zero();
  for (int k = 0; k < 1000; ++k) {
    path.apply(k == 100 ? correction.hold() : correction.step(robot::tool_command(wanted), state));
    const Eigen::Vector3d now = log_rotation(path.tool.linear() * before.transpose()) / cycle;
    REQUIRE(now.cwiseAbs().maxCoeff() <= 0.5 + 1e-6);
    REQUIRE((now - speed).cwiseAbs().maxCoeff() <= 5.0 * cycle + 1e-6);
    before = path.tool.linear();
    speed = now;
  }
  CHECK((path.tool.linear() - wanted.linear()).norm() < 1e-6);
}

TEST_CASE("the limits of every joint and of the pose hold for random commands") {
  Random random(6);
  CorrectionLimits limits;
  limits.axes.assign(6, limits.axis);
  limits.axes[2] = {0.01, 0.5, 0.002};
  for (const CommandMode mode : {CommandMode::Absolute, CommandMode::Relative}) {
    const ControllerState state = standing();
    PathCorrection correction(book_layout(), limits, mode, CommandFrame::Base, cycle);
    correction.begin(state, state);
    Path path(mode, CommandFrame::Base, state);
    JointVector q = state.joints, qd = JointVector::Zero(6);
    Vector6 x = Vector6::Zero(), xd = Vector6::Zero();
    for (int k = 0; k < 20000; ++k) {
      RobotCommand command;
      command.space = static_cast<CommandSpace>(random.integer(3));
      command.mode = static_cast<CommandMode>(random.integer(2));
      command.frame = static_cast<CommandFrame>(random.integer(2));
      command.stop = random.integer(10) == 0;
      const double size = std::pow(10, random.uniform(-5, 1));
      command.joints = random.normal_vector(random.integer(20) ? 6 : 3, size);
      if (random.integer(30) == 0) command.joints[0] = NAN;
      if (random.integer(2) == 0 && command.joints.size() == 6) command.joints += state.joints;
      command.tool = to_pose(random.normal_vector(6, size));
      if (random.integer(30) == 0) command.tool(0, 0) = NAN;
      if (random.integer(2) == 0) command.tool = *state.tool * command.tool;
      path.apply(correction.step(command, state));
      REQUIRE((path.joints.allFinite() && path.tool.matrix().allFinite()));
      const JointVector speed = (path.joints - q) / cycle;
      for (int i = 0; i < 6; ++i) {
        const MotionLimits& of = limits.axes[static_cast<std::size_t>(i)];
        REQUIRE(std::abs(path.joints[i] - state.joints[i]) < of.total + 1e-9);
        REQUIRE(std::abs(speed[i]) < of.speed + 1e-9);
        REQUIRE(std::abs(speed[i] - qd[i]) < of.acceleration * cycle + 1e-9);
      }
      Vector6 now;
      now << path.tool.translation() - state.tool->translation(),
          log_rotation(path.tool.linear() * state.tool->linear().transpose());
      const Vector6 rate = (now - x) / cycle;
      for (int i = 0; i < 6; ++i) {
        const MotionLimits& of = i < 3 ? limits.translation : limits.rotation;
        REQUIRE(std::abs(now[i]) < of.total + 1e-9);
        REQUIRE(std::abs(rate[i]) < of.speed + 1e-8);
        REQUIRE(std::abs(rate[i] - xd[i]) < of.acceleration * cycle + 1e-8);
      }
      q = path.joints, qd = speed, x = now, xd = rate;
    }
    CHECK((correction.joints() - (q - state.joints)).norm() < 1e-9);
    CHECK((correction.tool() - x).norm() < 1e-9);
  }
}

TEST_CASE("a session begins with the correction that the controller makes already") {
  ControllerState state = standing();
  state.joint_setpoints = state.joints - JointVector::LinSpaced(6, -0.02, 0.03);
  state.tool_setpoint = *state.tool * to_pose((Vector6() << 1e-3, 2e-3, 0, 0.01, 0, 0).finished()).inverse();
  for (const CommandMode mode : {CommandMode::Absolute, CommandMode::Relative}) {
    const bool absolute = mode == CommandMode::Absolute;
    PathCorrection axes(usual_layout(Controller::Krc4), {}, mode, CommandFrame::Base, cycle);
    axes.begin(state, state);
    CHECK((axes.hold().joints - (absolute ? 1.0 : 0.0) * (state.joints - state.joint_setpoints)).norm() < 1e-12);
    axes.step(joints_command(state.joints), state);  // where it is
    CHECK(axes.outcome() == CommandOutcome::Followed);
    CHECK((axes.joints() - (state.joints - state.joint_setpoints)).norm() < 1e-12);
    PathCorrection tool(usual_layout(Controller::Krc4, CorrectionSpace::Cartesian), {}, mode, CommandFrame::Tool,
                        cycle);
    tool.begin(state, state);
    const Pose first = *tool.hold().tool;
    CHECK((first.matrix() - (absolute ? state.tool_setpoint->inverse() * *state.tool : Pose::Identity()).matrix())
              .norm() < 1e-12);
  }
  ControllerState before = state;  // on a moving path what is between setpoints and arm is the lag of its servos
  before.joint_setpoints.array() -= 1e-4;
  before.tool_setpoint->translation().x() -= 1e-4;
  for (const CorrectionSpace space : {CorrectionSpace::Axes, CorrectionSpace::Cartesian}) {
    PathCorrection moving(usual_layout(Controller::Krc4, space), {}, CommandMode::Absolute, CommandFrame::Tool, cycle);
    CHECK_FALSE(moving.is_told_by(state));
    moving.begin(before, state);
    CHECK((moving.joints().isZero() && moving.tool().isZero()));
    ControllerState at_setpoint = state;
    at_setpoint.joints = state.joint_setpoints;
    at_setpoint.tool = state.tool_setpoint;
    CHECK(moving.is_told_by(at_setpoint));
  }
  PathCorrection both(book_layout(), {}, CommandMode::Absolute, CommandFrame::Base, cycle);
  both.begin(state, state);
  CHECK((both.joints().isZero() && both.tool().isZero()));
  state.joint_setpoints.resize(0);
  PathCorrection untold(usual_layout(Controller::Krc4), {}, CommandMode::Absolute, CommandFrame::Base, cycle);
  untold.begin(state, state);
  CHECK(untold.joints().isZero());
}

TEST_CASE("limits of a command hold besides") {
  const ControllerState state = standing();
  PathCorrection correction(book_layout(), {}, CommandMode::Absolute, CommandFrame::Base, cycle);
  correction.begin(state, state);
  RobotCommand slow = joints_command(state.joints + JointVector::Constant(6, 0.05));
  slow.limits.joint = 1e-5;
  for (int k = 1; k < 50; ++k) CHECK(correction.step(slow, state).joints[0] < 1e-5 * k + 1e-12);
  CHECK(correction.joints()[0] > 1e-4);
}

TEST_CASE("what a layout cannot correct is refused, and braked for") {
  const ControllerState state = standing();
  PathCorrection axes(usual_layout(Controller::Krc4), {}, CommandMode::Absolute, CommandFrame::Base, cycle);
  axes.begin(state, state);
  CHECK_FALSE(axes.step(robot::tool_command(*state.tool), state).tool);
  CHECK(axes.outcome() == CommandOutcome::Refused);
  axes.step(joints_command(JointVector::Zero(5)), state);
  CHECK(axes.outcome() == CommandOutcome::Refused);
  axes.step(joints_command(JointVector::Constant(6, NAN)), state);
  CHECK(axes.outcome() == CommandOutcome::Refused);
  axes.step(joints_command(state.joints + JointVector::Constant(6, 1.0)), state);
  CHECK(axes.outcome() == CommandOutcome::Limited);
  axes.step({}, state);
  CHECK(axes.outcome() == CommandOutcome::Braked);
  PathCorrection blind(usual_layout(Controller::Krc4), {}, CommandMode::Absolute, CommandFrame::Base, cycle);
  blind.begin({}, {});  // a controller that tells no joints
  blind.step(joints_command(JointVector::Zero(6)), {});
  CHECK(blind.outcome() == CommandOutcome::Refused);
  RobotCommand bent = robot::tool_command(Pose(Eigen::Translation3d(0.5, 0.1, 0.7)));
  bent.tool.linear() *= 1.1;
  PathCorrection cartesian(book_layout(), {}, CommandMode::Absolute, CommandFrame::Base, cycle);
  cartesian.begin(state, state);
  cartesian.step(bent, state);
  CHECK(cartesian.outcome() == CommandOutcome::Refused);
}

TEST_CASE("the gripper is passed on, and kept while there is no command") {
  const ControllerState state = standing();
  PathCorrection correction(book_layout(), {}, CommandMode::Absolute, CommandFrame::Base, cycle);
  correction.begin(state, state);
  RobotCommand open;
  open.gripper = {.hold = false, .air = true};
  CHECK_FALSE(correction.step(open, state).gripper.hold);
  CHECK((!correction.hold().gripper.hold && correction.hold().gripper.air));
}

TEST_CASE("limits are checked by their names") {
  const auto refused = [](auto change, const std::string& field) {
    CorrectionLimits limits;
    change(limits);
    CHECK_THROWS_WITH(PathCorrection(book_layout(), limits, CommandMode::Absolute, CommandFrame::Base, cycle),
                      Catch::StartsWith(field));
  };
  refused([](auto& l) { l.axis.speed = 0; }, "axis.speed");
  refused([](auto& l) { l.axes.resize(3); }, "axes");
  refused([](auto& l) { l.translation.acceleration = NAN; }, "translation.acceleration");
  refused([](auto& l) { l.rotation.total = 2; }, "rotation.total");
}

}  // namespace correction_limits_test
