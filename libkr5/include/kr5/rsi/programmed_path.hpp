// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/robot/joint_vector.hpp>

namespace kr5::rsi {

/// The uncorrected path of a program: from where the arm stands through places one after the other, all joints at once,
/// and to rest at the last. Once made, it throws nothing.
class ProgrammedPath {
 public:
  /// @param places Joint values. @param speed Of the joint with the longest way, with an override of 100 % [rad/s].
  /// @throws InvalidArgument for a place of another number of joints, and a speed that is not positive.
  ProgrammedPath(std::vector<Eigen::VectorXd> places, double speed, int joints);

  /// The program begins, at these joint values.
  void begin(const robot::JointVector& joints) noexcept;
  /// Goes on for a time. @param share Override [-].
  void advance(double time, double share) noexcept;
  /// Setpoints of the joints [rad or m].
  const robot::JointVector& joints() const noexcept { return joints_; }
  bool finished() const noexcept { return next_ == places_.size(); }

 private:
  std::vector<Eigen::VectorXd> places_;
  double speed_;
  std::size_t next_ = 0;  ///< Place that it goes to.
  robot::JointVector joints_;
};

}  // namespace kr5::rsi
