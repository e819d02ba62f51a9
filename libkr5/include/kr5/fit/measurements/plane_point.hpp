// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/fit/measurement.hpp>

/// @file
/// A point that lies on a plane, such as a tip that touches a table.

namespace kr5::fit {

/// A point of the chain's last frame on the plane z = 0 of its first.
class PlanePointMeasurement final : public Measurement {
 public:
  /// With the standard deviation of its distance from the plane [m].
  PlanePointMeasurement(PoseChain chain, const FitPoint& point, double sigma);

  int rows() const override { return 1; }
  void declare(BlockUse& use) const override;
  bool evaluate(const Evaluation& e) const override;

 private:
  PoseChain chain_;
  FitPoint point_;
  double sigma_ = 0.0;  ///< [m]
};

}  // namespace kr5::fit
