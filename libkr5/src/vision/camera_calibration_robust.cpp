// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <tuple>

#include <Eigen/Cholesky>

#include <kr5/core/linear.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "camera_calibration_detail.hpp"

namespace kr5::vision::detail {
namespace {

constexpr double huber_threshold = 3.0;          // in sigma, of the length of a residual
constexpr double huber_consistency = 0.994;      // E[w |e|^2] / 2 sigma^2 of normal noise under that threshold
constexpr double clipped_consistency = 0.98889;  // E[min(|e|^2, 9 sigma^2)] / 2 sigma^2 of normal noise
constexpr double prior_freedom = 20.0;           // a view's own noise is drawn to that of all with this many residuals
constexpr double false_dispersion = 0.001;       // chance to widen the doubts of a sound set
constexpr double noisy_ratio = 3.0;              // a view this much noisier than the others is named

/// Point weights over the squared noise of the view, from the residuals at `state`.
void update_weights(const Problem& problem, const State& state, const std::vector<bool>& used, bool robust, double lost,
                    RobustFit& fit) {
  const std::size_t count = problem.views.size();
  std::vector<Eigen::Matrix2Xd> e(count);
  std::vector<double> noise;
  for (std::size_t i = 0; i < count; ++i) {
    fit.weights[i].resize(0);
    fit.view_noise[i] = 0;
    if (!used[i]) continue;
    e[i] = residuals(problem, state, i);
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
void measure_noise(const Problem& problem, Eigen::Index free, bool robust, RobustFit& fit) {
  double whitened = 0, squared = 0, freedom = -double(free);
  fit.points = 0;
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    if (!fit.weights[i].size()) continue;
    const Eigen::VectorXd length2 = residuals(problem, fit.adjustment.state, i).colwise().squaredNorm().transpose();
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
  for (Block& b : fit.adjustment.blocks) {
    b.pose *= scale, b.pose_gradient *= scale, b.cross *= scale, b.shared *= scale, b.shared_gradient *= scale;
    b.cost *= scale;
  }
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

RobustFit robust_fit(const Problem& problem, const Model& model, const State& start, const std::vector<bool>& used,
                     bool robust, int rounds) {
  const Eigen::MatrixXd basis = free_basis(model);
  const double views = double(std::count(used.begin(), used.end(), true));
  const double lost = 6 + double(basis.cols()) / std::max(views, 1.0);
  RobustFit fit;
  fit.zoom = basis.topRows<2>().colwise().sum().transpose();
  fit.weights.resize(problem.views.size());
  fit.view_noise.resize(problem.views.size());
  State state = start;
  impose(model, state.camera, state.shape);
  int iterations = 0;
  for (int round = 0; round < (robust ? rounds : 1); ++round) {
    update_weights(problem, state, used, robust, lost, fit);
    fit.adjustment = adjust(problem, basis, std::move(state), fit.weights, problem.max_iterations);
    state = fit.adjustment.state;
    iterations += fit.adjustment.iterations;
  }
  fit.adjustment.iterations = iterations;
  measure_noise(problem, basis.cols(), robust, fit);
  return fit;
}

namespace {

/// Compares what one view says of the shared parameters with what all others say: mean squared distance per
/// parameter in units of both covariances, and the number of parameters the view says anything about.
std::pair<double, int> contradiction(const Eigen::LLT<Eigen::MatrixXd>& all, const Block& block) {
  const Eigen::MatrixXd half = all.matrixL().solve(block.reduced());
  const Eigen::MatrixXd share = all.matrixL().solve(half.transpose());
  const SymmetricEigen eigen = symmetric_eigen(0.5 * (share + share.transpose()));
  const Eigen::VectorXd z = eigen.vectors.transpose() * all.matrixL().solve(block.reduced_gradient());
  double sum = 0;
  int count = 0;
  for (Eigen::Index k = 0; k < z.size(); ++k) {
    const double s = eigen.values[k];  // the view's share of what is known in this direction
    if (s < 1e-4 || s > 1 - 1e-4) continue;
    sum += z[k] * z[k] * (1 / s + 1 / (1 - s));
    ++count;
  }
  return {count ? sum / count : 0.0, count};
}

/// Squared, in units of its doubt: by how much the view asks for another zoom than the others. A lens that was
/// refocused or zoomed changes little else, and one parameter shows what among many would drown (score test).
double zoomed(const Eigen::LLT<Eigen::MatrixXd>& all, const Block& block, const Eigen::VectorXd& zoom) {
  const Eigen::MatrixXd own = block.reduced();
  const Eigen::VectorXd seen = own * zoom;
  const double known = zoom.dot(seen) - seen.dot(all.solve(seen)), pull = zoom.dot(block.reduced_gradient());
  return known > 1e-4 * zoom.dot(seen) ? pull * pull / known : 0.0;
}

/// How much more the views disagree than their noise allows: 1 unless that is beyond doubt (cf. Birge 1932). Of n
/// chances that are uniform when all is sound, the middle one follows a beta distribution.
double dispersion_of(const std::vector<CameraViewReport>& reports, const std::vector<int>& counts) {
  std::vector<double> influence, below;
  double freedom = 0;
  for (std::size_t i = 0; i < reports.size(); ++i) {
    if (counts[i] == 0) continue;
    influence.push_back(reports[i].influence);
    below.push_back(1 - reports[i].probability);
    freedom += counts[i];
  }
  if (influence.empty()) return 1.0;
  const double n = double(influence.size()), each = freedom / n;
  const double typical = median(influence) * each / uncertainty::chi_square_quantile(0.5, each);
  const int n_views = int(influence.size());
  const double beyond = uncertainty::binomial_interval(n_views / 2, n_views, 1 - 2 * false_dispersion).high;
  return median(below) > beyond ? std::max(typical, 1.0) : 1.0;
}

}  // namespace

ViewTest test_views(const RobustFit& fit, const std::vector<bool>& used, double false_alarm, double correlation,
                    std::vector<CameraViewReport>& reports) {
  const std::vector<Block>& blocks = fit.adjustment.blocks;
  Eigen::MatrixXd A;
  std::vector<double> noise;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!fit.weights[i].size()) continue;
    A = A.size() ? Eigen::MatrixXd(A + blocks[i].reduced()) : blocks[i].reduced();
    noise.push_back(fit.view_noise[i]);
  }
  const Eigen::LLT<Eigen::MatrixXd> all(A);
  ViewTest test;
  if (noise.size() < 4 || all.info() != Eigen::Success) return test;
  std::vector<int> counts(blocks.size(), 0);
  std::vector<double> freedom(blocks.size(), 1.0);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!used[i] || !fit.weights[i].size()) continue;
    std::tie(reports[i].influence, counts[i]) = contradiction(all, blocks[i]);
    if (counts[i] == 0) continue;
    freedom[i] = std::max(2.0 * double(fit.weights[i].size()) - 6 - counts[i], 1.0);
    reports[i].probability = 1 - uncertainty::fisher_cdf(reports[i].influence, counts[i], freedom[i]);
  }
  test.dispersion = dispersion_of(reports, counts);
  const double scale = std::max(test.dispersion, correlation);
  const double common = median(noise);
  double least = false_alarm / double(noise.size()), noisiest = noisy_ratio;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (counts[i] == 0) continue;
    const double any = 1 - uncertainty::fisher_cdf(reports[i].influence / scale, counts[i], freedom[i]);
    const double zoom = 1 - uncertainty::fisher_cdf(zoomed(all, blocks[i], fit.zoom) / scale, 1, freedom[i]);
    reports[i].probability = std::min(2 * std::min(any, zoom), 1.0);  // two tests share the false alarms
    const double ratio = fit.view_noise[i] / common;
    if (ratio <= noisiest && (noisiest > noisy_ratio || reports[i].probability >= least)) continue;
    noisiest = std::max(ratio, noisy_ratio);
    least = std::min(reports[i].probability, least);
    test.worst = int(i);
  }
  if (test.worst >= 0)
    reports[std::size_t(test.worst)].reason = noisiest > noisy_ratio
                                                  ? "its points scatter far more than those of the others"
                                                  : "it asks for another camera than the others";
  return test;
}

}  // namespace kr5::vision::detail
