// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/core/fields.hpp>

namespace kr5::rsi {

/// How a controller counts the joints of the arm: axis = sign (q - zero). It acts in telegrams and in files for the
/// controller, where numbers of its axes stand, and nowhere else. Differences and efforts take the sign alone.
struct ControllerAxes {
  Eigen::VectorXd sign;  ///< 1 or -1 [-].
  Eigen::VectorXd zero;  ///< Joint value where the controller counts 0 [rad or m].

  Eigen::VectorXd axes(const Eigen::VectorXd& q) const { return sign.cwiseProduct(q - zero); }
  Eigen::VectorXd joints(const Eigen::VectorXd& axes) const { return sign.cwiseProduct(axes) + zero; }

  /// @throws InvalidArgument naming the field. @param joints How many there are.
  void validate(int joints) const;

  static void each_field(auto& self, auto&& visit) {
    visit("sign", self.sign, "Direction of each axis of the controller beside that of the joint: 1 or -1 [-].");
    visit("zero", self.zero, "Joint value at which each axis of the controller counts 0 [rad or m].");
  }
};

}  // namespace kr5::rsi
