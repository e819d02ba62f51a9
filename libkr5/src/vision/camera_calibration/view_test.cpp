// SPDX-License-Identifier: BSD-3-Clause
#include "vision/camera_calibration/view_test.hpp"

#include <algorithm>
#include <tuple>

#include <Eigen/Cholesky>

#include <kr5/core/linear.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/uncertainty/confidence.hpp>

namespace kr5::vision::detail {

namespace {

constexpr double false_dispersion = 0.001;  // chance to widen the uncertainties of a sound set
constexpr double noisy_ratio = 3.0;         // a view this much noisier than the others is named

/// Compares what one view says of the shared parameters with what all others say: mean squared distance per
/// parameter in units of both covariances, and the number of parameters the view says anything about.
std::pair<double, int> contradiction(const Eigen::LLT<Eigen::MatrixXd>& all, const ViewEquations& block) {
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

/// Squared, in units of its uncertainty: by how much the view asks for another zoom than the others. A lens that was
/// refocused or zoom_contradiction changes little else, and one parameter shows what among many would drown (score
/// test).
double zoom_contradiction(const Eigen::LLT<Eigen::MatrixXd>& all, const ViewEquations& block,
                          const Eigen::VectorXd& zoom) {
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

ViewTest test_views(const RobustAdjustment& fit, const std::vector<bool>& used, double correlation,
                    std::vector<CameraViewReport>& reports) {
  const std::vector<ViewEquations> blocks = fit.adjustment.equations();
  Eigen::MatrixXd A;
  std::vector<double> noise;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!fit.weights[i].size()) continue;
    A = A.size() ? Eigen::MatrixXd(A + blocks[i].reduced()) : blocks[i].reduced();
    noise.push_back(fit.view_noise[i]);
  }
  const Eigen::LLT<Eigen::MatrixXd> all(A);
  ViewTest test{std::vector<bool>(blocks.size(), false)};
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
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (counts[i] == 0) continue;
    const double any = 1 - uncertainty::fisher_cdf(reports[i].influence / scale, counts[i], freedom[i]);
    const double zoom =
        1 - uncertainty::fisher_cdf(zoom_contradiction(all, blocks[i], fit.zoom) / scale, 1, freedom[i]);
    reports[i].probability = std::min(2 * std::min(any, zoom), 1.0);  // two tests share the false alarms
    test.noisy[i] = fit.view_noise[i] > noisy_ratio * common;
  }
  return test;
}

}  // namespace kr5::vision::detail
