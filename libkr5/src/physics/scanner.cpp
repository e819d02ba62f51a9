// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/scanner.hpp>

#include <kr5/core/error.hpp>

namespace kr5::physics {

Pose laser_mount(const cell::Cell& cell) {
  require(cell.laser.has_value(), "laser: is missing in the cell");
  if (const auto replaced = cell.effects.replaced_pose("laser_mount", "T_E_L"))
    return cell.tool ? cell.tool->T_flange_tool * *replaced : *replaced;
  const std::optional<Pose> nominal = cell::T_flange_scanner(cell);
  require(nominal.has_value(), "laser.T_E_L: is missing; expected the pose of the scanner");
  return *nominal;
}

EffectiveScanner::EffectiveScanner(const cell::Cell& cell)
    : T_flange_scanner_(laser_mount(cell)),
      bias_(cell.effects.number("laser_bias", "bias")),
      lag_(cell.effects.number("laser_lag", "lag")),
      stand_off_(cell.laser->stand_off),
      bias_distance_(cell.laser->bias_distance) {
  require(bias_distance_ > 0.0, "laser.bias_distance: must be positive [m]");
}

double EffectiveScanner::laser_bias(double range) const {
  const double off = (range - stand_off_) / bias_distance_;
  return range + bias_ * off * off;
}

Ray EffectiveScanner::laser_lag(const Pose& T_base_scanner, double x, double speed) const {
  return {T_base_scanner * Eigen::Vector3d(x, -speed * lag_, 0.0), T_base_scanner.linear().col(2)};
}

}  // namespace kr5::physics
