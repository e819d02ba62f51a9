// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/sim/scene.hpp>

namespace kr5::sim {

/// Reference of the joints that the controller of a scene follows.
class SceneReference {
 public:
  /// @throws InvalidArgument naming the field: places the arm cannot take, joints beyond their limits, way points that
  ///         last longer than the scene.
  SceneReference(const Scene& scene, const cell::Cell& cell);

  Eigen::VectorXd at(double t) const;
  const Eigen::VectorXd& start() const { return start_; }
  /// Ends of the rests at the way points [s].
  std::vector<double> rests() const;

 private:
  double progress(double t) const;

  const Controller& c_;
  Eigen::VectorXd start_;
  std::vector<Eigen::VectorXd> postures_;
};

}  // namespace kr5::sim
