// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/current_model.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <Eigen/Cholesky>

#include <kr5/core/error.hpp>

namespace kr5::identification {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr Index min_current_samples = 10;
constexpr double min_pivot = 1e-6;  // of the scaled normal equations
constexpr double sure = 3.0;        // standard deviations by which a torque must show in the current

double direction_of(double speed, double standstill) {
  return std::abs(speed) <= standstill ? 0.0 : (speed > 0 ? 1.0 : -1.0);
}

}  // namespace

void CurrentModelOptions::validate() const {
  require(standstill >= 0 && std::isfinite(standstill), "standstill must not be negative [rad/s or m/s]");
}

double CurrentModel::current(double torque, double speed) const {
  return torque / torque_constant + offset + direction_of(speed, standstill) * hysteresis;
}

double CurrentModel::torque(double current, double speed) const {
  return (current - offset - direction_of(speed, standstill) * hysteresis) * torque_constant;
}

CurrentModel identify_current_model(const VectorXd& current, const VectorXd& torque, const VectorXd& speed,
                                    const CurrentModelOptions& options) {
  options.validate();
  const Index n = current.size();
  require(torque.size() == n && speed.size() == n, "current, torque, speed: found " + std::to_string(n) + ", " +
                                                       std::to_string(torque.size()) + " and " +
                                                       std::to_string(speed.size()) + " samples, expected as many");
  require(current.allFinite() && torque.allFinite() && speed.allFinite(),
          "current, torque, speed: a number is not finite");
  CurrentModel out;
  out.standstill = options.standstill;
  if (n < min_current_samples) {
    out.fit.message = std::to_string(n) + " samples, expected at least " + std::to_string(min_current_samples);
    return out;
  }
  Eigen::Matrix<double, Eigen::Dynamic, 3> X(n, 3);
  X.col(0) = torque;
  X.col(1).setOnes();
  X.col(2) = speed.unaryExpr([&](double v) { return direction_of(v, options.standstill); });
  const Eigen::Matrix3d normal = X.transpose() * X;
  const Eigen::Vector3d scale = normal.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<Eigen::Matrix3d> factors(Eigen::Matrix3d(scale.asDiagonal() * normal * scale.asDiagonal()));
  if (!scale.allFinite() || !(factors.vectorD().minCoeff() > min_pivot)) {
    out.fit.message =
        "torque and direction do not vary apart from each other; move the joint both ways, through "
        "different torques";
    return out;
  }
  const Eigen::Matrix3d inverse = scale.asDiagonal() * factors.solve(Eigen::Matrix3d::Identity()) * scale.asDiagonal();
  const Eigen::Vector3d x = inverse * (X.transpose() * current);
  const VectorXd residual = current - X * x;
  const double variance = residual.squaredNorm() / static_cast<double>(n - 3);
  const double r = residual.head(n - 1).dot(residual.tail(n - 1)) / std::max(residual.squaredNorm(), 1e-300);
  const double correlated = std::clamp(r, 0.0, 0.99);
  const Eigen::Matrix3d covariance = variance * (1 + correlated) / (1 - correlated) * inverse;
  if (std::abs(x[0]) < sure * std::sqrt(covariance(0, 0))) {
    out.fit.message = "the current does not show the torque";
    return out;
  }
  out.torque_constant = 1 / x[0];
  out.offset = x[1];
  out.hysteresis = x[2];
  out.sigma = std::sqrt(variance);
  const Eigen::Vector3d slope(-1 / (x[0] * x[0]), 1.0, 1.0);
  out.covariance = slope.asDiagonal() * covariance * slope.asDiagonal();
  out.fit = {FitStatus::Converged, 1, std::sqrt((current.array() - current.mean()).square().mean()) / out.sigma, 1.0,
             "least squares"};
  return out;
}

}  // namespace kr5::identification
