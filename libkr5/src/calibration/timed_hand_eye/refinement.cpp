// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/timed_hand_eye/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Dense>

#include <kr5/core/statistics.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "calibration/hand_eye/closed_form.hpp"
#include "calibration/hand_eye_diagnosis/reading_fit.hpp"

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

/// The errors as the fit weighs them, as six series of unit power that have nothing in common at one time.
struct Series {
  Eigen::Matrix<double, 6, Eigen::Dynamic> z;
  Matrix6 L;              ///< weight e = L z
  std::vector<int> slot;  ///< Of each column, in periods from the first; gaps in the stream are jumps.
  double period = 0.0;    ///< [s]
};

Series series_of(const std::vector<Row>& rows) {
  Series out;
  out.z.resize(6, static_cast<Eigen::Index>(rows.size()));
  for (std::size_t k = 0; k < rows.size(); ++k) out.z.col(static_cast<Eigen::Index>(k)) = rows[k].weight * rows[k].e;
  const Matrix6 power = out.z * out.z.transpose() / static_cast<double>(rows.size());
  out.L = power.llt().matrixL();
  out.L.triangularView<Eigen::Lower>().solveInPlace(out.z);
  std::vector<double> steps;
  for (std::size_t k = 1; k < rows.size(); ++k) steps.push_back(rows[k].t - rows[k - 1].t);
  out.period = median(steps);
  for (const Row& row : rows) out.slot.push_back(static_cast<int>(std::lround((row.t - rows.front().t) / out.period)));
  return out;
}

/// Mean product of what is so many periods apart in one of the series.
double autocorrelation(const Series& series, int component, int lag) {
  double sum = 0.0;
  int pairs = 0;
  for (std::size_t i = 0, j = 0; j < series.slot.size(); ++j) {
    while (series.slot[j] - series.slot[i] > lag) ++i;
    if (series.slot[j] - series.slot[i] != lag) continue;
    sum += series.z(component, static_cast<Eigen::Index>(i)) * series.z(component, static_cast<Eigen::Index>(j));
    ++pairs;
  }
  return pairs > 0 ? sum / pairs : 0.0;
}

/// How one of the series fades: its autocorrelation from one period on, as long as it can be told from none.
std::vector<double> fading(const Series& series, int component) {
  std::vector<double> out;
  for (int lag = 1; lag < series.slot.back() / 4; ++lag) {
    out.push_back(autocorrelation(series, component, lag));
    if (out.back() < 0.05) break;
  }
  if (!out.empty()) out.pop_back();
  return out;
}

/// Sum of h_s h_t' r(s - t), for vectors h (columns) whose errors fade like r.
Matrix13 sum_of_pairs(const Eigen::Matrix<double, unknowns, Eigen::Dynamic>& h, const std::vector<int>& slot,
                      const std::vector<double>& fade) {
  Matrix13 sum = h * h.transpose();
  for (std::size_t i = 0; i < slot.size(); ++i) {
    Vector13 later = Vector13::Zero();
    for (std::size_t j = i + 1; j < slot.size() && slot[j] - slot[i] <= static_cast<int>(fade.size()); ++j)
      if (slot[j] > slot[i])
        later += fade[static_cast<std::size_t>(slot[j] - slot[i] - 1)] * h.col(static_cast<Eigen::Index>(j));
    const Matrix13 pairs = h.col(static_cast<Eigen::Index>(i)) * later.transpose();
    sum += pairs + pairs.transpose();
  }
  return sum;
}

struct ScatterCovariance {
  Matrix13 covariance;
  double correlation_time = 0.0;  ///< [s]
  double independent = 0.0;       ///< Camera poses that would tell as much of the scatter if errors did not last.
  double of_one = 0.0;            ///< The same for one number, which hangs on few of the series and how they fade.
};

/// Covariance of the t-distributed fit from how its errors scatter and how they fade (the sandwich of M-estimation,
/// with the pairs of rows that err together; Newey and West 1987, but with the fading as it is seen).
ScatterCovariance scatter_covariance(const std::vector<Row>& rows, const Matrix6& S, double tail) {
  const Matrix6 W = S.inverse();
  const Series series = series_of(rows);
  Matrix13 curvature = Matrix13::Zero(), scatter = Matrix13::Zero();
  for (const Row& row : rows) {
    const Vector13 score = row.weight * row.J.transpose() * W * row.e;
    curvature += row.weight * row.J.transpose() * W * row.J - 2 / (tail + 6) * score * score.transpose();
  }
  double longest = 1.0, squares = 1.0, numbers = 0.0;  // [periods]; in all
  const double slots = series.slot.back() + 1;
  for (int i = 0; i < 6; ++i) {
    const std::vector<double> fade = fading(series, i);
    const double lasts = 1 + 2 * std::accumulate(fade.begin(), fade.end(), 0.0);
    longest = std::max(longest, lasts);
    squares = std::max(squares, 1 + 2 * std::inner_product(fade.begin(), fade.end(), fade.begin(), 0.0));
    numbers += slots / lasts;
    const Vector6 unit = W * series.L.col(i);
    Eigen::Matrix<double, unknowns, Eigen::Dynamic> h(unknowns, series.z.cols());
    for (std::size_t k = 0; k < rows.size(); ++k) h.col(static_cast<Eigen::Index>(k)) = rows[k].J.transpose() * unit;
    scatter += sum_of_pairs(h, series.slot, fade);
  }
  const Matrix13 inverse = curvature.ldlt().solve(Matrix13::Identity());
  const double fitted = numbers / std::max(numbers - unknowns, 1.0);  // the fit took as many numbers off the errors
  return {fitted * inverse * scatter * inverse.transpose(), longest * series.period, slots / squares, slots / longest};
}

/// Degrees of freedom behind the covariance of `numbers` numbers that was estimated on so many independent errors.
double dof_of(double numbers, double independent) { return std::max(independent - numbers, 1.0); }

/// The factor after which the normal 95 % region of `numbers` numbers, whose covariance was estimated on so many
/// independent errors, is Hotelling's.
double hotelling(double numbers, double independent) {
  const double dof = dof_of(numbers, independent);
  return std::max(independent - 1, 1.0) / dof * uncertainty::covariance_inflation(numbers, dof);
}

void fill(const std::vector<Row>& rows, const Matrix6& S, const Estimate& estimate, const TimedHandEyeOptions& options,
          TimedHandEyeResult& result) {
  result.offset = estimate.offset;
  result.T_hand_camera = estimate.X;
  result.T_base_world = estimate.Z;
  const ScatterCovariance found = scatter_covariance(rows, S, options.tail);
  const Matrix13& C = found.covariance;
  result.correlation_time = found.correlation_time;
  result.covariance = hotelling(6, found.independent) * C.topLeftCorner<6, 6>();
  result.covariance_world = hotelling(6, found.independent) * C.block<6, 6>(6, 6);
  result.covariance_dof = dof_of(6, found.independent);
  result.offset_std = std::sqrt(hotelling(1, found.of_one) * C(12, 12));
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
  result.fit.message = "the refinement did not converge; the stated uncertainty may be too small";
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
