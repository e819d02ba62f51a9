// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include <kr5/force/insertion.hpp>
#include <kr5/physics/path_correction.hpp>
#include <kr5/robot/robot.hpp>
#include <kr5/robot/sensing.hpp>
#include <kr5/sim/driven_arm.hpp>
#include <kr5/sim/insertion.hpp>
#include <kr5/sim/sensors.hpp>

#include "arm_wander.hpp"
#include "held_peg.hpp"
#include "ik_solver.hpp"
#include "joint_lead.hpp"

namespace kr5::sim {

/// The grip as the cell believes it.
force::GripModel believed_grip(const cell::Cell& cell, const InsertionSetup& setup);

/// The arm of a cell with a peg in its grip, cycle by cycle: path corrections with their servo and delay, joints with
/// theirs, gears, links, encoders, the wrist sensor. T is where the tube is believed.
class InsertionArm : public robot::Robot {
 public:
  InsertionArm(const cell::Cell& real, const InsertionSetup& setup);

  /// Holds the peg there at rest, if the arm can take that place and tilts of `tilt` all round below it.
  bool start(const Pose& T_tube_peg, double tilt);
  /// A new peg in the grip: where it sits in it, and how far the arm is off, are drawn anew.
  void regrip();
  /// Moves for a cycle.
  void send(const robot::RobotCommand& command) override;
  /// The peg sits in the grip, whatever was before.
  void hold_peg();
  robot::RobotReading read() override;

  const HeldPeg& peg() const { return peg_; }
  HeldPeg& peg() { return peg_; }
  const Eigen::VectorXd& position() const { return reading_.position; }
  double time() const { return time_; }
  double cycle() const override { return cycle_; }
  /// The task on this arm, as it is believed; known once it has started.
  force::InsertionFrames frames() const { return {T_base_tube_, T_peg_tool_.inverse()}; }
  /// The tube in T, as it really stands.
  const Pose& tube() const { return T_tube_actual_; }

 private:
  using Coordinates = Eigen::Matrix<double, 5, 1>;
  static Coordinates coordinates(const Pose& T_tube_peg);

  Pose flange_for(const Pose& T_tube_peg) const;
  bool choose_turn(const Pose& T_tube_peg, double tilt);
  std::optional<Eigen::VectorXd> asked(const robot::RobotCommand& command);
  Pose commanded(const Pose& T_tube_peg);
  /// Where the grip really would hold the peg, in the real tube.
  Pose held();
  void move_peg(const Pose& to, double passed);

  cell::Cell cell_;
  InsertionSetup setup_;
  Random random_, jitter_;
  IkSolver ik_;
  DrivenArm arm_;
  HeldPeg peg_;
  WristSensor sensor_;
  Encoders encoders_;
  CurrentSensors currents_;
  robot::SensorModel believed_;
  std::vector<physics::PathCorrection> servo_;
  bool relative_ = false, reachable_ = true, stopped_ = false;
  robot::RobotReading told_;                ///< The last one.
  Pose T_base_asked_ = Pose::Identity();    ///< Where the tool was last asked to be.
  Coordinates seen_ = Coordinates::Zero();  ///< What the arm last read of itself.
  double cycle_ = 0.0, time_ = 0.0;
  Pose T_base_tube_ = Pose::Identity(), T_tube_actual_ = Pose::Identity(), T_actual_base_ = Pose::Identity();
  Pose T_peg_tool_ = Pose::Identity();  ///< The grip's turn about the peg.
  Pose grip_ = Pose::Identity();        ///< Where the peg really sits in it.
  ArmWander wander_;                    ///< In T.
  JointLead lead_;
  Eigen::VectorXd command_;  ///< What the servos of the joints were told last [rad or m].
  ArmReading reading_;
  Pose held_ = Pose::Identity();
  Vector6 on_tool_ = Vector6::Zero();  ///< Of the peg, at S, in B.
};

}  // namespace kr5::sim
