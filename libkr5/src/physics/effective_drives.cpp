// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/effective_drives.hpp>

#include <algorithm>

#include <kr5/core/error.hpp>
#include <kr5/physics/servo.hpp>

namespace kr5::physics {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

template <class Law>
VectorXd each_joint(const std::vector<JointDrive>& joints, Law&& law) {
  VectorXd out(static_cast<Index>(joints.size()));
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const auto k = static_cast<Index>(i);
    out[k] = law(joints[i], k);
  }
  return out;
}

}  // namespace

EffectiveDrives::EffectiveDrives(const cell::Cell& cell) : joints(joint_drives(cell)), servo(joint_servos(cell)) {
  if (cell.drives) motors.emplace(cell);
}

bool EffectiveDrives::rigid() const {
  return std::all_of(joints.begin(), joints.end(), [](const JointDrive& j) { return j.spring.rigid(); });
}

MatrixXd EffectiveDrives::rotor_matrix() const {
  return motors ? motors->rotor_matrix() : MatrixXd::Zero(size(), size());
}

VectorXd EffectiveDrives::friction(const VectorXd& position, const VectorXd& speed, const VectorXd& torque,
                                   double t) const {
  return each_joint(joints, [&](const JointDrive& j, Index i) {
    return joint_friction<double>(j.friction, {position[i], speed[i], torque[i], t});
  });
}

VectorXd EffectiveDrives::ripple(const VectorXd& q) const {
  return each_joint(joints, [&](const JointDrive& j, Index i) {
    return j.ripple.amplitude == 0.0 ? 0.0 : torque_ripple(j.ripple, q[i]);
  });
}

VectorXd EffectiveDrives::cable(const VectorXd& q) const {
  return each_joint(joints, [&](const JointDrive& j, Index i) { return cable_spring(j.cable, q[i]); });
}

VectorXd EffectiveDrives::link(const VectorXd& q) const {
  return each_joint(joints, [&](const JointDrive& j, Index i) { return j.transmission.link(q[i]); });
}

VectorXd EffectiveDrives::currents(const VectorXd& acceleration, const VectorXd& torque) const {
  require(motors.has_value(), "drives: this cell has no motors");
  return motors->currents(acceleration.transpose(), torque.transpose()).transpose();
}

VectorXd EffectiveDrives::torques(const VectorXd& currents) const {
  require(motors.has_value(), "drives: this cell has no motors");
  return motors->torques(currents);
}

VectorXd EffectiveDrives::gear_torques(const VectorXd& currents, const VectorXd& position, const VectorXd& acceleration,
                                       const VectorXd& friction) const {
  return torques(currents) - rotor_matrix() * acceleration - ripple(position) - friction;
}

MatrixXd EffectiveDrives::drive_torques(const VectorXd& t, const MatrixXd& position, const MatrixXd& speed,
                                        const MatrixXd& load) const {
  MatrixXd out = load;
  const ArrayXd time = t;
  for (Index i = 0; i < load.cols(); ++i) {
    const JointDrive& j = joint(i);
    out.col(i).array() += joint_friction<ArrayXd>(j.friction, {position.col(i), speed.col(i), load.col(i), time});
    if (j.ripple.amplitude != 0.0) out.col(i).array() += torque_ripple<ArrayXd>(j.ripple, position.col(i));
  }
  return out;
}

}  // namespace kr5::physics
