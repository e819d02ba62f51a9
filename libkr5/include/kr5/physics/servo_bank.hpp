// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/cell/drives.hpp>

namespace kr5::physics {

using cell::CommandHold;

/// Exact steps of x'' = wn^2 (u - x) - 2 xi wn x' for several axes; delays are the caller's.
class ServoBank {
 public:
  ServoBank() = default;
  ServoBank(std::vector<cell::SecondOrder> axes, double step, CommandHold hold);

  /// At rest at x, which is the command too.
  void reset(const Eigen::VectorXd& x);
  /// One step; `u` is the command of the end of the step for FirstOrderHold, of the whole step for ZeroOrderHold.
  void advance(const Eigen::VectorXd& u);
  /// Another state is forced on the axes.
  void set(const Eigen::VectorXd& x, const Eigen::VectorXd& v);
  /// Accelerations that the servos ask for at a state under a command.
  Eigen::VectorXd demand(const Eigen::VectorXd& u, const Eigen::VectorXd& x, const Eigen::VectorXd& v) const;

  const Eigen::VectorXd& x() const { return x_; }
  const Eigen::VectorXd& v() const { return v_; }
  Eigen::VectorXd acceleration() const { return demand(u_, x_, v_); }
  const Eigen::VectorXd& command() const { return u_; }
  bool empty() const { return axes_.empty(); }

 private:
  struct Step {
    Eigen::Matrix2d A;
    Eigen::Vector2d from, to;  ///< Shares of the command at begin and end.
  };
  std::vector<cell::SecondOrder> axes_;
  std::vector<Step> steps_;
  Eigen::VectorXd x_, v_, u_;
};

}  // namespace kr5::physics
