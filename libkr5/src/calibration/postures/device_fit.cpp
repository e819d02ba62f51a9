// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/postures/device_fit.hpp"

#include <algorithm>
#include <cmath>

#include <kr5/core/linear.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/geometry/point_alignment.hpp>
#include <kr5/uncertainty/confidence.hpp>

namespace kr5::calibration {
namespace {

constexpr int device_rounds = 60;            // of device and tip in turn
constexpr double half_weight_at = 3.0;       // medians of the distance at which a place has half its weight
constexpr double scale_rank = 1e-9;          // of what the places tell
constexpr Eigen::Index device_numbers = 10;  // numbers that are fitted: rotation, shift and scale of the device, tip

Eigen::VectorXd tip_distances(const Eigen::Matrix3Xd& places, const Eigen::Matrix3Xd& model) {
  return (places - model).colwise().norm().transpose();
}

double middle_distance(const Eigen::VectorXd& values) { return midpoint_median({values.begin(), values.end()}); }

/// Tip that agrees best with places in the base.
Eigen::Vector3d tip_of_places(const std::vector<Pose>& flanges, const Eigen::Matrix3Xd& places,
                              const Eigen::VectorXd& w) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < places.cols(); ++i)
    sum += w[i] * (flanges[static_cast<std::size_t>(i)].inverse() * Eigen::Vector3d(places.col(i)));
  return sum / w.sum();
}

/// Standard deviation of the scale, from the residuals and from how the places tell it from device and tip.
double std_of_scale(const DeviceFit& fit, const std::vector<Pose>& flanges, const Eigen::VectorXd& w) {
  const Eigen::Matrix3Xd model = tip_places(flanges, fit.tip);
  const Eigen::Vector3d centre = model * w / w.sum();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(device_numbers, device_numbers);
  for (Eigen::Index i = 0; i < model.cols(); ++i) {
    const Eigen::Vector3d arm = model.col(i) - centre;
    Eigen::Matrix<double, 3, device_numbers> J;
    J << Eigen::Matrix3d::Identity(), -skew(arm), arm, flanges[static_cast<std::size_t>(i)].linear();
    information += w[i] * J.transpose() * J;
  }
  const double dof = std::max(1.0, 3.0 * static_cast<double>(model.cols()) - static_cast<double>(device_numbers));
  const double variance =
      (fit.places - model).colwise().squaredNorm().dot(w) / w.sum() * static_cast<double>(model.cols()) / dof;
  return fit.scale *
         std::sqrt(uncertainty::covariance_inflation(1, dof) * variance * covariance_of(information, scale_rank)(6, 6));
}

}  // namespace

Eigen::Matrix3Xd tip_places(const std::vector<Pose>& flanges, const Eigen::Vector3d& tip) {
  Eigen::Matrix3Xd out(3, static_cast<Eigen::Index>(flanges.size()));
  for (std::size_t i = 0; i < flanges.size(); ++i) out.col(static_cast<Eigen::Index>(i)) = flanges[i] * tip;
  return out;
}

DeviceFit fit_device(const std::vector<Pose>& flanges, const Eigen::Matrix3Xd& places, bool free_scale) {
  DeviceFit out;
  Eigen::VectorXd w = Eigen::VectorXd::Ones(places.cols());
  for (int round = 0; round < device_rounds; ++round) {
    const PointAlignment device =
        align_points(tip_places(flanges, out.tip), places, {.scale = free_scale, .weights = w});
    out.T_device_base = device.T_to_from, out.scale = device.scale;
    out.places = out.T_device_base.linear().transpose() * (places.colwise() - out.T_device_base.translation()) /
                 std::max(out.scale, 1e-12);
    out.tip = tip_of_places(flanges, out.places, w);
    const Eigen::VectorXd d = tip_distances(out.places, tip_places(flanges, out.tip));
    out.misfit = middle_distance(d);
    w = (1 + (d / std::max(out.misfit, 1e-12) / half_weight_at).array().square()).inverse();
  }
  if (free_scale) out.scale_std = std_of_scale(out, flanges, w);
  return out;
}

}  // namespace kr5::calibration
