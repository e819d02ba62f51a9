// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/cell_robot.hpp>

#include <algorithm>
#include <cmath>
#include <deque>
#include <string>
#include <vector>

#include <kr5/cell/sensor_model.hpp>
#include <kr5/core/error.hpp>
#include <kr5/physics/path_correction.hpp>
#include <kr5/robot/sensing.hpp>
#include <kr5/sim/sensors.hpp>

#include "cycle_steps.hpp"
#include "ik_solver.hpp"
#include "joint_lead.hpp"

namespace kr5::sim {
namespace {

using Eigen::VectorXd;

const cell::Cell& commandable(const cell::Cell& cell) {
  require(
      cell.servo && !cell.servo->joint.empty(),
      "servo.joint: this cell has no joint servo, which a robot that is commanded needs; torque servos (servo.torque) "
      "are simulated by the fast grade alone");
  require(!cell.robot.links.empty(), "robot.links: this cell has no masses, which a robot that moves needs");
  return cell;
}

VectorXd start_of(const cell::Cell& cell, const CellRobotOptions& options) {
  const int n = cell.robot.joints();
  require(options.start.size() == 0 || options.start.size() == n,
          "start: expected " + std::to_string(n) + " joint values, or none [rad or m]");
  if (options.start.size() > 0) return options.start;
  if (!cell.robot.limits) return VectorXd::Zero(n);
  return 0.5 * (cell.robot.limits->lower + cell.robot.limits->upper);
}

/// The cell as a controller believes it.
cell::Cell nominal(cell::Cell cell) {
  cell.effects = {};
  return cell;
}

std::uint64_t of_sensor(const CellRobotOptions& options) { return 2 * options.seed + 1; }
std::uint64_t of_encoders(const CellRobotOptions& options) { return 2 * options.seed + 2; }

WristSensorOptions wrist_options(const CellRobotOptions& options) {
  WristSensorOptions out;
  out.noise = options.noise;
  out.seed = of_sensor(options);
  return out;
}

}  // namespace

void CellRobotOptions::validate() const {
  require(!cycle || (*cycle >= 0.001 && *cycle <= 0.1), "cycle: must lie between 1 and 100 ms [s]");
  require(start.allFinite(), "start: must be finite [rad or m]");
  require(braking > 0 && std::isfinite(braking), "braking: must be positive [rad/s^2 or m/s^2]");
}

struct CellRobot::State {
  State(const cell::Cell& real, const CellRobotOptions& options);

  void send(const robot::RobotCommand& command);
  robot::RobotReading read();

  cell::Cell cell;
  double cycle;
  double braking;
  IkSolver ik;
  DrivenArm arm;
  physics::EffectiveDrives believed_drives;
  robot::SensorModel believed;
  std::optional<WristSensor> sensor;
  Encoders encoders;
  CurrentSensors currents;
  double time = 0.0;
  robot::RobotReading told;
  robot::GripperCommand gripper;
  bool stopped = false, reachable = true, braked = false;

  // What the joint servos are told: the ends of the latest cycles, the newest first, each joint with its own delay.
  std::deque<VectorXd> told_joints;
  JointLead lead;

  // The servo of the path, as a motion from where it began: translation and rotation vector in axes of B.
  Pose T_base_begin = Pose::Identity();
  std::vector<physics::PathCorrection> path;

