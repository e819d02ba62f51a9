// SPDX-License-Identifier: BSD-3-Clause
#include "timed_hand_eye_fit.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include <kr5/core/statistics.hpp>

#include "hand_eye_evidence.hpp"
#include "hand_eye_of_poses.hpp"

namespace kr5::calibration::timed {
namespace {

constexpr int unknowns = 13;  // X, Z (right perturbations), offset
using Vector13 = Eigen::Matrix<double, unknowns, 1>;
using Matrix13 = Eigen::Matrix<double, unknowns, unknowns>;
using Jacobian = Eigen::Matrix<double, 6, unknowns>;

/// Predicted against seen camera pose, in the camera's frame, with its derivatives.
struct Row {
  double t = 0.0;
  Vector6 e = Vector6::Zero();
  Jacobian J = Jacobian::Zero();
  double weight = 1.0;
};

std::vector<Row> linearise(const Trajectory& hand, const PoseStream& camera, const Estimate& estimate) {
  std::vector<Row> rows;
  rows.reserve(camera.t.size());
  const Matrix6 hand_to_camera = adjoint(estimate.X.inverse());
  for (std::size_t k = 0; k < camera.t.size(); ++k) {
    const auto sample = hand.at(camera.t[k] - estimate.offset);
    if (!sample) continue;
    const Pose predicted = estimate.Z.inverse() * sample->T * estimate.X;
    Row row;
    row.t = camera.t[k];
    row.e = pose_difference(camera.poses[k], predicted);
    row.J.leftCols<6>().setIdentity();
    row.J.middleCols<6>(6) = -adjoint(predicted.inverse());
    row.J.col(12) = -hand_to_camera * sample->rate;
    const Eigen::Matrix3d turn = exp_rotation(row.e.tail<3>());
    row.J.topRows<3>() = turn * row.J.topRows<3>();
    row.J.bottomRows<3>() = (Eigen::Matrix3d::Identity() + 0.5 * skew(row.e.tail<3>())) * row.J.bottomRows<3>();
    rows.push_back(row);
  }
  return rows;
}

/// First guess of the errors' covariance, from medians, so that outliers do not enter.
Matrix6 rough_covariance(const std::vector<Row>& rows) {
  Matrix6 S = Matrix6::Zero();
  for (int i = 0; i < 6; ++i) {
    std::vector<double> v;
    for (const Row& row : rows) v.push_back(std::abs(row.e[i]));
    S(i, i) = std::pow(mad_to_sigma * median(v), 2) + 1e-18;
  }
  return S;
}

/// One step of expectation-maximisation for t-distributed errors: weights, then covariance.
void reweigh(std::vector<Row>& rows, Matrix6& S, double tail) {
  const Matrix6 W = S.inverse();
  Matrix6 sum = Matrix6::Zero();
  for (Row& row : rows) {
    row.weight = (tail + 6) / (tail + row.e.dot(W * row.e));
    sum += row.weight * row.e * row.e.transpose();
  }
  const double floor = 1e-12;  // exact data must not make the covariance singular
  S = sum / static_cast<double>(rows.size()) + floor * floor * Matrix6::Identity();
}

void apply(const Vector13& step, Estimate& estimate) {
  estimate.X = estimate.X * to_pose(step.head<6>());
  estimate.Z = estimate.Z * to_pose(step.segment<6>(6));
  estimate.offset += std::clamp(step[12], -0.05, 0.05);  // further the interpolation is not linear
}

/// How long errors last: the longest integral of the six whitened errors' autocorrelation.
double correlation_time(const std::vector<Row>& rows, const Matrix6& S) {
  const Matrix6 L = S.llt().matrixL();
  const auto n = static_cast<Eigen::Index>(rows.size());
  Eigen::Matrix<double, 6, Eigen::Dynamic> white(6, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Row& row = rows[static_cast<std::size_t>(k)];
    white.col(k) = std::sqrt(row.weight) * L.triangularView<Eigen::Lower>().solve(row.e);
  }
  const double period = (rows.back().t - rows.front().t) / static_cast<double>(n - 1);
  double longest = 1.0;
  for (int i = 0; i < 6; ++i) {
    const double power = white.row(i).squaredNorm();
    double sum = 1.0;
    for (Eigen::Index lag = 1; lag < n / 4; ++lag) {
      const double r = white.row(i).head(n - lag).dot(white.row(i).tail(n - lag)) / power;
      if (r < 0.05) break;
      sum += 2 * r;
    }
    longest = std::max(longest, sum);
  }
  return longest * period;
}

/// Part of the variance of a sum of errors that sums over blocks of `length` show: the rest lies in what neighbouring
/// blocks have in common, as it is for errors that fade exponentially.
double seen_by_blocks(double correlation_time, double sample, double length) {
  // Of independent samples the correlation time is the time from one to the next, and there is no memory.
  const double memory = 0.5 * (correlation_time - sample * sample / correlation_time);
  return 1 - memory / length * (1 - std::exp(-length / memory));
}

/// Covariance from leaving out one block of time after another, each by one Newton step of the t-distributed fit.
Matrix13 block_jackknife(const std::vector<Row>& rows, const Matrix6& S, double tail, double correlation_time) {
  const Matrix6 W = S.inverse();
  const double start = rows.front().t, span = rows.back().t - start + 1e-9;
  const auto count = static_cast<std::size_t>(std::clamp(span / (4 * correlation_time), 10.0, 200.0));
  std::vector<Matrix13> A(count, Matrix13::Zero());
  std::vector<Vector13> g(count, Vector13::Zero());
  Matrix13 total = Matrix13::Zero();
  for (const Row& row : rows) {
    const auto b = static_cast<std::size_t>((row.t - start) / span * static_cast<double>(count));
    const Vector13 score = row.weight * row.J.transpose() * W * row.e;
    const Matrix13 curvature = row.weight * row.J.transpose() * W * row.J - 2 / (tail + 6) * score * score.transpose();
    g[b] += score;
    A[b] += curvature;
    total += curvature;
  }
  Matrix13 C = Matrix13::Zero();
  double filled = 0;
  for (std::size_t b = 0; b < count; ++b) {
    if (A[b].isZero()) continue;
    const Vector13 change = (total - A[b]).ldlt().solve(g[b]);
    C += change * change.transpose();
    filled += 1;
  }
  const double seen = seen_by_blocks(correlation_time, span / static_cast<double>(rows.size()), span / filled);
  return (filled - 1) / filled / seen * C;
}

void fill(const std::vector<Row>& rows, const Matrix6& S, const Estimate& estimate, const TimedHandEyeOptions& options,
          TimedHandEyeResult& result) {
  result.offset = estimate.offset;
  result.T_hand_camera = estimate.X;
  result.T_base_world = estimate.Z;
  result.correlation_time = correlation_time(rows, S);
  const Matrix13 C = block_jackknife(rows, S, options.tail, result.correlation_time);
  result.covariance = C.topLeftCorner<6, 6>();
  result.covariance_world = C.block<6, 6>(6, 6);
  result.offset_std = std::sqrt(C(12, 12));
  result.sigma_position = std::sqrt(S.topLeftCorner<3, 3>().trace() / 3);
  result.sigma_rotation = std::sqrt(S.bottomRightCorner<3, 3>().trace() / 3);
  result.used = static_cast<int>(rows.size());
  const Matrix6 W = S.inverse();
  double sum = 0;
  for (const Row& row : rows) {
    const double squared = row.e.dot(W * row.e);
    result.outliers += squared > 50;  // of a sound t-distributed error with five degrees of freedom fewer than 1 in 250
    sum += row.weight * squared / 6;
  }
  result.fit.final_rms = std::sqrt(sum / static_cast<double>(rows.size()));
}

}  // namespace

Start closed_form_at(const Trajectory& hand, const PoseStream& camera, double offset) {
  std::vector<Pose> G, C;
  for (std::size_t k = 0; k < camera.t.size(); ++k)
    if (const auto sample = hand.at(camera.t[k] - offset)) {
      G.push_back(sample->T);
      C.push_back(camera.poses[k].inverse());
    }
  const auto form = closed_form(G, C, Mount::EyeInHand, false);
  Start start{{form.X, form.Z, offset}, 0.0, 0.0};
  std::vector<double> angles, distances;
  for (std::size_t k = 0; k < G.size(); ++k) {
    const Vector6 d = pose_difference(form.Z, G[k] * form.X * C[k]);
    angles.push_back(d.tail<3>().norm());
    distances.push_back(d.head<3>().norm());
  }
  start.turn = median(angles);
  start.shift = median(distances);
  return start;
}

void refine(const Trajectory& hand, const PoseStream& camera, const TimedHandEyeOptions& options, Estimate estimate,
            TimedHandEyeResult& result) {
  std::vector<Row> rows = linearise(hand, camera, estimate);
  Matrix6 S = rough_covariance(rows);
  result.fit.status = FitStatus::MaxIterations;
  result.fit.message = "the refinement did not settle; the doubt may be too small";
  for (int i = 1; i <= options.max_iterations; ++i) {
    reweigh(rows, S, options.tail);
    const Matrix6 W = S.inverse();
    Matrix13 H = Matrix13::Zero();
    Vector13 g = Vector13::Zero();
    for (const Row& row : rows) {
      H += row.weight * row.J.transpose() * W * row.J;
      g += row.weight * row.J.transpose() * W * row.e;
    }
    const Vector13 step = -H.ldlt().solve(g);
    const double size = std::sqrt(step.dot(H * step));  // in standard deviations of the estimate
    if (i == 1) result.fit.initial_rms = std::sqrt(std::max(0.0, g.dot(-step)) / static_cast<double>(6 * rows.size()));
    apply(step, estimate);
    rows = linearise(hand, camera, estimate);
    result.fit.iterations = i;
    if (size < 2e-3) {
      result.fit.status = FitStatus::Converged;
      break;
    }
  }
  reweigh(rows, S, options.tail);
  fill(rows, S, estimate, options, result);
}

}  // namespace kr5::calibration::timed
