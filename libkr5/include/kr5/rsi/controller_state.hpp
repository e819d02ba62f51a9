// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <kr5/robot/command.hpp>
#include <kr5/robot/sensing.hpp>
#include <kr5/rsi/telegram.hpp>

/// @file
/// What telegrams mean, in SI: the state that a controller tells, the corrections that it is told. Copying them
/// allocates nothing and throws nothing; what a layout does not hold is empty.

namespace kr5::rsi {

/// $PRO_STATE of a program that runs.
inline constexpr double program_active = 3;

/// Of one cycle. Joints are the six axes and behind them the external ones.
struct ControllerState {
  std::optional<Pose> tool = {};              ///< The active tool in the active base, as measured [m].
  std::optional<Pose> tool_setpoint = {};     ///< The same of the programmed path, without corrections.
  robot::JointVector joints = {};             ///< As measured [rad or m].
  robot::JointVector joint_setpoints = {};    ///< Of the programmed path, without corrections.
  robot::JointVector efforts = {};            ///< At the gears [N m].
  robot::JointVector currents = {};           ///< [A]
  std::optional<Vector6> sensor = {};         ///< Of the force/torque sensor, in its own axes [N, N m].
  std::optional<double> late_packets = {};    ///< Answers that the controller counted as late [-].
  std::optional<double> program_state = {};   ///< $PRO_STATE.
  std::optional<double> override_share = {};  ///< $OV_PRO, 1: full speed [-].
  std::uint32_t digital_inputs = 0;           ///< Bits.
  std::optional<bool> gripped = {};           ///< By the bit of the gripper.
};

/// What the path is corrected by, in the mode of the controller's program: all of it (absolute) or what is added in one
/// cycle (relative).
struct Correction {
  robot::JointVector joints = {};  ///< [rad or m]
  std::optional<Pose> tool = {};   ///< Translation and rotation, in the axes of the correction [m].
  robot::GripperCommand gripper = {};
  bool stop_move = false;  ///< Leave RSI_MOVECORR: the program ends, and the arm stands.
};

/// Meanings of the values of both telegrams of a layout. Once made, it allocates nothing and throws nothing.
class TelegramUnits {
 public:
  /// @throws InvalidArgument as TelegramLayout::validate.
  explicit TelegramUnits(const TelegramLayout& layout);

  /// The computer's side: what the controller tells.
  ControllerState state(const Telegram& telegram) const noexcept;
  /// Sets the values of a correction, and 0 for all others; text and IPOC stay.
  void set_correction(const Correction& correction, Telegram& telegram) const noexcept;

  /// The controller's side: what it is told. Values that are not present are 0.
  Correction correction(const Telegram& telegram) const noexcept;
  /// Sets the values of a state; what the layout holds besides stays.
  void set_state(const ControllerState& state, Telegram& telegram) const noexcept;

  /// Joints of the robot, external ones included.
  int joints() const noexcept { return 6 + externals_; }
  bool corrects_joints() const noexcept { return receive_.has(Meaning::AxisCorrection); }
  bool corrects_tool() const noexcept { return receive_.has(Meaning::CartesianCorrection); }

 private:
  /// Where the components of each meaning stand among the values; -1: nowhere.
  struct Places {
    static constexpr std::size_t meanings = 32, components = 12;
    std::array<std::array<int, components>, meanings> place;

    explicit Places(const std::vector<TelegramField>& fields);
    int of(Meaning meaning, int component = 0) const noexcept {
      return place[static_cast<std::size_t>(meaning)][static_cast<std::size_t>(component)];
    }
    bool has(Meaning meaning) const noexcept;
  };

  std::optional<double> value(const Places& in, const Telegram& t, Meaning meaning, int component = 0) const noexcept;
  std::optional<Pose> pose(const Places& in, const Telegram& t, Meaning meaning) const noexcept;
  /// What the values of axes are: places, which have a zero, or differences of them.
  enum class Counting { Place, Difference };
  robot::JointVector joint_values(const Places& in, const Telegram& t, Meaning axes, Meaning externals,
                                  Counting counting) const noexcept;
  double joint_of(int joint, double axis, Counting counting) const noexcept;
  double axis_of(int joint, double value, Counting counting) const noexcept;
  robot::JointVector motor_currents(const Telegram& t) const noexcept;
  void put(const Places& in, Telegram& t, Meaning meaning, int component, double value) const noexcept;
  void put_pose(const Places& in, Telegram& t, Meaning meaning, const Pose& T) const noexcept;
  void put_joints(const Places& in, Telegram& t, Meaning axes, Meaning externals, const robot::JointVector& values,
                  Counting counting) const noexcept;
  double sign(int joint) const noexcept { return signs_[static_cast<std::size_t>(joint)]; }
  double unit(int joint) const noexcept { return units_[static_cast<std::size_t>(joint)]; }

  Places send_, receive_;
  int externals_ = 0;
  std::array<double, 12> units_{};          ///< Of the joints [rad or m].
  std::array<double, 12> signs_{};          ///< Of the controller's axes [-].
  std::array<double, 12> zeros_{};          ///< Joint values at their zeros [rad or m].
  std::array<double, 12> current_units_{};  ///< [A]
  bool counts_otherwise_ = false;           ///< The controller's axes are not the joints.
  bool reads_currents_ = false;
  GripperBits gripper_;
};

/// The reading of a state: poses by the joints where the model has an arm of as many, else by the controller's own
/// pose, whose active base must be the robot's and whose active tool that of the model; else they are no numbers, for
/// which a controller stops. A gripper that tells nothing is believed to hold; a program that is not active, the robot
/// to stand.
/// @param time [s].
robot::RobotReading robot_reading(const ControllerState& state, const robot::SensorModel& model, double time) noexcept;

}  // namespace kr5::rsi
