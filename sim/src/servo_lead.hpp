// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>

namespace kr5::sim {

/// The servo of the path is what was measured of the whole arm, joint servos in it: these are told ahead of time.
class ServoLead {
 public:
  ServoLead(const cell::Servo& servo, double cycle) : servo_(servo), cycle_(cycle) {}

  /// At rest there.
  void reset(const Eigen::VectorXd& q);
  /// What the joint servos are told so that they are there after the next cycle.
  Eigen::VectorXd ahead(const Eigen::VectorXd& q);
  /// Where they were last asked to be.
  const Eigen::VectorXd& position() const { return q_; }

 private:
  cell::Servo servo_;
  double cycle_;  ///< [s]
  Eigen::VectorXd q_, speed_;
};

}  // namespace kr5::sim
