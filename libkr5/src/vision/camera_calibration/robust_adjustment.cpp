// SPDX-License-Identifier: BSD-3-Clause
#include "vision/camera_calibration/robust_adjustment.hpp"

#include <algorithm>
#include <cmath>

#include <kr5/core/statistics.hpp>

namespace kr5::vision::detail {
namespace {

constexpr double huber_threshold = 3.0;          // in sigma, of the length of a residual
constexpr double huber_consistency = 0.994;      // E[w |e|^2] / 2 sigma^2 of normal noise under that threshold
constexpr double clipped_consistency = 0.98889;  // E[min(|e|^2, 9 sigma^2)] / 2 sigma^2 of normal noise
constexpr double prior_freedom = 20.0;           // a view's own noise is drawn to that of all with this many residuals

/// Point weights over the squared noise of the view, from the residuals at the present state.
void update_weights(const CameraProblem& problem, const std::vector<bool>& used, bool robust, double lost,
                    RobustAdjustment& fit) {
  const std::size_t count = problem.views.size();
  std::vector<Eigen::Matrix2Xd> e(count);
  std::vector<double> noise;
  for (std::size_t i = 0; i < count; ++i) {
    fit.weights[i].resize(0);
    fit.view_noise[i] = 0;
    if (!used[i]) continue;
    e[i] = residuals(problem, fit.adjustment.state(), i);
    if (e[i].cols() == 0) continue;
    fit.view_noise[i] = std::max(noise_of(e[i], robust, lost), 1e-9);
    noise.push_back(fit.view_noise[i]);
  }
  if (noise.empty()) return;
  const double common = median(noise);
  for (std::size_t i = 0; i < count; ++i) {
    if (!used[i] || e[i].cols() == 0) continue;
    const double freedom = std::max(2.0 * double(e[i].cols()) - lost, 1.0), own = fit.view_noise[i];
    const double drawn = (freedom * own * own + prior_freedom * common * common) / (freedom + prior_freedom);
    if (robust)
      fit.weights[i] = huber_weights(e[i], std::sqrt(drawn)) / drawn;
    else
      fit.weights[i].setConstant(e[i].cols(), 1 / (common * common));
  }
}

/// Noise per axis of all points together, and the scale by which the weights were too confident.
void measure_noise(const CameraProblem& problem, Eigen::Index free, bool robust, RobustAdjustment& fit) {
  double whitened = 0, squared = 0, freedom = -double(free);
  fit.points = 0;
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    if (!fit.weights[i].size()) continue;
    const Eigen::VectorXd length2 = residuals(problem, fit.adjustment.state(), i).colwise().squaredNorm().transpose();
    const Eigen::VectorXd within = fit.weights[i] / fit.weights[i].maxCoeff();
    whitened += length2.dot(fit.weights[i]);
    squared += length2.dot(within);
    freedom += 2.0 * double(length2.size()) - 6;
    fit.points += int(length2.size());
  }
  if (!(freedom > 0)) return;
  const double consistency = robust ? huber_consistency : 1.0;
  fit.sigma = std::sqrt(squared / freedom / consistency);
  const double scale = freedom * consistency / whitened;
  for (Eigen::VectorXd& w : fit.weights) w *= scale;
  fit.adjustment.set_weights(fit.weights);
}

}  // namespace

double noise_of(const Eigen::Matrix2Xd& e, bool robust, double lost) {
  const double n = 2.0 * double(e.cols()), correction = n / std::max(n - lost, 1.0);
  if (!robust) return std::sqrt(e.squaredNorm() / n * correction);
  std::vector<double> size(static_cast<std::size_t>(e.size()));
  for (std::size_t i = 0; i < size.size(); ++i) size[i] = std::abs(e.data()[i]);
  double sigma = mad_to_sigma * median(size) + 1e-12;
  for (int k = 0; k < 3; ++k) {  // lengths beyond the threshold count as the threshold: wrong points hardly matter
    const double limit = huber_threshold * huber_threshold * sigma * sigma;
    sigma = std::sqrt(e.colwise().squaredNorm().cwiseMin(limit).sum() / n / clipped_consistency) + 1e-12;
  }
  return sigma * std::sqrt(correction);
}

Eigen::VectorXd huber_weights(const Eigen::Matrix2Xd& e, double sigma) {
  return (huber_threshold * sigma / e.colwise().norm().array().max(1e-12)).min(1.0).matrix().transpose();
}

double huber_cost(const Eigen::Matrix2Xd& e, double sigma) {
  const Eigen::ArrayXd size = e.colwise().norm().transpose() / sigma;
  return (size < huber_threshold)
      .select(size.square(), 2 * huber_threshold * size - huber_threshold * huber_threshold)
      .sum();
}

RobustAdjustment adjust_robustly(const CameraProblem& problem, const CameraModel& model, const CameraState& start,
                                 const std::vector<bool>& used, bool robust, int rounds) {
  const Eigen::MatrixXd basis = free_basis(model);
  const double views = double(std::count(used.begin(), used.end(), true));
  const double lost = 6 + double(basis.cols()) / std::max(views, 1.0);
  RobustAdjustment fit{.adjustment{problem, model, start}, .weights{}, .view_noise{}, .zoom{}};
  fit.zoom = basis.topRows<2>().colwise().sum().transpose();
  fit.weights.resize(problem.views.size());
  fit.view_noise.resize(problem.views.size());
  for (int round = 0; round < (robust ? std::max(rounds, 1) : 1); ++round) {
    update_weights(problem, used, robust, lost, fit);
    fit.adjustment.set_weights(fit.weights);
    if (rounds > 0) fit.adjustment.minimise();
  }
  measure_noise(problem, basis.cols(), robust, fit);
  return fit;
}

}  // namespace kr5::vision::detail
