// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include <kr5/calibration/kinematics.hpp>
#include <kr5/fit/pipeline/pipeline.hpp>
#include <kr5/fit/problem.hpp>

/// @file
/// Private: the fit of a kinematic calibration, built anew for each set of standard deviations.

namespace kr5::calibration::arm_problem {

/// Standard deviations of measurements and of true parameters about the nominal ones.
struct Sigmas {
  double position = 5e-3;    ///< [m]
  double rotation = 5e-3;    ///< [rad]
  double length = 2e-3;      ///< [m]
  double angle = 3e-3;       ///< [rad]
  double joint = 3e-4;       ///< Of a coefficient of the joint errors [rad].
  double compliance = 1e-5;  ///< Of the compliance of a joint [rad/(N m)].
  double pixel = 1.0;        ///< [px]
};

/// Where base, tool and sockets are before the arm is refined.
struct Placement {
  Pose T_world_base = Pose::Identity();
  Pose T_flange_tool = Pose::Identity();
  Eigen::Matrix3Xd points;   ///< On the flange.
  Eigen::Matrix3Xd sockets;  ///< In the base.
  Pose T_flange_camera = Pose::Identity();
  Pose T_base_target = Pose::Identity();
};

/// Whether a point is seen, with all three coordinates.
inline bool any_seen(const Eigen::Matrix3Xd& points) {
  return points.cols() > 0 && points.array().isFinite().colwise().all().any();
}

struct Input {
  const kinematics::DhChain& nominal;
  std::span<const ArmPosture> postures;
  std::span<const SocketDistance> distances;
  const KinematicsOptions& options;
  std::vector<std::string> socket_names;

  bool any_pose() const;
  bool any_point() const;
  bool any_view() const;
  int markers() const;  ///< Points on the tool, that in the sockets included.
  std::size_t socket(const std::string& name) const;
};

struct ArmProblem {
  fit::Problem fit;
  fit::FitBlock arm, base, tool, joint_terms, camera, lens, target;
  std::vector<fit::FitBlock> points, sockets;
  std::vector<std::vector<fit::FitMeasurement>> observations;  ///< Of poses and points, by posture.
  std::vector<std::vector<fit::FitMeasurement>> views;         ///< Of pixels, by posture.
  std::vector<fit::FitMeasurement> distances;                  ///< Of sockets.

  /// @param refine False: the arm is held at its nominal parameters.
  ArmProblem(const Input& input, const Sigmas& sigmas, const Placement& placement, bool refine);
  /// Begins where another one ended.
  void begin_at(const ArmProblem& other);
  void set_weights(const std::vector<double>& weights);
  Placement placement() const;
  /// Everything that was measured of a posture.
  std::vector<fit::FitMeasurement> of_posture(std::size_t i) const;

 private:
  void observe_posture(const Input& input, const ArmPosture& posture, const Sigmas& sigmas);
};

/// Places of base, tool and sockets from which the search for the right ones begins.
std::vector<Placement> starts(const Input& input);
/// The nominal arm placed as well as it allows, from a start on, and its median squared residual; postures may
/// contradict. Of many postures some are enough.
fit::pipeline::Minimum<Placement> descend(const Input& input, Placement start);
/// The same with all postures, and the noise that they then show.
Placement place_at(const Input& input, const Placement& start, Sigmas& sigmas);

/// Sets the standard deviations of the measurements by a scale that outliers do not move.
void robust_sigmas(const ArmProblem& problem, Sigmas& sigmas);

/// What the four coefficients of a joint's error are multiplied with at joint value q: once and twice a turn, 0 at
/// q = 0.
Eigen::RowVector4d joint_error_basis(double q);
/// What joint terms change the joint values by at a posture: four columns a revolute joint where errors of the joints
/// are estimated, then one a joint where its compliance is.
Eigen::MatrixXd joint_term_regressor(const Input& input, const ArmPosture& posture);

}  // namespace kr5::calibration::arm_problem
