// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>

#include <kr5/core/fields.hpp>
#include <kr5/physics/effective_drives.hpp>
#include <kr5/sim/arm.hpp>

/// @file
/// The arm of a cell with its motors, gears and joint servos, stepped through time.

namespace kr5::sim {

struct DrivenArmOptions {
  double step = 0.0;              ///< [s]
  Eigen::VectorXd current_limit;  ///< [A]

  /// @throws InvalidArgument naming the field.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("step", self.step, "Step of the integration; 0: a quarter radian of the stiffest gear, at most 1 ms [s].");
    visit("current_limit", self.current_limit, "Maximum current of each motor; empty: no limit [A].");
  }
};

/// What the drives and the sensor of an arm know at one instant, noise and sensor effects apart.
struct ArmReading {
  double t = 0.0;                    ///< [s]
  Eigen::VectorXd position;          ///< Motor side, as the controller reads it [rad or m].
  Eigen::VectorXd velocity;          ///< [rad/s or m/s]
  Eigen::VectorXd acceleration;      ///< [rad/s^2 or m/s^2]
  Eigen::VectorXd link;              ///< True joint values.
  Eigen::VectorXd torque;            ///< Through the gears, on the links [N m or N].
  Eigen::VectorXd friction;          ///< [N m or N]
  Eigen::VectorXd current;           ///< Empty for a cell without drives [A].
  Vector6 wrench = Vector6::Zero();  ///< Of tool and environment on the sensor, in S [N, N m].
  bool limited = false;              ///< A motor stood at its current limit in the last step.
};

/// An arm in motion: all that a later step depends on.
struct DrivenArmState {
  double t = 0.0, step = 0.0, looked_up = 0.0;             ///< [s]
  Eigen::VectorXd position, velocity, acceleration;        ///< Motor side [rad or m, and per s, s^2].
  Eigen::VectorXd link, link_velocity, link_acceleration;  ///< The same of the links.
  Eigen::VectorXd command;                                 ///< Of the servos [rad or m].
  Eigen::VectorXd inertia;                                 ///< [kg m^2 or kg]
  Eigen::VectorXd current;                                 ///< [A]
  Eigen::VectorXd friction, torque;                        ///< [N m or N]
  bool ideal = true, limited = false;

  static void each_field(auto& self, auto&& visit) {
    visit("t", self.t, "Time [s].");
    visit("step", self.step, "Step of the integration [s].");
    visit("looked_up", self.looked_up, "Time at which the inertia at the gears was computed [s].");
    visit("position", self.position, "Position, motor side [rad or m].");
    visit("velocity", self.velocity, "Speed, motor side [rad/s or m/s].");
    visit("acceleration", self.acceleration, "Acceleration, motor side [rad/s^2 or m/s^2].");
    visit("link", self.link, "True joint values [rad or m].");
    visit("link_velocity", self.link_velocity, "Speed of the joints [rad/s or m/s].");
    visit("link_acceleration", self.link_acceleration, "Acceleration of the joints [rad/s^2 or m/s^2].");
    visit("command", self.command, "Last command of the servos [rad or m].");
    visit("inertia", self.inertia, "Inertia at the gears [kg m^2 or kg].");
    visit("current", self.current, "Current of the motors [A].");
    visit("friction", self.friction, "Dry friction of the last step [N m or N].");
    visit("torque", self.torque, "Torque through the gears in the last step [N m or N].");
    visit("ideal", self.ideal, "Whether the last step was one of ideal servos.");
    visit("limited", self.limited, "Whether a motor stood at its current limit.");
  }
};

/// Wrench of the environment on the tool at the origin of S, in B [N, N m].
using Environment = std::function<Vector6(const Pose& T_base_sensor, const Vector6& velocity, double t)>;

/// Three ways to move: `follow`, the motor side on the exact response of the joint servos, with any torque;
/// `follow_motion`, the motor side on a motion that was measured; `drive` and
/// `follow_limited`, where motor currents act on rotors, gears and links, with dry friction that holds. Elastic gears
/// and backlash are springs between motor side and link in both. Second order in the step.
class DrivenArm {
 public:
  /// @throws InvalidArgument naming the field of the cell or option; for a step beyond the stable bound of the gears,
  ///         naming that bound.
  explicit DrivenArm(const cell::Cell& cell, const DrivenArmOptions& options = {});
  ~DrivenArm();
  DrivenArm(DrivenArm&&) noexcept;
  DrivenArm& operator=(DrivenArm&&) noexcept;

  const physics::EffectiveDrives& drives() const;
  Arm& arm();
  double step() const;
  /// Makes the step smaller until the next reset, so that whole steps fit between samples.
  void set_step(double step);
  /// Largest stable step of the gear springs at a posture; infinite for rigid gears [s].
  double stable_step(const Eigen::VectorXd& position);

  /// Resets to rest at a motor-side position, with the links sagging in their springs, at time t of slow effects.
  void reset(const Eigen::VectorXd& position, double t = 0.0);
  void set_environment(Environment environment);
  /// What the environment does has changed within this instant: it is asked again by the next reading.
  void environment_changed();
  /// One step of the ideal servos, whose command runs straight to `command`; its delay is the caller's.
  /// @throws InvalidArgument for a cell without joint servo, here and below.
  void follow(const Eigen::VectorXd& command);
  /// The motor side has this motion now, after a reset to its position; a row a joint: position, speed, acceleration.
  /// Elastic joints move with it, their springs in balance with gravity and inertia.
  void begin_motion(const Eigen::MatrixX3d& motor);
  /// One step to a motion of the motor side, which needs no servo.
  void follow_motion(const Eigen::MatrixX3d& motor);
  /// One step of servos that cannot get more than the current limit; they stall, or yield, there.
  void follow_limited(const Eigen::VectorXd& command);
  /// One step under given motor currents [A].
  void drive(const Eigen::VectorXd& current);

  /// The present instant; the same until the next step.
  const ArmReading& read();
  /// Kinetic and potential energy of links, rotors and gear springs [J].
  double energy();

  DrivenArmState state() const;
  /// Goes on from a state of an arm of the same cell.
  /// @throws InvalidArgument naming the field that has not one finite value a joint, or a step that is not positive.
  void restore(const DrivenArmState& state);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kr5::sim