  Vector6 from_begin(const Pose& T_base_tool) const;
  Pose behind_path_servo(const Pose& T_base_tool);
  void begin_path();
  std::optional<VectorXd> asked_joints(const robot::RobotCommand& command);
  std::optional<VectorXd> asked_by_tool(const robot::RobotCommand& command);
  std::optional<VectorXd> posture(const Pose& T_base_tool);
  bool within_limits(const VectorXd& q) const;
  void stand(const VectorXd& q);
  void brake(double step);
  void follow(double from_begin_of_cycle);
  void move();
  void stop_moving();
};

CellRobot::State::State(const cell::Cell& real, const CellRobotOptions& options)
    : cell(commandable(real)),
      cycle(options.cycle.value_or(real.servo->cycle)),
      braking(options.braking),
      ik(real),
      arm(real),
      believed_drives(nominal(real)),
      believed(cell::sensor_model(real)),
      encoders(arm.drives(), 0.0, options.noise ? real.noise.position : 0.0, of_encoders(options)),
      currents(real, options.noise, options.seed),
      lead(*real.servo, cycle) {
  if (real.tool) sensor.emplace(real, wrist_options(options));
  stand(start_of(real, options));
  read();
}

void CellRobot::State::stand(const VectorXd& q) {
  arm.reset(q, time);
  double latest = 0.0;
  for (const cell::SecondOrder& servo : arm.drives().servo) latest = std::max(latest, servo.delay);
  told_joints.assign(static_cast<std::size_t>(std::ceil(latest / cycle)) + 3, q);
  lead.start(q);
  path.clear();
  braked = false;
}

Vector6 CellRobot::State::from_begin(const Pose& T_base_tool) const {
  Vector6 out;
  out << T_base_tool.translation() - T_base_begin.translation(),
      log_rotation(T_base_tool.linear() * T_base_begin.linear().transpose());
  return out;
}

/// The servo begins at rest where the arm was last asked to be.
void CellRobot::State::begin_path() {
  T_base_begin = ik.chain().flange(lead.q()) * believed.T_flange_tool;
  const physics::PathServo of_cell(cell);
  physics::PathServo position = of_cell;
  position.cycle = cycle;
  if (position.correction.per_cycle) *position.correction.per_cycle *= cycle / of_cell.cycle;
  physics::PathServo rotation = position;  // the limits of a file are those of positions
  rotation.correction.per_cycle.reset();
  rotation.correction.total.reset();
  for (int i = 0; i < 6; ++i) path.emplace_back(i < 3 ? position : rotation, 0.0);
}

Pose CellRobot::State::behind_path_servo(const Pose& T_base_tool) {
  const bool relative = cell.servo->correction && cell.servo->correction->mode == cell::CorrectionMode::Relative;
  const Vector6 asked = from_begin(T_base_tool), seen = relative ? from_begin(told.T_base_tool) : Vector6::Zero();
  Vector6 now;
  for (int i = 0; i < 6; ++i) {
    physics::PathCorrection& servo = path[static_cast<std::size_t>(i)];
    servo.advance(asked[i] - seen[i]);
    now[i] = servo.z();
  }
  Pose out = T_base_begin;
  out.translation() += now.head<3>();
  out.linear() = exp_rotation(now.tail<3>()) * T_base_begin.linear();
  return out;
}

bool CellRobot::State::within_limits(const VectorXd& q) const {
  constexpr double rounding = 1e-9;  // [rad or m]
  if (!cell.robot.limits) return true;
  return (q.array() >= cell.robot.limits->lower.array() - rounding).all() &&
         (q.array() <= cell.robot.limits->upper.array() + rounding).all();
}

std::optional<VectorXd> CellRobot::State::asked_joints(const robot::RobotCommand& command) {
  path.clear();
  const bool complete = command.joints.size() == told.joints.size() && command.joints.allFinite();
  const VectorXd q = robot::commanded_joints(command, told.joints);
  if (!complete || !within_limits(q)) return std::nullopt;
  lead.start(q);
  return q;
}

std::optional<VectorXd> CellRobot::State::posture(const Pose& T_base_tool) {
  return ik.posture(T_base_tool * believed.T_flange_tool.inverse(), lead.q());
}

std::optional<VectorXd> CellRobot::State::asked_by_tool(const robot::RobotCommand& command) {
  if (!command.tool.matrix().allFinite() || !is_rotation(command.tool.linear())) return std::nullopt;
  const bool has_servo = cell.servo->tool.has_value();
  if (has_servo && path.empty()) begin_path();
  const Pose T_base_asked = robot::commanded_tool(command, told.T_base_tool);
  std::optional<VectorXd> q = posture(T_base_asked);
  if (!q) return std::nullopt;
  if (!has_servo) return lead.start(*q), q;
  q = posture(behind_path_servo(T_base_asked));
  return q ? std::optional<VectorXd>(lead.next(*q)) : std::nullopt;
}

/// One step of the joint servos; their delay is that of the path where there is one.
void CellRobot::State::follow(double from_begin_of_cycle) {
  VectorXd command = told_joints.front();
  for (Eigen::Index i = 0; i < command.size(); ++i) {
    const double delay = path.empty() ? arm.drives().servo[static_cast<std::size_t>(i)].delay : 0.0;
    const double ends_ago = std::max(1.0 - (from_begin_of_cycle - delay) / cycle, 0.0);
    const auto newer = std::min(static_cast<std::size_t>(ends_ago), told_joints.size() - 2);
    const double share = std::min(ends_ago - static_cast<double>(newer), 1.0);
    command[i] = (1 - share) * told_joints[newer][i] + share * told_joints[newer + 1][i];
  }
  arm.follow(command);
}

void CellRobot::State::brake(double step) {
  const ArmReading& now = arm.read();
  Eigen::MatrixX3d motor(now.position.size(), 3);
  for (Eigen::Index i = 0; i < motor.rows(); ++i) {
    const double x = now.position[i], v = now.velocity[i];
    const double lost = std::min(std::abs(v), braking * step), next = v - std::copysign(lost, v);
    motor.row(i) << x + 0.5 * (v + next) * step, next, (next - v) / step;
  }
  arm.follow_motion(motor);
}

/// Brakes for a cycle; an arm that has come to rest stands there.
void CellRobot::State::stop_moving() {
  braked = true;
  const int steps = divide_cycle(arm, cycle);
  for (int i = 0; i < steps; ++i) brake(cycle / steps);
}

void CellRobot::State::move() {
  const int steps = divide_cycle(arm, cycle);
  for (int i = 1; i <= steps; ++i) follow(i * cycle / steps);
}

void CellRobot::State::send(const robot::RobotCommand& command) {
  gripper = command.gripper;
  stopped = command.stop;
  if (braked && arm.read().velocity.isZero() && !stopped) stand(arm.read().position);
  if (stopped || braked) {  // brakes that have fallen hold until the arm is at rest
    stop_moving();
  } else {
    std::optional<VectorXd> asked;
    if (command.space == robot::CommandSpace::Joints) asked = asked_joints(command);
    if (command.space == robot::CommandSpace::Tool) asked = asked_by_tool(command);
    reachable = asked || command.space == robot::CommandSpace::None;
    told_joints.push_front(asked ? *asked : lead.next(lead.q()));
    told_joints.pop_back();
    move();
  }
  time += cycle;
}

robot::RobotReading CellRobot::State::read() {
  const ArmReading& now = arm.read();
  robot::SensorValues values;
  values.time = time;
  values.joints = robot::joint_vector(encoders.read(now.position));
  const VectorXd current = currents.read(now.current);
  values.currents = robot::joint_vector(current);
  if (current.size() > 0) values.efforts = robot::joint_vector(believed_drives.torques(current));
  if (sensor) values.sensor = sensor->read(now.wrench, time);
  values.status = {stopped, reachable, sensor && sensor->saturated(), gripper.hold};
  return told = robot::robot_reading(believed, values);
}

CellRobot::CellRobot(const cell::Cell& real, const CellRobotOptions& options)
    : state_((options.validate(), std::make_unique<State>(real, options))) {}
CellRobot::~CellRobot() = default;
CellRobot::CellRobot(CellRobot&&) noexcept = default;
CellRobot& CellRobot::operator=(CellRobot&&) noexcept = default;

robot::RobotReading CellRobot::read() { return state_->read(); }
void CellRobot::send(const robot::RobotCommand& command) { state_->send(command); }
double CellRobot::cycle() const { return state_->cycle; }
void CellRobot::set_environment(Environment environment) { state_->arm.set_environment(std::move(environment)); }
const ArmReading& CellRobot::actual() { return state_->arm.read(); }
const robot::GripperCommand& CellRobot::gripper() const { return state_->gripper; }

}  // namespace kr5::sim
