// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/tool.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <Eigen/Cholesky>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/fit/pipeline/sound_probability.hpp>
#include <kr5/uncertainty/confidence.hpp>

namespace kr5::calibration {
namespace {

using Index = std::vector<std::size_t>;

/// Weighted least squares for tip and touched point at one ratio of rotation to position variance.
struct Fit {
  Vector6 x = Vector6::Zero();                                   // tip, point [m]
  Matrix6 cofactor = Matrix6::Zero();                            // covariance at unit position variance
  Eigen::Matrix3d cofactor_noise = Eigen::Matrix3d::Identity();  // of one touch, in the flange frame
  double cost = 0.0;                                             // whitened sum of squares [m^2]
  double log_likelihood = 0.0;                                   // restricted, variance profiled out
  double dof = 0.0;
  double ratio = 0.0;  // (sigma_rotation / sigma_position)^2 [rad^2/m^2]
};

/// Error of the tip in the flange frame: a rotation error moves it across its lever arm, never along it.
Eigen::Matrix3d touch_noise(const Eigen::Vector3d& tip, double ratio) {
  return Eigen::Matrix3d::Identity() +
         ratio * (tip.squaredNorm() * Eigen::Matrix3d::Identity() - tip * tip.transpose());
}

Eigen::Matrix<double, 3, 6> design(const Pose& T) {
  Eigen::Matrix<double, 3, 6> A;
  A << Eigen::Matrix3d::Identity(), -T.linear().transpose();
  return A;
}

Fit solve(std::span<const Pose> poses, const Index& used, double ratio, const Eigen::Vector3d& tip_guess) {
  Fit fit;
  fit.ratio = ratio;
  fit.cofactor_noise = touch_noise(tip_guess, ratio);
  const Eigen::Matrix3d W = fit.cofactor_noise.inverse();
  Matrix6 H = Matrix6::Zero();
  Vector6 g = Vector6::Zero();
  for (const std::size_t k : used) {
    const auto A = design(poses[k]);
    const Eigen::Vector3d y = -poses[k].linear().transpose() * poses[k].translation();
    H += A.transpose() * W * A;
    g += A.transpose() * W * y;
  }
  const Eigen::LDLT<Matrix6> ldlt(H);
  fit.x = ldlt.solve(g);
  fit.cofactor = ldlt.solve(Matrix6::Identity());
  for (const std::size_t k : used) {
    const Eigen::Vector3d e =
        poses[k].linear().transpose() * (fit.x.tail<3>() - poses[k].translation()) - fit.x.head<3>();
    fit.cost += e.dot(W * e);
  }
  const double n = static_cast<double>(used.size());
  fit.dof = 3 * n - 6;
  fit.log_likelihood = -0.5 * (n * std::log(fit.cofactor_noise.determinant()) +
                               ldlt.vectorD().array().abs().log().sum() + fit.dof * std::log(fit.cost + 1e-300));
  return fit;
}

/// Mean of fits at several ratios, weighted by their likelihood; its covariance holds how far they are apart.
Fit averaged(const std::vector<Fit>& fits) {
  double best = -1e300;
  for (const Fit& fit : fits) best = std::max(best, fit.log_likelihood);
  Fit mean = fits.front();
  mean.x.setZero(), mean.cofactor_noise.setZero();
  Matrix6 covariance = Matrix6::Zero();
  double sum = 0.0, position = 0.0, rotation = 0.0;
  for (const Fit& fit : fits) {
    const double weight = std::exp(fit.log_likelihood - best), variance = fit.cost / fit.dof;
    sum += weight;
    mean.x += weight * fit.x;
    covariance += weight * (variance * fit.cofactor + fit.x * fit.x.transpose());
    mean.cofactor_noise += weight * variance * fit.cofactor_noise;
    position += weight * variance;
    rotation += weight * variance * fit.ratio;
  }
  mean.x /= sum;
  mean.ratio = rotation / position;
  mean.cost = position / sum * mean.dof;
  mean.cofactor = (covariance / sum - mean.x * mean.x.transpose()) / (position / sum);
  mean.cofactor_noise /= position;
  return mean;
}

/// Averages over the ratio of the variances, weighted by restricted likelihood. Picking the most likely ratio instead
/// pretends to know it, and from four to six poses states far too small an uncertainty.
Fit solve_estimating(std::span<const Pose> poses, const Index& used) {
  const Fit plain = solve(poses, used, 0.0, Eigen::Vector3d::Zero());
  const Eigen::Vector3d tip = plain.x.head<3>();
  if (plain.cost < 1e-24 || tip.squaredNorm() < 1e-12) return plain;
  std::vector<Fit> fits;
  for (double exponent = -4.0; exponent <= 6.0; exponent += 1.0) {
    fits.push_back(solve(poses, used, std::exp(exponent) / tip.squaredNorm(), tip));
    fits.back().log_likelihood -= exponent * exponent / 8;  // arms: both errors alike at the tip, within a factor of e
  }
  return averaged(fits);
}

struct Noise {
  double variance = 0.0;  // of a position [m^2]
  bool given = false;
};

Fit solve_with(std::span<const Pose> poses, const Index& used, const ToolOptions& options) {
  if (options.sigma_position == 0) return solve_estimating(poses, used);
  const double ratio = std::pow(options.sigma_rotation / options.sigma_position, 2);
  const Fit first = solve(poses, used, ratio, Eigen::Vector3d::Zero());
  return solve(poses, used, ratio, first.x.head<3>());  // the noise depends on the lever arm
}

Noise noise_of(const Fit& fit, const ToolOptions& options) {
  const bool given = options.sigma_position > 0;
  return {given ? options.sigma_position * options.sigma_position : fit.cost / fit.dof, given};
}

Index in_use(const std::vector<double>& weights) {
  Index out;
  for (std::size_t k = 0; k < weights.size(); ++k)
    if (weights[k] > 0) out.push_back(k);
  return out;
}

/// Probability that a sound pose lies as far from the prediction of the others as pose k does.
double significance(std::span<const Pose> poses, Index used, std::size_t k, const ToolOptions& options) {
  std::erase(used, k);
  if (used.size() < 4) return 1.0;  // too few to contradict one
  const Fit others = solve_with(poses, used, options);
  const Noise noise = noise_of(others, options);
  const auto A = design(poses[k]);
  const Eigen::Vector3d e =
      poses[k].linear().transpose() * (others.x.tail<3>() - poses[k].translation()) - others.x.head<3>();
  const Eigen::Matrix3d C = others.cofactor_noise + A * others.cofactor * A.transpose();
  const double squared = e.dot(C.inverse() * e) / std::max(noise.variance, 1e-24);
  return fit::pipeline::sound_probability(squared, 3, false, noise.given ? uncertainty::known_noise : others.dof);
}

/// Names contradicting poses. Of the pipeline's stages this one alone: the cost is quadratic in tip and point, so that
/// there is one minimum, and each fit finds the noise.
std::vector<double> judge(std::span<const Pose> poses, const ToolOptions& options, ToolResult& result) {
  std::vector<double> weights(poses.size(), 1.0);
  const auto probabilities = [&] {
    std::vector<double> out;
    for (std::size_t k = 0; k < poses.size(); ++k)
      out.push_back(result.poses[k].significance = significance(poses, in_use(weights), k, options));
    return out;
  };
  fit::pipeline::settle_outliers(weights, options.outlier_false_alarm, 4, probabilities, [] {});
  for (std::size_t k = 0; k < poses.size(); ++k) result.poses[k].outlier = weights[k] == 0;
  return weights;
}

/// How strongly the orientations bear on each direction of the tip: eigenvalues of mean (R_k - R)'(R_k - R).
void excitation(std::span<const Pose> poses, const Index& used, ToolResult& result) {
  Eigen::Matrix3d mean = Eigen::Matrix3d::Zero();
  for (const std::size_t k : used) mean += poses[k].linear() / static_cast<double>(used.size());
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  for (const std::size_t k : used) {
    const Eigen::Matrix3d D = poses[k].linear() - mean;
    M += D.transpose() * D / static_cast<double>(used.size());
  }
  const SymmetricEigen eigen = symmetric_eigen(M);
  result.rotation_spread = eigen.values.cwiseMax(0.0).cwiseSqrt();
  result.weak_direction = eigen.vectors.col(0);
}

std::string text(const char* format, double a, double b = 0, double c = 0) {
  char buffer[256];
  std::snprintf(buffer, sizeof buffer, format, a, b, c);
  return buffer;
}

/// Says which motion is missing; empty when every direction of the tip is determined.
std::string missing_motion(const ToolResult& result, double min_rotation) {
  const Eigen::Vector3d spread = result.rotation_spread;
  if (spread[0] >= min_rotation) return "";
  if (spread[2] < min_rotation)
    return text(
        "all poses have nearly the same orientation (RMS turn %.2f deg): the tip cannot be determined; turn the wrist "
        "by "
        "30 deg or more about two axes",
        spread[2] * 57.29577951308232);
  const Eigen::Vector3d d = result.weak_direction;
  return text(
             "the poses turn about one axis only: the tip cannot be determined along (%.2f, %.2f, %.2f) of the "
             "flange; ",
             d.x(), d.y(), d.z()) +
         "add poses that tilt that axis by 30 deg or more";
}

void warn(const ToolOptions& options, ToolResult& result) {
  if (options.height_now && options.height_at_calibration) {
    const double change = *options.height_now - *options.height_at_calibration;
    if (std::abs(change) > options.max_height_change)
      result.warnings.push_back(
          text("the peg's height has changed by %.1f mm since the calibration (limit %.1f mm): "
               "calibrate the tool with the peg now in use",
               change * 1e3, options.max_height_change * 1e3));
  }
  if (options.previous) {
    const double change = (result.tip - *options.previous).norm();
    if (change > options.max_height_change)
      result.warnings.push_back(
          text("the tip lies %.1f mm from the previous one (limit %.1f mm): has the peg been "
               "exchanged, or its height changed?",
               change * 1e3, options.max_height_change * 1e3));
  }
}

void fill(std::span<const Pose> poses, const Fit& fit, const ToolOptions& options, ToolResult& result) {
  const Noise noise = noise_of(fit, options);
  result.tip = fit.x.head<3>();
  result.point = fit.x.tail<3>();
  result.covariance_dof = noise.given ? uncertainty::known_noise : fit.dof;
  result.covariance =
      uncertainty::covariance_inflation(3, result.covariance_dof) * noise.variance * fit.cofactor.topLeftCorner<3, 3>();
  result.sigma_position = std::sqrt(noise.variance);
  result.sigma_rotation = std::sqrt(noise.variance * fit.ratio);
  result.fit.final_rms = noise.variance > 0 ? std::sqrt(fit.cost / fit.dof / noise.variance) : 0.0;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    result.poses[k].residual = poses[k] * result.tip - result.point;
    result.poses[k].distance = result.poses[k].residual.norm();
  }
}

void finish(const ToolOptions& options, ToolResult& result) {
  result.fit.iterations = 1;
  const std::string missing = missing_motion(result, options.min_rotation);
  const auto outliers =
      std::count_if(result.poses.begin(), result.poses.end(), [](const auto& p) { return p.outlier; });
  result.fit.status = missing.empty() ? FitStatus::Converged : FitStatus::Degenerate;
  result.fit.message = missing;
  if (!missing.empty()) return;
  result.fit.message = "tip from " + std::to_string(result.poses.size()) + " poses";
  if (outliers > 0) result.fit.message += ", " + std::to_string(outliers) + " of which contradict the others";
  warn(options, result);
}

}  // namespace

