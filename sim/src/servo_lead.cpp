// SPDX-License-Identifier: BSD-3-Clause
#include "servo_lead.hpp"

#include <kr5/robot/servo_feedforward.hpp>

namespace kr5::sim {

using Eigen::VectorXd;

void ServoLead::reset(const VectorXd& q) {
  q_ = q;
  speed_ = VectorXd::Zero(q.size());
}

VectorXd ServoLead::ahead(const VectorXd& q) {
  const VectorXd speed = (q - q_) / cycle_;
  VectorXd out = q;
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const cell::SecondOrder& servo = servo_.of_joint(static_cast<int>(i));
    const robot::ServoFeedforward lead(servo.natural_frequency, servo.damping_ratio);
    out[i] += lead(speed[i], (speed[i] - speed_[i]) / cycle_);
  }
  q_ = q;
  speed_ = speed;
  return out;
}

}  // namespace kr5::sim
