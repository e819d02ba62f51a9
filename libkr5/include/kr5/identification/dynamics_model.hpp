// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/identification/joint_motion.hpp>
#include <kr5/kinematics/dh_chain.hpp>
#include <kr5/kinematics/inertial_regressor.hpp>

/// @file
/// The dynamics of an arm as a linear function of its parameters, links, drives and friction in one (Hayat et al. 2022,
/// eqs. 4.34-4.37). The laws of friction are those of kr5/physics/friction.hpp.

namespace kr5::identification {

/// What the torque of one joint holds beside the loads of the links. Every term is linear in its parameters.
struct JointTerms {
  bool coulomb = true;
  bool viscous = true;
  bool rotor_inertia = true;
  bool offset = false;                   ///< A constant torque: of the sensor or of a spring.
  bool direction = false;                ///< Friction that differs between the two directions.
  bool load = false;                     ///< Dry friction that grows with the torque through the gear.
  bool motor = false;                    ///< Friction of the motor, too, where several joints turn it.
  double stribeck_velocity = 0.0;        ///< [rad/s or m/s]; 0: none.
  double thermal_time_constant = 0.0;    ///< [s]; 0: none.
  bool temperature = false;              ///< Friction that is linear in the measured temperature.
  double temperature_reference = 20.0;   ///< Where that share is zero [deg C].
  double motor_stribeck_velocity = 0.0;  ///< Of the motor, at its speed on the side of its joint; 0: none.

  static void each_field(auto& self, auto&& visit) {
    visit("coulomb", self.coulomb, "Coulomb friction.");
    visit("viscous", self.viscous, "Viscous friction.");
    visit("rotor_inertia", self.rotor_inertia, "Inertia of the rotor.");
    visit("offset", self.offset, "A constant torque.");
    visit("direction", self.direction, "Friction that differs between the two directions of motion.");
    visit("load", self.load, "Dry friction that grows with the torque through the gear.");
    visit("motor", self.motor,
          "Friction of the motor by its own speed, beside that of the joint, where several joints turn the motor.");
    visit("stribeck_velocity", self.stribeck_velocity, "Stribeck velocity; 0: no such friction [rad/s or m/s].");
    visit("thermal_time_constant", self.thermal_time_constant, "Time constant of warming up; 0: none [s].");
    visit("temperature", self.temperature, "Friction that is linear in the measured temperature of the joint.");
    visit("temperature_reference", self.temperature_reference,
          "Temperature at which that part of the friction is zero [deg C].");
    visit("motor_stribeck_velocity", self.motor_stribeck_velocity,
          "Stribeck velocity of a motor that several joints turn, on the side of its own joint; 0: no such friction "
          "[rad/s or m/s].");
  }
};

/// An arm whose parameters are to be found.
struct DynamicsModel {
  kinematics::DhChain chain;
  Eigen::Vector3d gravity = {0.0, 0.0, -9.81};  ///< In B [m/s^2].
  Eigen::MatrixXd structure;                    ///< S, n x n: motor angles S q [-]; empty: no coupling.
  std::vector<JointTerms> terms;                ///< One a joint; empty: the defaults.

  int joints() const { return static_cast<int>(chain.joints.size()); }
  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("chain", self.chain, "Chain of the joints.");
    visit("gravity", self.gravity, "Gravity in B [m/s^2].");
    visit("structure", self.structure, "Structure matrix S, n x n: motor angles S q [-]; empty: no coupling.");
    visit("terms", self.terms, "Terms of each joint; empty: Coulomb, viscous, rotor inertia.");
  }
};

/// Parameters of every joint in the order of eq. 4.36: Ixx Ixy Ixz Iyy Iyz Izz (about the origin of the link frame),
/// m cx, m cy, m cz, m, Coulomb and viscous friction, inertia of the rotor on the joint side.
constexpr int parameters_per_joint = 13;

/// Rows of a regressor that belong to one joint.
struct JointRegressor {
  std::vector<int> columns;  ///< Parameter of each column of X, in ascending order.
  Eigen::MatrixXd X;         ///< Samples x columns.
};

/// The regressor Y of a model: tau = Y chi. Parameters are 13 a joint, then the further terms of joint 1, of joint 2
/// and so on; a term that a joint does not have leaves a column of zeros.
class DynamicsRegressor {
 public:
  /// @throws InvalidArgument as DynamicsModel::validate.
  explicit DynamicsRegressor(DynamicsModel model);

  const DynamicsModel& model() const { return model_; }
  int joints() const { return model_.joints(); }
  int parameters() const { return static_cast<int>(names_.size()); }
  /// "I2xx", "m2 c2x", "m2", "fc2", "fv2", "Ia2"; further "fo2" (offset), "fcd2" and "fvd2" (direction), "fs2"
  /// (Stribeck), "fl2" (load), "fct2" and "fvt2" (warming up), "fcT2" and "fvT2" (per degree), "fcm2", "fvm2"
  /// and "fsm2" (motor, on the side of its own joint). Joints are counted from 1.
  const std::vector<std::string>& names() const { return names_; }
  /// Unit of each parameter.
  const std::vector<std::string>& units() const { return units_; }
  /// Position of a parameter; -1 when the model does not have it.
  int index(const std::string& name) const;

  /// Rows of each joint, with those of `columns` (ascending; empty: all) that may differ from zero there.
  /// @param load Torques through the gears (samples x joints), which only load-dependent friction asks for.
  std::vector<JointRegressor> joint_regressors(const JointMotion& motion, const std::vector<int>& columns = {},
                                               const Eigen::MatrixXd& load = {}) const;
  /// All of it, stacked: row k n + i of sample k and joint i.
  Eigen::MatrixXd evaluate(const JointMotion& motion, const Eigen::MatrixXd& load = {}) const;
  /// Torques of the links alone, without drives and friction: samples x joints [N m or N].
  Eigen::MatrixXd link_torques(const JointMotion& motion, const Eigen::VectorXd& parameters) const;
  /// Torques of a motion (samples x joints) [N m or N]. Load-dependent friction takes the torques of the links and
  /// rotors by these parameters.
  Eigen::MatrixXd torques(const JointMotion& motion, const Eigen::VectorXd& parameters) const;

 private:
  struct Term {
    int joint;
    std::size_t row;  ///< Of the table of terms.
  };

  /// Parameters that joint `i` may feel, of those that are wanted.
  std::vector<int> columns_of_joint(int i, const Eigen::MatrixXd& structure, const std::vector<char>& wanted) const;
  /// Columns of rotors and friction of joint `i`; those of the links stay.
  void fill_drive_columns(int i, const JointMotion& motion, const Eigen::MatrixXd& structure,
                          const Eigen::MatrixXd& load, JointRegressor& rows) const;

  DynamicsModel model_;
  std::vector<std::string> names_, units_;
  std::vector<Term> terms_;  ///< Of parameters 13 n and up.
};

}  // namespace kr5::identification
