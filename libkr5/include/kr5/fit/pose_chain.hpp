// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include <kr5/geometry/pose.hpp>

/// @file
/// Along which poses a measurement is made: a product of constants and parameters, from the frame in which something is
/// measured to the frame that is measured.

namespace kr5::fit {

/// A block of parameters of a Problem.
struct FitBlock {
  int index = -1;
  bool exists() const { return index >= 0; }
};

/// A pose on a path, and its rate as a right perturbation [m/s, rad/s].
struct PathSample {
  Pose T = Pose::Identity();
  Vector6 rate = Vector6::Zero();
};
/// A pose as a function of time [s]; empty where the path has none.
using PosePath = std::function<std::optional<PathSample>(double t)>;

/// A product of poses, from the frame in which something is measured to the frame that is measured.
class PoseChain {
 public:
  struct Factor {
    Pose constant = Pose::Identity();
    FitBlock block;             ///< A pose, an arm or the delay of a path; without, the factor is constant.
    bool inverse = false;       ///< Of the pose of the block.
    Eigen::VectorXd q;          ///< Of an arm: joint values [rad or m].
    FitBlock joint_terms;       ///< Of an arm: coefficients c of errors of its joints, q + regressor c; may be absent.
    Eigen::MatrixXd regressor;  ///< Joints x coefficients.
    PosePath path;              ///< Without: a pose, an arm or a constant.
    double t = 0.0;             ///< Of a path, when it was seen [s].
  };

  PoseChain& then(const Pose& T);
  PoseChain& then(FitBlock pose);
  PoseChain& then_inverse(FitBlock pose);
  /// Pose of the flange in frame 0 of the arm, for joint values q.
  PoseChain& then_arm(FitBlock arm, const Eigen::VectorXd& q, FitBlock joint_terms = {},
                      const Eigen::MatrixXd& regressor = {});
  /// Its inverse.
  PoseChain& then_inverse_arm(FitBlock arm, const Eigen::VectorXd& q, FitBlock joint_terms = {},
                              const Eigen::MatrixXd& regressor = {});

  /// Pose of a path at the time t - delay, where `delay` is a block of one number [s]. A measurement for which the path
  /// has no pose bars the fit from going there: leave out those for which it has none at the start.
  PoseChain& then_path(const PosePath& path, double t, FitBlock delay = {});

  const std::vector<Factor>& factors() const { return factors_; }

 private:
  std::vector<Factor> factors_;
};

/// A point of a chain's last frame, or of the world: known, or a block of three coordinates.
struct FitPoint {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  FitBlock block;

  FitPoint() = default;
  FitPoint(const Eigen::Vector3d& known) : value(known) {}  // NOLINT: a known point is a point
  FitPoint(FitBlock unknown) : block(unknown) {}            // NOLINT: so is an unknown one
};

/// A number: known, or a block of one.
struct FitNumber {
  double value = 0.0;
  FitBlock block;

  FitNumber() = default;
  FitNumber(double known) : value(known) {}        // NOLINT: a known number is a number
  FitNumber(FitBlock unknown) : block(unknown) {}  // NOLINT: so is an unknown one
};

}  // namespace kr5::fit
