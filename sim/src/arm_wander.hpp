// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/core/random.hpp>
#include <kr5/geometry/pose.hpp>

namespace kr5::sim {

/// How far the tool of an arm is off where its joints have it: its repeatability, which changes slowly.
class ArmWander {
 public:
  /// @param repeatability Three standard deviations per axis [m].
  explicit ArmWander(double repeatability) : repeatability_(repeatability) {}

  /// Anew, as after a long way.
  void draw(Random& random);
  void pass(double time, Random& random);
  /// The pose with that error of place and orientation, in the axes of the frame that it is given in.
  Pose applied(const Pose& T) const;

  /// Translation and rotation vector [m, rad].
  const Vector6& off() const { return off_; }
  void restore(const Vector6& off) { off_ = off; }

 private:
  double sigma(int axis) const;

  double repeatability_;
  Vector6 off_ = Vector6::Zero();
};

}  // namespace kr5::sim
