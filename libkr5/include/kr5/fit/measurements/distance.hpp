// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/fit/measurement.hpp>

/// @file
/// The distance of two points, such as a ball bar holds or a sphere keeps.

namespace kr5::fit {

/// The distance of a point of the chain's last frame from a point of its first. A distance that is a block is one that
/// several measurements share: points on a sphere.
class DistanceMeasurement final : public Measurement {
 public:
  DistanceMeasurement(PoseChain chain, const FitPoint& point, const FitPoint& other, const FitNumber& distance,
                      double sigma);

  int rows() const override { return 1; }
  void declare(BlockUse& use) const override;
  bool evaluate(const Evaluation& e) const override;

 private:
  PoseChain chain_;
  FitPoint point_, other_;
  FitNumber distance_;  ///< [m]
  double sigma_ = 0.0;  ///< [m]
};

}  // namespace kr5::fit
