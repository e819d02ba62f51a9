// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>

namespace kr5::identification {

/// Measured motion of an arm with the torques of its joints, a row a sample, a column a joint.
struct JointMotion {
  Eigen::VectorXd t;                 ///< In ascending order [s].
  Eigen::MatrixXd q;                 ///< [rad or m]
  Eigen::MatrixXd qd;                ///< [rad/s or m/s]
  Eigen::MatrixXd qdd;               ///< [rad/s^2 or m/s^2]
  Eigen::MatrixXd tau;               ///< Torques of the drives, on the joint side [N m or N].
  std::vector<int> run_starts;       ///< First sample of each uninterrupted run, 0 first; empty: one run.
  Eigen::MatrixXd temperature = {};  ///< Of the joints; empty: not measured [deg C].
  Eigen::VectorXd speed_noise = {};  ///< Standard deviation of the speeds of each joint; empty: exact [rad/s or m/s].

  Eigen::Index samples() const { return t.size(); }
  int joints() const { return static_cast<int>(q.cols()); }

  /// @throws InvalidArgument naming field and row: sizes that differ, numbers that are not finite, times that do not
  ///         rise within a run.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("t", self.t, "Times, in ascending order within a run [s].");
    visit("q", self.q, "Joint values, samples x joints [rad or m].");
    visit("qd", self.qd, "Joint speeds, samples x joints [rad/s or m/s].");
    visit("qdd", self.qdd, "Joint accelerations, samples x joints [rad/s^2 or m/s^2].");
    visit("tau", self.tau, "Torques of the drives on the joint side, samples x joints [N m or N].");
    visit("run_starts", self.run_starts, "First sample of each uninterrupted run, 0 first; empty: one run.");
    visit("temperature", self.temperature,
          "Temperatures of the joints, samples x joints; empty: not measured [deg C].");
    visit("speed_noise", self.speed_noise,
          "Standard deviation of the speeds of each joint, from which a direction of motion is known; empty: exact "
          "[rad/s or m/s].");
  }
};

/// Motions of one arm one after the other, each of them at least one run. Temperatures are kept where all have them;
/// the noise of the speeds is that of the noisiest.
/// @throws InvalidArgument for no motion, or other joints.
JointMotion merged_motion(std::span<const JointMotion> motions);

}  // namespace kr5::identification
