// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/fit/measurement.hpp>

/// @file
/// The circle that a line scanner sees of a sphere.

namespace kr5::fit {

/// The section of a sphere by the plane y = 0 of the chain's first frame; its centre stands in the chain's last.
class SphereSectionMeasurement final : public Measurement {
 public:
  /// `section`: x, z and radius of the circle [m], with their covariance [m^2].
  SphereSectionMeasurement(PoseChain chain, const FitPoint& centre, const FitNumber& radius,
                           const Eigen::Vector3d& section, const Eigen::Matrix3d& covariance);

  int rows() const override { return 3; }
  void declare(BlockUse& use) const override;
  bool evaluate(const Evaluation& e) const override;
  void set_covariance(const Eigen::MatrixXd& covariance) override;

 private:
  PoseChain chain_;
  FitPoint centre_;
  FitNumber radius_;           ///< Of the sphere [m].
  Eigen::Vector3d section_;    ///< [m]
  Eigen::Matrix3d whitening_;  ///< W with W' W = C^-1.
};

}  // namespace kr5::fit
