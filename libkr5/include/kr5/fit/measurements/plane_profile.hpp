// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/fit/measurement.hpp>

/// @file
/// Points on a plane whose errors belong together, such as the line that a scanner's profile shows of it.

namespace kr5::fit {

/// Points (3 x n) of the chain's last frame on the plane z = 0 of its first.
class PlaneProfileMeasurement final : public Measurement {
 public:
  /// With the covariance of their distances from the plane [m^2].
  PlaneProfileMeasurement(PoseChain chain, Eigen::Matrix3Xd points, const Eigen::MatrixXd& covariance);

  int rows() const override { return static_cast<int>(points_.cols()); }
  void declare(BlockUse& use) const override { use.chain(chain_); }
  bool evaluate(const Evaluation& e) const override;
  void set_covariance(const Eigen::MatrixXd& covariance) override;

 private:
  PoseChain chain_;
  Eigen::Matrix3Xd points_;    ///< [m]
  Eigen::MatrixXd whitening_;  ///< W with W' W = C^-1.
};

}  // namespace kr5::fit
