// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/cell/drives.hpp>
#include <kr5/robot/servo_feedforward.hpp>

namespace kr5::sim {

/// Joint setpoints ahead of their servos. The servo of a path is what was measured of the whole arm, joint servos in
/// it: these are told ahead of time.
class JointLead {
 public:
  JointLead(const cell::Servo& servo, double cycle) : servo_(servo), cycle_(cycle) {}

  /// At rest there.
  void start(const Eigen::VectorXd& q) {
    q_ = q;
    speed_ = Eigen::VectorXd::Zero(q.size());
  }
  /// In motion there.
  void restore(const Eigen::VectorXd& q, const Eigen::VectorXd& speed) { q_ = q, speed_ = speed; }
  const Eigen::VectorXd& q() const { return q_; }
  const Eigen::VectorXd& speed() const { return speed_; }

  /// What the servos are told, so that the joints are at `q` now.
  Eigen::VectorXd next(const Eigen::VectorXd& q) {
    const Eigen::VectorXd speed = (q - q_) / cycle_;
    Eigen::VectorXd out = q;
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      const cell::SecondOrder& servo = servo_.of_joint(static_cast<int>(i));
      const robot::ServoFeedforward lead(servo.natural_frequency, servo.damping_ratio);
      out[i] += lead(speed[i], (speed[i] - speed_[i]) / cycle_);
    }
    q_ = q;
    speed_ = speed;
    return out;
  }

 private:
  cell::Servo servo_;
  double cycle_;
  Eigen::VectorXd q_, speed_;
};

}  // namespace kr5::sim