void ToolOptions::validate() const {
  require(sigma_position >= 0, "sigma_position must not be negative [m]; 0 means estimated");
  require(sigma_rotation >= 0, "sigma_rotation must not be negative [rad]; 0 means estimated");
  require(sigma_rotation == 0 || sigma_position > 0, "sigma_position must be given when sigma_rotation is [m]");
  require(min_rotation > 0 && min_rotation < 1, "min_rotation must lie between 0 and 1 [rad]");
  require(outlier_false_alarm >= 0 && outlier_false_alarm < 1, "outlier_false_alarm must lie in [0, 1) [-]");
  require(max_height_change > 0, "max_height_change must be positive [m]");
  require(height_now.has_value() == height_at_calibration.has_value(),
          "height_now and height_at_calibration must be given together [m]");
  require(!previous || previous->allFinite(), "previous must be finite [m]");
}

ToolResult calibrate_tool(std::span<const Pose> T_base_flange, const ToolOptions& options) {
  options.validate();
  require(T_base_flange.size() >= 4,
          "calibrate_tool: found " + std::to_string(T_base_flange.size()) + " poses, expected at least 4");
  for (std::size_t k = 0; k < T_base_flange.size(); ++k) {
    const std::string pose = "calibrate_tool: pose " + std::to_string(k + 1);
    require(T_base_flange[k].matrix().allFinite() && is_rotation(T_base_flange[k].linear()),
            pose + " is not finite with a proper rotation");
    require(T_base_flange[k].translation().cwiseAbs().maxCoeff() <= 1e3,
            pose + " lies more than 1000 m away; is it in millimetres?");
  }
  ToolResult result;
  result.poses.resize(T_base_flange.size());
  std::vector<double> weights(T_base_flange.size(), 1.0);
  excitation(T_base_flange, in_use(weights), result);
  if (result.rotation_spread[0] < options.min_rotation) return finish(options, result), result;
  const std::vector<double> sound = judge(T_base_flange, options, result);
  if (options.reject_outliers) weights = sound;
  excitation(T_base_flange, in_use(weights), result);
  fill(T_base_flange, solve_with(T_base_flange, in_use(weights), options), options, result);
  finish(options, result);
  return result;
}

}  // namespace kr5::calibration
