#include <kr5/robot/command.hpp>

#include <limits>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

namespace command_test {

using namespace kr5;
using namespace kr5::robot;

namespace {

Pose pose(double x, double y, double z, double rx, double ry, double rz) {
  return to_pose((Vector6() << x, y, z, rx, ry, rz).finished());
}

const Pose here = pose(0.5, -0.1, 0.3, 0.4, 1.2, -0.7);

}  // namespace

TEST_CASE("a pose is taken as it is, a motion in the axes it is given in, about the tool tip") {
  const Pose motion = pose(0.01, 0.02, -0.03, 0.1, -0.2, 0.05);
  CHECK(commanded_tool(tool_command(motion), here).matrix() == motion.matrix());
  CHECK(commanded_tool(tool_motion(motion, CommandFrame::Tool), here).isApprox(here * motion, 1e-14));
  const Pose in_base = commanded_tool(tool_motion(motion, CommandFrame::Base), here);
  CHECK((in_base.translation() - here.translation() - motion.translation()).norm() < 1e-15);
  CHECK(in_base.linear().isApprox(motion.linear() * here.linear(), 1e-14));
}

TEST_CASE("a limit shortens a motion and leaves its direction") {
  RobotCommand command = tool_command(here * pose(0.0, 0.0, 0.05, 0.0, 0.3, 0.0));
  command.limits.translation = 0.01;
  const Pose first = commanded_tool(command, here);
  CHECK((first.translation() - here.translation()).norm() == Approx(0.01));
  CHECK((here.inverse() * first).translation().isApprox(Eigen::Vector3d(0, 0, 0.01), 1e-12));
  CHECK(first.linear().isApprox(command.tool.linear(), 1e-12));
  command.limits.rotation = 0.1;
  CHECK(log_rotation(here.linear().transpose() * commanded_tool(command, here).linear())
            .isApprox(Eigen::Vector3d(0, 0.1, 0), 1e-9));
  Pose now = here;
  for (int k = 0; k < 5; ++k) now = commanded_tool(command, now);
  CHECK(now.isApprox(command.tool, 1e-12));  // five steps of a centimetre
  RobotCommand joints;
  joints.space = CommandSpace::Joints;
  joints.joints = Eigen::Vector3d(0.5, -0.5, 0.01);
  joints.limits.joint = 0.1;
  const JointVector at = Eigen::Vector3d(0, 0, 0);
  CHECK(commanded_joints(joints, at).isApprox(Eigen::Vector3d(0.1, -0.1, 0.01)));
  joints.mode = CommandMode::Relative;
  CHECK(commanded_joints(joints, Eigen::Vector3d(1, 1, 1)).isApprox(Eigen::Vector3d(1.1, 0.9, 1.01)));
}

TEST_CASE("nothing moves for a stop, for another target, or for what is no number") {
  RobotCommand command = tool_command(Pose::Identity());
  command.stop = true;
  CHECK(commanded_tool(command, here).matrix() == here.matrix());
  CHECK(commanded_tool(RobotCommand{}, here).matrix() == here.matrix());
  command = tool_command(Pose::Identity());
  command.tool.translation().x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(commanded_tool(command, here).matrix() == here.matrix());
  const JointVector at = Eigen::Vector2d(0.3, 0.4);
  CHECK(commanded_joints(tool_command(here), at) == at);
  command = {};
  command.space = CommandSpace::Joints;
  command.joints = Eigen::Vector3d(1, 1, 1);  // of another robot
  CHECK(commanded_joints(command, at) == at);
  command.joints = Eigen::Vector2d(1, std::numeric_limits<double>::infinity());
  CHECK(commanded_joints(command, at) == at);
}

TEST_CASE("negative limits, and more joints than a robot may have, are refused") {
  CHECK_THROWS_WITH((CommandLimits{.rotation = -1.0}.validate()), Catch::Contains("rotation"));
  CHECK_THROWS_AS(joint_vector(Eigen::VectorXd::Zero(max_joints + 1)), InvalidArgument);
  CHECK(joint_vector(Eigen::VectorXd::Ones(max_joints)).size() == max_joints);
}

}  // namespace command_test
