// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/fit/measurement.hpp>

/// @file
/// The place of a point, such as a tracker gives of a ball or a tip that touches a socket.

namespace kr5::fit {

/// The place of a point of the chain's last frame, in its first; `seen` may be a block: a place that several
/// measurements share.
class PositionMeasurement final : public Measurement {
 public:
  /// With a standard deviation per axis [m].
  PositionMeasurement(PoseChain chain, const FitPoint& point, const FitPoint& seen, double sigma);
  /// With a covariance [m^2].
  PositionMeasurement(PoseChain chain, const FitPoint& point, const FitPoint& seen, const Eigen::Matrix3d& covariance);

  int rows() const override { return 3; }
  void declare(BlockUse& use) const override;
  bool evaluate(const Evaluation& e) const override;
  void set_covariance(const Eigen::MatrixXd& covariance) override;

 private:
  PoseChain chain_;
  FitPoint point_, seen_;
  Eigen::Matrix3d whitening_;  ///< W with W' W = C^-1.
};

}  // namespace kr5::fit
