// SPDX-License-Identifier: BSD-3-Clause
#include "predict/drive_loads.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include <kr5/core/error.hpp>

namespace kr5::predict {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double smooth_speed = 0.002;  ///< Of the sign of the speed [rad/s or m/s].

ArrayXd friction(const cell::Cell& cell, int joint, const ArrayXd& t, const ArrayXd& speed, const ArrayXd& load) {
  const cell::JointEffects& e = cell.effects.joint(joint);
  const double coulomb = e.coulomb.value_or(cell.drives ? cell.drives->friction.coulomb[joint] : 0.0);
  const double viscous = e.viscous.value_or(cell.drives ? cell.drives->friction.viscous[joint] : 0.0);
  ArrayXd dry = ArrayXd::Constant(t.size(), coulomb);
  if (e.stribeck != 0.0) dry += e.stribeck * (-(speed / e.stribeck_velocity).square()).exp();
  if (e.load_coefficient != 0.0) dry += e.load_coefficient * load.abs();
  ArrayXd out = dry * (speed / smooth_speed).tanh() + viscous * speed;
  if (e.thermal_drop != 0.0) out *= 1.0 - e.thermal_drop * (1.0 - (-t / e.thermal_time_constant).exp());
  return out;
}

/// Each row as it was `delay` earlier, linear between rows; before the first as the first.
MatrixXd delayed(const VectorXd& t, const MatrixXd& values, double delay) {
  MatrixXd out(values.rows(), values.cols());
  Index before = 0;
  for (Index row = 0; row < t.size(); ++row) {
    const double then = t[row] - delay;
    while (before + 1 < t.size() && t[before + 1] <= then) ++before;
    if (then <= t[0]) {
      out.row(row) = values.row(0);
    } else {
      const double part = (then - t[before]) / (t[before + 1] - t[before]);
      out.row(row) = (1.0 - part) * values.row(before) + part * values.row(before + 1);
    }
  }
  return out;
}

}  // namespace

MatrixXd drive_torques(const cell::Cell& cell, const VectorXd& t, const Response& servo, const MatrixXd& load) {
  MatrixXd out = load;
  for (int i = 0; i < load.cols(); ++i) {
    const cell::JointEffects& e = cell.effects.joint(i);
    out.col(i).array() += friction(cell, i, t.array(), servo.v.col(i).array(), load.col(i).array());
    if (e.ripple_amplitude != 0.0)
      out.col(i).array() += e.ripple_amplitude * (e.ripple_cycles * servo.x.col(i).array() + e.ripple_phase).sin();
  }
  return out;
}

MatrixXd currents(const cell::Cell& cell, const VectorXd& t, const Response& servo, const MatrixXd& torque) {
  const cell::Drives& drives = *cell.drives;
  MatrixXd S = drives.structure;
  VectorXd inertia = drives.rotor_inertia, constant = drives.torque_constant;
  for (int i = 0; i < S.rows(); ++i) {
    const cell::MotorEffects& m = cell.effects.motor(i);
    require(m.coupling_element >= 0 && m.coupling_element < S.cols(),
            "effects.wrist_coupling.motor" + std::to_string(i + 1) + ".element: found " +
                std::to_string(m.coupling_element) + ", expected 0 to " + std::to_string(S.cols() - 1));
    if (m.coupling_value) S(i, m.coupling_element) = *m.coupling_value;
    inertia[i] = cell.effects.joint(i).rotor_inertia.value_or(inertia[i]);
    constant[i] = cell.effects.joint(i).torque_constant.value_or(constant[i]);
  }
  const MatrixXd motor = servo.a * S.transpose() * inertia.asDiagonal() + torque * S.inverse();
  const MatrixXd drawn = motor * constant.cwiseInverse().asDiagonal();
  const double delay = cell.effects.arm.current_delay;
  return delay > 0.0 ? delayed(t, drawn, delay) : drawn;
}

}  // namespace kr5::predict
