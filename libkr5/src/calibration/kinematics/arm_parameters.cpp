// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/kinematics/arm_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <kr5/core/linear.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "calibration/kinematics/shifted_axis.hpp"

namespace kr5::calibration {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using kinematics::AxisLine;
using kinematics::DhChain;
using kinematics::DhParameter;

constexpr int numbers_per_axis = 4;

std::vector<AxisLine> lines_of(std::span<const JointAxisResult> axes) {
  std::vector<AxisLine> out;
  for (const JointAxisResult& axis : axes) out.push_back(axis.axis);
  return out;
}

std::vector<ArmParameter> determined_parameters(const DhChain& arm) {
  std::vector<ArmParameter> out;
  for (int k = 0; k + 1 < static_cast<int>(arm.joints.size()); ++k) {
    const kinematics::DhJoint& joint = arm.joints[static_cast<std::size_t>(k)];
    const auto add = [&](DhParameter p) { out.push_back({k, p, kinematics::value_of(joint, p), 0.0}); };
    const bool near = kinematics::has_near_parallel_axes(joint);
    if (k > 0 && !near) add(DhParameter::B);
    add(DhParameter::A);
    add(DhParameter::Alpha);
    if (near) add(DhParameter::Beta);
    if (k > 0) add(DhParameter::Theta);
  }
  return out;
}

/// A limit by which the same neighbours are near-parallel when axes move a little: in the middle between the angles of
/// those that are and those that are not.
double separating_limit(std::span<const AxisLine> lines) {
  double below = 0.0, above = 1.0;
  for (std::size_t k = 0; k + 1 < lines.size(); ++k) {
    const double sine = lines[k].direction.cross(lines[k + 1].direction).norm();
    if (sine < kinematics::near_parallel_sine)
      below = std::max(below, sine);
    else
      above = std::min(above, sine);
  }
  return 0.5 * (below + above);
}

/// Derivatives of the parameters by the four numbers of one axis.
MatrixXd axis_derivatives(std::span<const JointAxisResult> axes, std::size_t k,
                          const std::vector<ArmParameter>& parameters, const VectorXd& home, const Eigen::Vector3d& end,
                          double limit) {
  constexpr double step = 1e-6;  // [m, rad]
  std::vector<AxisLine> lines = lines_of(axes);
  MatrixXd out(static_cast<Eigen::Index>(parameters.size()), numbers_per_axis);
  for (int p = 0; p < numbers_per_axis; ++p) {
    const auto shifted = [&](double by) {
      lines[k] = shifted_axis(axes[k], by * Eigen::Vector4d::Unit(p));
      return arm_of_lines(lines, home, end, limit);
    };
    const DhChain low = shifted(-step), high = shifted(step);
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      const auto joint = static_cast<std::size_t>(parameters[i].joint);
      const DhParameter what = parameters[i].parameter;
      const double change = value_of(high.joints[joint], what) - value_of(low.joints[joint], what);
      out(static_cast<Eigen::Index>(i), p) =
          (is_length(what) ? change : std::remainder(change, 2 * std::numbers::pi)) / (2 * step);
    }
  }
  return out;
}

/// A covariance that is a sum over axes, each with degrees of freedom of its own.
struct CovarianceSum {
  std::vector<MatrixXd> parts;
  std::vector<double> dof;
  MatrixXd sum;

  /// Degrees of freedom behind the sum in some coordinates (Satterthwaite; for vectors Krishnamoorthy and Yu 2004):
  /// rows of W, in which the sum is the unit matrix.
  double effective_dof(const MatrixXd& W) const {
    if (W.rows() == 0) return uncertainty::known_noise;
    double squares = 0.0;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const MatrixXd part = W * parts[k] * W.transpose();
      squares += (part.squaredNorm() + part.trace() * part.trace()) / dof[k];
    }
    const auto numbers = static_cast<double>(W.rows());
    return std::min((numbers + numbers * numbers) / squares, uncertainty::known_noise);
  }
};

CovarianceSum covariance_of_parameters(std::span<const JointAxisResult> axes,
                                       const std::vector<ArmParameter>& parameters, const VectorXd& home,
                                       const Eigen::Vector3d& end, double limit) {
  CovarianceSum out;
  const auto count = static_cast<Eigen::Index>(parameters.size());
  out.sum = MatrixXd::Zero(count, count);
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const MatrixXd J = axis_derivatives(axes, k, parameters, home, end, limit);
    const double inflation = uncertainty::covariance_inflation(numbers_per_axis, axes[k].dof);
    out.parts.emplace_back(J * (axes[k].covariance / inflation) * J.transpose());
    out.dof.push_back(axes[k].dof);
    out.sum += out.parts.back();
  }
  return out;
}

/// Coordinates in which a covariance is the unit matrix: of each combination of numbers about which something is known
/// a row.
MatrixXd whitening_rows(const MatrixXd& covariance) {
  constexpr double least = 1e-12;  // of the largest eigenvalue, with each number over its standard deviation
  const VectorXd std = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const VectorXd scale = (std.array() > 0).select(std.cwiseInverse(), 0.0);
  const SymmetricEigen eigen = symmetric_eigen(scale.asDiagonal() * covariance * scale.asDiagonal());
  const auto kept = static_cast<Eigen::Index>((eigen.values.array() > least * eigen.values.maxCoeff()).count());
  const VectorXd lengths = eigen.values.tail(kept).cwiseSqrt().cwiseInverse();
  return lengths.asDiagonal() * eigen.vectors.rightCols(kept).transpose() * scale.asDiagonal();
}

}  // namespace

DhChain arm_of_lines(std::span<const AxisLine> lines, const VectorXd& home, const Eigen::Vector3d& end,
                     double parallel) {
  Pose flange = Pose::Identity();
  flange.linear() = rotation_from_z(lines.back().direction);
  flange.translation() = end;
  return kinematics::chain_from_axes(lines, home, flange, parallel);
}

ArmParameterEstimate estimate_arm_parameters(std::span<const JointAxisResult> axes, const DhChain& arm,
                                             const VectorXd& home, const Eigen::Vector3d& end) {
  ArmParameterEstimate out{determined_parameters(arm), {}};
  if (out.parameters.empty()) return out;
  const double limit = separating_limit(lines_of(axes));
  const CovarianceSum covariance = covariance_of_parameters(axes, out.parameters, home, end, limit);
  const auto count = static_cast<Eigen::Index>(out.parameters.size());
  for (Eigen::Index i = 0; i < count; ++i) {
    const double std = std::sqrt(covariance.sum(i, i));
    const MatrixXd W = std > 0 ? MatrixXd(MatrixXd::Identity(count, count).row(i) / std) : MatrixXd(0, count);
    out.parameters[static_cast<std::size_t>(i)].std =
        std * std::sqrt(uncertainty::covariance_inflation(1, covariance.effective_dof(W)));
  }
  const double dof = covariance.effective_dof(whitening_rows(covariance.sum));
  out.covariance = uncertainty::covariance_inflation(static_cast<double>(count), dof) * covariance.sum;
  return out;
}

}  // namespace kr5::calibration
