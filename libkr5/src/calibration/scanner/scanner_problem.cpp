// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/scanner/scanner_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <kr5/fit/measurements/plane_profile.hpp>
#include <kr5/fit/measurements/position.hpp>
#include <kr5/fit/measurements/sphere_section.hpp>
#include <kr5/geometry/pose.hpp>

#include "calibration/parameters/arm_prior.hpp"

namespace kr5::calibration::scanner_problem {
namespace {

const double unlimited = std::numeric_limits<double>::infinity();

/// Derivative of the residuals of a view by a motion of what it shows, in axes of the scanner.
Eigen::MatrixXd by_motion(const ScannerInput& input, std::size_t view, const ScannerPlacement& placement) {
  const ProfileFeature& feature = input.views[view].feature;
  const TargetPlacement& target = placement.targets[input.target_of[view]];
  const Pose T_base_scanner = input.T_base_flange[view] * placement.T_flange_scanner;
  Eigen::MatrixXd out = Eigen::MatrixXd::Identity(3, 3);
  if (feature.kind == ScanTargetKind::Sphere) {
    const double beside = (T_base_scanner.inverse() * target.position).y();
    out.row(1) = Eigen::RowVector3d::UnitZ();
    out.row(2) = Eigen::RowVector3d(0.0, -beside / feature.radius, 0.0);
  } else if (feature.kind == ScanTargetKind::Plane) {
    out = Eigen::MatrixXd(2, 3);
    out.rowwise() = target.T_base_plane.linear().col(2).transpose() * T_base_scanner.linear();
  }
  return out;
}

/// Covariance of the residuals of a view by the error of the profile.
Eigen::MatrixXd profile_covariance(const ProfileFeature& feature, const Eigen::MatrixXd& J,
                                   const ScannerSigmas& sigmas) {
  const bool tip = feature.kind == ScanTargetKind::Tip;
  const Eigen::Vector3d spread(sigmas.position, tip ? sigmas.across : sigmas.position, sigmas.position);
  return J * spread.cwiseAbs2().asDiagonal() * J.transpose();
}

/// Covariance of the residuals of a view, that of its feature included.
Eigen::MatrixXd residual_covariance(const ScannerInput& input, std::size_t view, const ScannerSigmas& sigmas,
                                    const ScannerPlacement& placement, Eigen::VectorXd& share) {
  const ProfileFeature& feature = input.views[view].feature;
  const Eigen::MatrixXd J = by_motion(input, view, placement);
  const bool tip = feature.kind == ScanTargetKind::Tip;
  const Eigen::MatrixXd of_profile = profile_covariance(feature, J, sigmas);
  Eigen::MatrixXd out = of_profile;
  if (sigmas.rotation > 0) {  // of the flange, at the lever arm of what is seen
    const Eigen::Matrix3d to_scanner = placement.T_flange_scanner.linear().transpose();
    for (Eigen::Index k = 0; k < feature.points.cols(); ++k) {
      const Eigen::MatrixXd lever =
          J * to_scanner * skew(placement.T_flange_scanner * in_scanner(feature.points.col(k)));
      if (feature.kind == ScanTargetKind::Plane)
        out(k, k) += std::pow(sigmas.rotation, 2) * lever.row(k).squaredNorm();
      else
        out += std::pow(sigmas.rotation, 2) * lever * lever.transpose();
    }
  }
  if (tip) {
    const Eigen::Index axis[] = {0, 2};
    for (int r = 0; r < 2; ++r)
      for (int c = 0; c < 2; ++c) out(axis[r], axis[c]) += feature.covariance(r, c);
  } else if (feature.kind == ScanTargetKind::Sphere) {
    out += feature.covariance;
  } else {
    out += std::max(1 - J(0, 1) * J(0, 1), 1e-3) *
           feature.covariance;  // across the line in the profile, seen from the plane
  }
  out.diagonal() = (1 + 1e-9) * out.diagonal().array() + 1e-18;  // also where a start is far off
  share = of_profile.diagonal().cwiseQuotient(out.diagonal());
  return out;
}

/// The block of a target: held where it is known, with a prior where it is known with a tolerance.
fit::FitBlock add_target(fit::Problem& fit, const ScanTarget& target, const TargetPlacement& at) {
  if (target.kind == ScanTargetKind::Plane) {
    const fit::FitBlock plane = fit.add_pose(target.name, at.T_base_plane);
    for (const int own : {0, 1, 5}) fit.hold(plane, own);  // motions in the plane change nothing
    if (!target.position) return plane;
    if (target.sigma > 0) {
      Vector6 sigma = Vector6::Constant(unlimited);
      sigma[2] = target.sigma;
      fit.set_prior(plane, sigma);
    } else {
      fit.hold(plane, 2);
    }
    for (const int tilt : {3, 4}) fit.hold(plane, tilt);
    return plane;
  }
  const fit::FitBlock point = fit.add_point(target.name, at.position);
  if (target.position && target.sigma > 0) fit.set_prior(point, Eigen::Vector3d::Constant(target.sigma));
  if (target.position && !(target.sigma > 0)) fit.hold(point);
  return point;
}

}  // namespace

ScannerProblem::ScannerProblem(const ScannerInput& input, const ScannerSigmas& sigmas,
                               const ScannerPlacement& placement) {
  if (input.arm) {
    arm = fit.add_arm("arm", *input.arm);
    parameters::free_arm(fit, arm, *input.arm, sigmas.length, sigmas.angle);
  }
  static_cast<ScannerBlocks&>(*this) = add_scanner(fit, arm, input, sigmas, placement);
}

ScannerBlocks add_scanner(fit::Problem& fit, fit::FitBlock arm, const ScannerInput& input, const ScannerSigmas& sigmas,
                          const ScannerPlacement& placement) {
  ScannerBlocks out;
  out.scanner = fit.add_pose("scanner", placement.T_flange_scanner);
  for (std::size_t k = 0; k < input.targets.size(); ++k) {
    const ScanTarget& target = input.targets[k];
    out.targets.push_back(add_target(fit, target, placement.targets[k]));
    out.radii.emplace_back();
    if (target.kind == ScanTargetKind::Sphere && !(target.radius > 0))
      out.radii.back() = fit.add_vector(target.name + ".radius",
                                        Eigen::VectorXd::Constant(1, placement.targets[k].radius), {"radius [m]"});
  }
  for (std::size_t i = 0; i < input.views.size(); ++i) {
    const ScannerView& view = input.views[i];
    const ProfileFeature& feature = view.feature;
    const std::size_t at = input.target_of[i];
    const Eigen::MatrixXd covariance = residual_covariance(input, i, sigmas, placement, out.shares.emplace_back());
    out.factors.push_back(covariance.llt().matrixL());
    fit::PoseChain to_scanner, to_plane;
    if (feature.kind == ScanTargetKind::Plane) to_plane.then_inverse(out.targets[at]);
    to_scanner.then_inverse(out.scanner);
    if (arm.exists()) {
      to_scanner.then_inverse_arm(arm, view.q);
      to_plane.then_arm(arm, view.q);
    } else {
      to_scanner.then(input.T_base_flange[i].inverse());
      to_plane.then(input.T_base_flange[i]);
    }
    to_plane.then(out.scanner);
    switch (feature.kind) {
      case ScanTargetKind::Tip:
        out.observations.push_back(fit.add(fit::PositionMeasurement(
            to_scanner, out.targets[at], in_scanner(feature.points.col(0)), Eigen::Matrix3d(covariance))));
        break;
      case ScanTargetKind::Sphere:
        out.observations.push_back(fit.add(fit::SphereSectionMeasurement(
            to_scanner, out.targets[at],
            out.radii[at].exists() ? fit::FitNumber(out.radii[at]) : fit::FitNumber(placement.targets[at].radius),
            {feature.points(0, 0), feature.points(1, 0), feature.radius}, covariance)));
        break;
      case ScanTargetKind::Plane:
        Eigen::Matrix3Xd points(3, 2);
        points << in_scanner(feature.points.col(0)), in_scanner(feature.points.col(1));
        out.observations.push_back(fit.add(fit::PlaneProfileMeasurement(to_plane, points, covariance)));
        break;
    }
  }
  return out;
}

void ScannerBlocks::begin_at(fit::Problem& fit, const ScannerBlocks& others, const fit::Problem& of_others) const {
  fit.begin_at(scanner, of_others.values(others.scanner));
  for (std::size_t k = 0; k < targets.size(); ++k) {
    fit.begin_at(targets[k], of_others.values(others.targets[k]));
    if (radii[k].exists()) fit.begin_at(radii[k], of_others.values(others.radii[k]));
  }
}

void ScannerProblem::begin_at(const ScannerProblem& other) {
  ScannerBlocks::begin_at(fit, other, other.fit);
  if (arm.exists()) fit.begin_at(arm, other.fit.values(other.arm));
}

void ScannerProblem::set_weights(const std::vector<double>& weights) {
  for (std::size_t i = 0; i < observations.size(); ++i) fit.set_weight(observations[i], weights[i]);
}

ScannerPlacement ScannerProblem::placement(const ScannerInput& input) const {
  ScannerPlacement out;
  out.T_flange_scanner = fit.pose(scanner);
  for (std::size_t k = 0; k < targets.size(); ++k) {
    TargetPlacement& at = out.targets.emplace_back();
    const ScanTarget& target = input.targets[k];
    if (target.kind == ScanTargetKind::Plane) {
      at.T_base_plane = fit.pose(targets[k]);
      at.position = at.T_base_plane.translation();
    } else {
      at.position = fit.values(targets[k]);
    }
    at.radius = radii[k].exists() ? std::abs(fit.values(radii[k])[0]) : target.radius;
  }
  return out;
}

Eigen::VectorXd ScannerProblem::residuals(std::size_t view) const {
  return factors[view] * fit.residuals(observations[view]);
}

double ScannerProblem::distance(std::size_t view) const {
  const Eigen::VectorXd r = residuals(view);
  return r.size() == 2 ? r.norm() / std::sqrt(2.0) : r.norm();
}

}  // namespace kr5::calibration::scanner_problem
