// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/cell/drives.hpp>

namespace kr5::sim {

/// Exact steps of x'' = wn^2 (u - x) - 2 xi wn x' for several axes.
class ServoBank {
 public:
  enum class Between { Line, Held };  ///< How the command runs from one step to the next.

  ServoBank() = default;
  ServoBank(std::vector<cell::SecondOrder> axes, double step, Between between);

  void reset(const Eigen::VectorXd& x);
  /// Command `u` is that of the end of the step for Line, of the whole step for Held.
  void advance(const Eigen::VectorXd& u);
  /// Another state is forced on the axes.
  void set(const Eigen::VectorXd& x, const Eigen::VectorXd& v);
  /// What the axes want where they are.
  Eigen::VectorXd demand(const Eigen::VectorXd& u, const Eigen::VectorXd& x, const Eigen::VectorXd& v) const;

  const Eigen::VectorXd& x() const { return x_; }
  const Eigen::VectorXd& v() const { return v_; }
  Eigen::VectorXd acceleration() const { return demand(u_, x_, v_); }
  const Eigen::VectorXd& command() const { return u_; }
  bool empty() const { return axes_.empty(); }

 private:
  struct Step {
    Eigen::Matrix2d A;
    Eigen::Vector2d from, to;  ///< Of the command at begin and end.
  };
  std::vector<cell::SecondOrder> axes_;
  std::vector<Step> steps_;
  Eigen::VectorXd x_, v_, u_;
};

}  // namespace kr5::sim
