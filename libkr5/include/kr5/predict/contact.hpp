// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>

namespace kr5::predict {

/// Contact of the tool as it really is, the grip in series.
class RealContact {
 public:
  /// @throws InvalidArgument for a stiffness that is not positive. Needs a contact.
  explicit RealContact(const cell::Cell& cell);
  /// Normal force [N] at a depth [m] that grows with `speed` [m/s].
  double force(double depth, double speed) const;
  /// Depth [m] at which the normal force [N] is held; NaN where softening contact cannot hold it.
  double depth(double force) const;
  double friction() const { return friction_; }

 private:
  double stiffness_, damping_, friction_;
  double hardening_;  ///< [1/m]
};

/// The tube as it really stands, in T.
Pose real_tube(const cell::TaskEffects& effects);

/// Inner radius [m] of the tube as it really is. Needs a tube.
double real_inner_radius(const cell::Cell& cell);

/// What tool and payload weigh on the sensor when the tool points down: axes of S are X, -Y, -Z of B. N x 6.
Eigen::MatrixXd tool_weight(const cell::Cell& cell, Eigen::Index rows);

}  // namespace kr5::predict
