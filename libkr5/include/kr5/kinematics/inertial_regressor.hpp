// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/kinematics/body.hpp>
#include <kr5/kinematics/dh_chain.hpp>
#include <kr5/kinematics/newton_euler.hpp>

/// @file
/// Joint torques of a chain as a linear function of the standard inertial parameters of its links (Hayat et al. 2022,
/// eqs. 4.19-4.20 and 4.29-4.31).

namespace kr5::kinematics {

constexpr int inertial_parameter_count = 10;
/// The standard inertial parameters of one link, as a vector: m, m cx, m cy, m cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz, with
/// the inertia about the origin of the link frame [kg, kg m, kg m^2].
using InertialParameters = Eigen::Matrix<double, inertial_parameter_count, 1>;

InertialParameters inertial_parameters(const Moments& moments);
InertialParameters inertial_parameters(const Body& body);
/// Inverse of `inertial_parameters`.
Moments to_moments(const InertialParameters& parameters);

/// Regressor Y with tau = Y chi, where chi has the InertialParameters of link 1, then those of link 2, and so on. It is
/// the derivative of `Dynamics::torques` by them. Copies are independent; one object is for one thread.
class InertialRegressor {
 public:
  /// @param gravity In B [m/s^2].
  explicit InertialRegressor(const DhChain& chain, const Eigen::Vector3d& gravity = {0.0, 0.0, -9.81});

  int joints() const { return arm_.joints(); }
  /// Columns of Y, 10 a link.
  int parameters() const { return inertial_parameter_count * joints(); }

  /// Y of one sample (n x 10n), of which the blocks below the diagonal are zero. Allocates nothing.
  /// @throws InvalidArgument when a size is wrong.
  void evaluate(const Eigen::Ref<const Eigen::VectorXd>& q, const Eigen::Ref<const Eigen::VectorXd>& qd,
                const Eigen::Ref<const Eigen::VectorXd>& qdd, Eigen::Ref<Eigen::MatrixXd> Y);
  /// Y of every row of q, qd and qdd (N x n), stacked: (N n) x 10n, row k n + i of sample k and joint i. Allocates only
  /// the result.
  /// @throws InvalidArgument when a size is wrong.
  Rows evaluate(const Eigen::Ref<const Rows>& q, const Eigen::Ref<const Rows>& qd, const Eigen::Ref<const Rows>& qdd);

 private:
  /// Velocity of a link frame's origin, and of the frame, for a unit rate of one joint; in axes of that frame.
  struct UnitTwist {
    Eigen::Vector3d v = Eigen::Vector3d::Zero(), w = Eigen::Vector3d::Zero();
  };

  /// Writes element (i, c) to out[i * row_step + c * column_step], where there was 0 below the diagonal.
  void write(const double* q, const double* qd, const double* qdd, double* out, Eigen::Index row_step,
             Eigen::Index column_step);

  Dynamics arm_;                   ///< Massless; moves the link frames.
  std::vector<UnitTwist> twists_;  ///< Of the link at hand, one a joint.
};

}  // namespace kr5::kinematics
