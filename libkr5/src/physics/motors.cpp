// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/motors.hpp>

#include <Eigen/LU>

#include <kr5/core/error.hpp>

namespace kr5::physics {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

void require_size(Index found, int expected, const std::string& field) {
  require(found == expected,
          field + ": found " + std::to_string(found) + " values, expected one a joint: " + std::to_string(expected));
}

void require_sizes(const cell::Drives& drives, int n) {
  require(drives.structure.rows() == n && drives.structure.cols() == n,
          "drives.structure: expected " + std::to_string(n) + " x " + std::to_string(n));
  require_size(drives.rotor_inertia.size(), n, "drives.rotor_inertia");
  require_size(drives.torque_constant.size(), n, "drives.torque_constant");
}

}  // namespace

MatrixXd wrist_coupling(const cell::Cell& cell) {
  MatrixXd S = cell.drives->structure;
  for (int i = 0; i < S.rows(); ++i) {
    const int element = static_cast<int>(cell.effects.number("wrist_coupling", "element", i));
    require(element >= 0 && element < S.cols(), "effects.wrist_coupling.motor" + std::to_string(i + 1) +
                                                    ".element: found " + std::to_string(element) + ", expected 0 to " +
                                                    std::to_string(S.cols() - 1));
    if (const auto value = cell.effects.replaced_number("wrist_coupling", "value", i)) S(i, element) = *value;
  }
  return S;
}

VectorXd rotor_inertia(const cell::Cell& cell) {
  VectorXd out = cell.drives->rotor_inertia;
  for (int i = 0; i < out.size(); ++i)
    out[i] = cell.effects.replaced_number("rotor_inertia", "rotor_inertia", i).value_or(out[i]);
  return out;
}

VectorXd torque_constant(const cell::Cell& cell) {
  VectorXd out = cell.drives->torque_constant;
  for (int i = 0; i < out.size(); ++i)
    out[i] = cell.effects.replaced_number("torque_constant", "torque_constant", i).value_or(out[i]);
  return out;
}

MatrixXd reported_torques(const cell::Cell& cell, const Eigen::Ref<const MatrixXd>& currents) {
  require(cell.drives.has_value(), "drives: this cell has no motors");
  const int n = cell.robot.joints();
  require_sizes(*cell.drives, n);
  require(currents.cols() == n,
          "currents: expected " + std::to_string(n) + " columns, found " + std::to_string(currents.cols()));
  return currents * cell.drives->torque_constant.asDiagonal() * cell.drives->structure;
}

double current_delay(const cell::Cell& cell) { return cell.effects.number("current_delay", "delay"); }

Motors::Motors(const cell::Cell& cell) {
  require(cell.drives.has_value(), "drives: this cell has no motors");
  require_sizes(*cell.drives, cell.robot.joints());
  structure = wrist_coupling(cell);
  rotor_inertia = physics::rotor_inertia(cell);
  torque_constant = physics::torque_constant(cell);
  const Eigen::FullPivLU<MatrixXd> lu(structure);
  require(structure.allFinite() && lu.isInvertible(), "drives.structure: has no inverse");
  inverse = structure.inverse();
}

MatrixXd Motors::rotor_matrix() const { return structure.transpose() * rotor_inertia.asDiagonal() * structure; }

MatrixXd Motors::currents(const Eigen::Ref<const MatrixXd>& acceleration,
                          const Eigen::Ref<const MatrixXd>& torque) const {
  const MatrixXd motor = acceleration * structure.transpose() * rotor_inertia.asDiagonal() + torque * inverse;
  return motor * torque_constant.cwiseInverse().asDiagonal();
}

VectorXd Motors::torques(const VectorXd& currents) const {
  return structure.transpose() * torque_constant.cwiseProduct(currents);
}

}  // namespace kr5::physics
