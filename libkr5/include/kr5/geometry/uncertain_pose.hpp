// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// Propagation of uncertainty through chains of poses and through functions (Hayat et al. 2022, sections 3.2.1
/// and 3.4).

namespace kr5 {

/// A pose with the covariance of its error, a right perturbation [m, rad].
struct UncertainPose {
  Pose T = Pose::Identity();
  Matrix6 covariance = Matrix6::Zero();  ///< [m, rad]

  static void each_field(auto& self, auto&& visit) {
    visit("T", self.T, "Pose.");
    visit("covariance", self.covariance,
          covariance_doc("T", "Covariance of its error, right perturbation, linear first [m, rad]."));
  }
};

/// T_a_c from T_a_b and T_b_c, whose errors are independent, to first order.
UncertainPose operator*(const UncertainPose& T_a_b, const UncertainPose& T_b_c);
/// T_b_a from T_a_b.
UncertainPose inverse(const UncertainPose& T_a_b);

/// The product of a chain of poses whose errors are independent: to first order, and by the unscented transform over
/// the errors of all of them, of which the pose is the mean.
/// @throws InvalidArgument for none, or where one has no covariance, with its number and the offending eigenvalue.
UncertainPose propagate_chain(std::span<const UncertainPose> chain);
UncertainPose propagate_chain_unscented(std::span<const UncertainPose> chain);

/// Covariance of the product, to first order, by the error of each pose of a chain alone.
/// @throws InvalidArgument as propagate_chain.
std::vector<Matrix6> chain_contributions(std::span<const UncertainPose> chain);
/// Largest change of a standard deviation from the first to the second covariance, over that of the first; axes without
/// error in the first are left out [-]. Of a first order and an unscented one: what the first order leaves out.
double deviation_change(const Matrix6& first, const Matrix6& second);

/// A quantity with the covariance of its error.
struct UncertainVector {
  Eigen::VectorXd value;
  Eigen::MatrixXd covariance;

  static void each_field(auto& self, auto&& visit) {
    visit("value", self.value, "Value.");
    visit("covariance", self.covariance,
          covariance_doc("value", "Covariance of its error, in the units of the value."));
  }
};

/// The point p_a = T_a_b p_b [m], to first order: R C_p R^T + C_t, and with `rotation_errors` the part by the lever arm
/// of the rotation's error, which eq. 3.49 and 3.61 leave out (a tenth of a degree moves a point at 0.34 m by 0.6 mm).
UncertainVector transform_point(const UncertainPose& T_a_b, const Eigen::Vector3d& p_b,
                                const Eigen::Matrix3d& covariance, bool rotation_errors = true);

/// f of a normal variable, to first order: J C J^T with J by central differences (eq. 3.12).
UncertainVector propagate(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& f, const Eigen::VectorXd& mean,
                          const Eigen::MatrixXd& covariance);
/// f of a normal variable by the unscented transform (Julier and Uhlmann 2004): exact for f of second order in the
/// mean.
UncertainVector propagate_unscented(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& f,
                                    const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance);

/// The most probable value of independent measurements of one quantity, (sum C_i^-1)^-1: what camera and scanner say of
/// one point (section 3.4.4; the covariance printed as eq. 3.69 has a negative variance and is none).
/// @throws InvalidArgument for none, sizes that differ, or a covariance that is not positive definite.
UncertainVector fuse(std::span<const UncertainVector> measurements);

/// Why a matrix is no covariance, the offending eigenvalue with it; empty when it is one: finite, symmetric and without
/// a negative eigenvalue, but for rounding by `tolerance` of its largest entry. The printed covariances of the source
/// are not all.
std::string covariance_defect(const Eigen::MatrixXd& matrix, double tolerance = 1e-9);
bool is_covariance(const Eigen::MatrixXd& matrix);

}  // namespace kr5
