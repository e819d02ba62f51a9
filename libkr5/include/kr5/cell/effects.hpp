// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <vector>

#include <kr5/geometry/pose.hpp>
#include <kr5/io/reader.hpp>

/// @file
/// Every effect of the catalogue that a cell may carry, at the value that switches it off: a simulator reads the member
/// (`effects.joint(2).stribeck`), a diagnosis sets it by name (kr5/cell/effect.hpp, which is the field list of these
/// structs with units and bounds). An empty optional means: as in the cell; the value, when there, replaces it.

namespace kr5::cell {

struct JointEffects {
  std::optional<double> coulomb;                                  ///< coulomb_friction [N m]
  std::optional<double> viscous;                                  ///< viscous_friction [N m s/rad]
  double stribeck = 0.0, stribeck_velocity = 0.1;                 ///< stribeck_friction [N m], [rad/s]
  double load_coefficient = 0.0;                                  ///< load_friction [-]
  double thermal_drop = 0.0, thermal_time_constant = 600.0;       ///< thermal_friction [-], [s]
  double elasticity = std::numeric_limits<double>::infinity();    ///< joint_elasticity, stiffness [N m/rad]
  double backlash = 0.0;                                          ///< backlash, gap [rad]
  std::optional<double> torque_constant;                          ///< torque_constant [N m/A]
  std::optional<double> rotor_inertia;                            ///< rotor_inertia [kg m^2]
  double cable_stiffness = 0.0, cable_rest = 0.0;                 ///< cable_spring [N m/rad], [rad]
  double ripple_amplitude = 0.0, ripple_phase = 0.0;              ///< torque_ripple [N m], [rad]
  int ripple_cycles = 1;                                          ///< torque_ripple, per turn
  double encoder_offset = 0.0;                                    ///< encoder_offset [rad]
  std::optional<double> a, b;                                     ///< link_length [m]
  std::optional<double> alpha;                                    ///< link_twist [rad]
  double transmission_amplitude = 0.0, transmission_phase = 0.0;  ///< transmission_error [rad], [rad]
  int transmission_cycles = 1;                                    ///< transmission_error, per turn
  std::optional<double> natural_frequency;                        ///< joint_servo [rad/s]
};

/// Coupling of one motor to a joint it should not, or otherwise, feel: S(motor, element) = value.
struct MotorEffects {
  int coupling_element = 0;              ///< wrist_coupling, column of S from 0
  std::optional<double> coupling_value;  ///< wrist_coupling [-]
};

/// Of one component of the wrist wrench, in N or N m.
struct WrenchEffects {
  double bias = 0.0;            ///< ft_bias [N or N m]
  double rate = 0.0;            ///< ft_drift [N/s or N m/s]
  double gain = 1.0;            ///< ft_gain, the factor itself [-]
  int source = 0;               ///< ft_crosstalk, component that leaks in, from 0
  double crosstalk_gain = 0.0;  ///< ft_crosstalk [-, m or 1/m]
};

struct ToolEffects {
  double payload_mass = 0.0;                              ///< payload [kg]
  Eigen::Vector3d payload_com = Eigen::Vector3d::Zero();  ///< payload, in S [m]
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();       ///< tool_offset, along E [m]
};

struct ArmEffects {
  double base_roll = 0.0, base_pitch = 0.0;           ///< base_tilt [rad]
  double growth = 0.0, growth_time_constant = 600.0;  ///< thermal_growth [-], [s]
  double current_delay = 0.0;                         ///< current_delay [s]
  std::optional<double> joint_delay;                  ///< joint_delay [s]
  std::optional<double> tool_frequency;               ///< tool_servo [rad/s]
  std::optional<double> tool_damping;                 ///< tool_damping [-]
  std::optional<double> tool_delay;                   ///< tool_delay [s]
};

struct SensorEffects {
  double ft_lag = 0.0;           ///< ft_lag, time constant [s]
  std::optional<double> fx, fy;  ///< camera_focal [px]
  std::optional<double> k1, k2;  ///< lens_distortion [-]
  std::optional<Pose> T_E_C;     ///< hand_eye
  std::optional<Pose> T_E_L;     ///< laser_mount
  double laser_bias = 0.0;       ///< laser_bias [m]
  double laser_lag = 0.0;        ///< laser_lag [s]
};

struct TaskEffects {
  std::optional<double> stiffness;                       ///< contact_stiffness [N/m]
  double hardening = 0.0;                                ///< contact_hardening, per mm of depth [1/mm]
  std::optional<double> friction;                        ///< contact_friction [-]
  double lateral = 0.0, axial = 0.0;                     ///< gripper_compliance [m/N]
  Eigen::Vector2d tube_tilt = Eigen::Vector2d::Zero();   ///< tube_tilt, about X then Y of T [rad]
  Eigen::Vector3d tube_shift = Eigen::Vector3d::Zero();  ///< tube_shift, along T [m]
  std::optional<double> tube_radius;                     ///< tube_radius, inner [m]
};

struct Effects {
  std::vector<JointEffects> joints;  ///< Joints beyond the end carry none.
  std::vector<MotorEffects> motors;  ///< The same for motors.
  std::array<WrenchEffects, 6> wrench;
  ToolEffects tool;
  ArmEffects arm;
  SensorEffects sensors;
  TaskEffects task;

  /// What joint or motor `index` (from 0) carries.
  const JointEffects& joint(int index) const;
  const MotorEffects& motor(int index) const;

  /// In a file: `<id>.<target>.<parameter>`; what is off is not written.
  bool read_form(io::Reader& reader, const io::Node& node, const std::string& field);
  io::Node write_form() const;
};

}  // namespace kr5::cell
