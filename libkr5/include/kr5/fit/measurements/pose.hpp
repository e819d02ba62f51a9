// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/fit/measurement.hpp>

/// @file
/// A whole pose, such as a tracker gives of a frame.

namespace kr5::fit {

/// The pose of the chain's last frame in its first.
class PoseMeasurement final : public Measurement {
 public:
  /// With standard deviations per axis [m] and [rad].
  PoseMeasurement(PoseChain chain, const Pose& seen, double sigma_position, double sigma_rotation);
  /// With a covariance, right perturbation [m, rad].
  PoseMeasurement(PoseChain chain, const Pose& seen, const Matrix6& covariance);

  int rows() const override { return 6; }
  void declare(BlockUse& use) const override { use.chain(chain_); }
  bool evaluate(const Evaluation& e) const override;
  void set_covariance(const Eigen::MatrixXd& covariance) override;

 private:
  PoseMeasurement(PoseChain chain, const Pose& seen);

  PoseChain chain_;
  Pose seen_ = Pose::Identity();
  Matrix6 whitening_ = Matrix6::Identity();  ///< W with W' W = C^-1.
};

}  // namespace kr5::fit
