// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/timed_hand_eye/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include <Eigen/Dense>

#include <kr5/core/statistics.hpp>
#include <kr5/fit/measurements/pose.hpp>
#include <kr5/fit/problem.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "calibration/hand_eye/closed_form.hpp"

namespace kr5::calibration::timed {
namespace {

constexpr int unknowns = 13;  // X, Z (right perturbations), offset
using Vector13 = Eigen::Matrix<double, unknowns, 1>;
using Matrix13 = Eigen::Matrix<double, unknowns, unknowns>;
using Jacobian = Eigen::Matrix<double, 6, unknowns>;
constexpr int covariance_steps = 3;  // of the errors' covariance, with the estimate as it is
constexpr int most_steps = 10;

/// A camera pose that the hand stream covers.
struct Row {
  std::size_t index = 0;        ///< In the camera's stream.
  double t = 0.0;               ///< [s]
  Vector6 e = Vector6::Zero();  ///< Predicted against seen pose, in the camera's frame [m, rad].
  double weight = 1.0;
};

std::vector<Row> errors_at(const Trajectory& hand, const PoseStream& camera, const Estimate& estimate) {
  std::vector<Row> rows;
  rows.reserve(camera.t.size());
  const Pose T_world_base = estimate.Z.inverse();
  for (std::size_t k = 0; k < camera.t.size(); ++k)
    if (const auto sample = hand.at(camera.t[k] - estimate.offset))
      rows.push_back({k, camera.t[k], pose_difference(camera.poses[k], T_world_base * sample->T * estimate.X)});
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

/// RMS of errors over their standard deviations, as the fit weighs them.
double weighted_rms(const std::vector<Row>& rows, const Matrix6& S, double tail) {
  const Matrix6 W = S.inverse();
  double sum = 0.0;
  for (const Row& row : rows) {
    const double squared = row.e.dot(W * row.e);
    sum += (tail + 6) / (tail + squared) * squared / 6;
  }
  return std::sqrt(sum / static_cast<double>(rows.size()));
}

/// The fit of all camera poses.
class StreamFit {
 public:
  StreamFit(const Trajectory& hand, const PoseStream& camera, const Estimate& start)
      : X_(fit_.add_pose("T_hand_camera", start.X)),
        Z_(fit_.add_pose("T_base_world", start.Z)),
        offset_(fit_.add_vector("clock", Eigen::VectorXd::Constant(1, start.offset), {"offset [s]"})) {
    // While the offset moves, a pose at an end of the stream or a gap must not stop it.
    const fit::PosePath path = [&hand](double t) { return std::optional(hand.extended(t)); };
    for (std::size_t k = 0; k < camera.t.size(); ++k)
      seen_.push_back(fit_.add(
          fit::PoseMeasurement(fit::PoseChain().then_inverse(Z_).then_path(path, camera.t[k], offset_).then(X_),
                               camera.poses[k], Matrix6(Matrix6::Identity()))));
  }

  /// Perturbs the estimate from the right.
  void perturb(const Vector13& change) {
    const Estimate now = estimate();
    fit_.begin_at(X_, now.X * to_pose(Vector6(change.head<6>())));
    fit_.begin_at(Z_, now.Z * to_pose(Vector6(change.segment<6>(6))));
    fit_.begin_at(offset_, Eigen::VectorXd::Constant(1, now.offset + change[12]));
  }

  Estimate estimate() const { return {fit_.pose(X_), fit_.pose(Z_), fit_.values(offset_)[0]}; }

  /// Moves the estimate towards the optimum for t-distributed errors of this covariance. Returns how far that was, in
  /// standard deviations of the estimate; infinite where no step lowers the cost.
  double move(const std::vector<Row>& rows, const Matrix6& S, double tail) {
    set_rows(rows, S);
    // The covariance moves between two solves, so that one step is enough; where it fails, shorter ones are tried.
    for (const int steps : {1, most_steps}) {
      // The Cauchy loss of this scale, by residual, is the t distribution's, but for a factor.
      const fit::Solution result = fit_.solve({.max_iterations = steps,
                                               .loss = std::sqrt(tail / 6),
                                               .cost_tolerance = 1e-8 / static_cast<double>(rows.size()),
                                               .uncertainty = false});
      const double dof = std::max(1.0, static_cast<double>(result.residuals - unknowns));
      const double lowered = dof * (std::pow(result.fit.initial_rms, 2) - std::pow(result.fit.final_rms, 2));
      if (result.fit.usable() && (lowered > 0 || result.fit.status == FitStatus::Converged))
        return std::sqrt(std::max(0.0, (tail + 6) / tail * lowered));
    }
    return std::numeric_limits<double>::infinity();
  }

  /// Residuals of a row over their standard deviations, and their derivatives by X, Z and offset.
  struct Whitened {
    Vector6 r;
    Jacobian J;
  };
  std::vector<Whitened> whitened(const std::vector<Row>& rows, const Matrix6& S) {
    set_rows(rows, S);
    std::vector<Whitened> out;
    for (const Row& row : rows) {
      const auto at = fit_.derivatives(seen_[row.index]);
      out.push_back({at->residuals, at->by_coordinate});
    }
    return out;
  }

 private:
  void set_rows(const std::vector<Row>& rows, const Matrix6& S) {
    for (const fit::FitMeasurement o : seen_) fit_.set_weight(o, 0.0);
    for (const Row& row : rows) {
      fit_.set_weight(seen_[row.index], 1.0);
      fit_.set_covariance(seen_[row.index], S);
    }
  }

  fit::Problem fit_;
  fit::FitBlock X_, Z_, offset_;
  std::vector<fit::FitMeasurement> seen_;
};

using WhitenedRows = std::vector<StreamFit::Whitened>;

/// The errors as the fit weighs them, as six series of unit power that have nothing in common at one time.
struct Series {
  Eigen::Matrix<double, 6, Eigen::Dynamic> z;
  Matrix6 L;              ///< weight r = L z
  std::vector<int> slot;  ///< Of each column, in periods from the first; gaps in the stream are jumps.
  double period = 0.0;    ///< [s]
};

Series series_of(const std::vector<Row>& rows, const WhitenedRows& whitened) {
  Series out;
  out.z.resize(6, static_cast<Eigen::Index>(rows.size()));
  for (std::size_t k = 0; k < rows.size(); ++k)
    out.z.col(static_cast<Eigen::Index>(k)) = rows[k].weight * whitened[k].r;
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
ScatterCovariance scatter_covariance(const std::vector<Row>& rows, const WhitenedRows& whitened, double tail) {
  const Series series = series_of(rows, whitened);
  Matrix13 curvature = Matrix13::Zero(), scatter = Matrix13::Zero();
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto& [r, J] = whitened[k];
    const Vector13 score = rows[k].weight * J.transpose() * r;
    curvature += rows[k].weight * J.transpose() * J - 2 / (tail + 6) * score * score.transpose();
  }
  double longest = 1.0, squares = 1.0, numbers = 0.0;  // [periods]; in all
  const double slots = series.slot.back() + 1;
  for (int i = 0; i < 6; ++i) {
    const std::vector<double> fade = fading(series, i);
    const double lasts = 1 + 2 * std::accumulate(fade.begin(), fade.end(), 0.0);
    longest = std::max(longest, lasts);
    squares = std::max(squares, 1 + 2 * std::inner_product(fade.begin(), fade.end(), fade.begin(), 0.0));
    numbers += slots / lasts;
    Eigen::Matrix<double, unknowns, Eigen::Dynamic> h(unknowns, series.z.cols());
    for (std::size_t k = 0; k < rows.size(); ++k)
      h.col(static_cast<Eigen::Index>(k)) = whitened[k].J.transpose() * series.L.col(i);
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

void fill(const std::vector<Row>& rows, const Matrix6& S, StreamFit& fit, const TimedHandEyeOptions& options,
          TimedHandEyeResult& result) {
  const Estimate estimate = fit.estimate();
  result.offset = estimate.offset;
  result.T_hand_camera = estimate.X;
  result.T_base_world = estimate.Z;
  const ScatterCovariance found = scatter_covariance(rows, fit.whitened(rows, S), options.tail);
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
  for (const Row& row : rows)  // of a sound t-distributed error with five degrees of freedom fewer than 1 in 250
    result.outliers += row.e.dot(W * row.e) > 50;
  result.fit.final_rms = weighted_rms(rows, S, options.tail);
}

/// From one estimate to another, right perturbations.
Vector13 difference(const Estimate& from, const Estimate& to) {
  Vector13 out;
  out << pose_difference(from.X, to.X), pose_difference(from.Z, to.Z), to.offset - from.offset;
  return out;
}

/// Steps that shrink by a constant factor in one direction, as where an estimate and the covariance of its errors
/// follow each other (Aitken 1926).
class ShrinkingSteps {
 public:
  /// How many times the last step is still to come, given its length in standard deviations; 0 where the steps do not
  /// tell.
  double still_to_come(const Vector13& step, double length) {
    constexpr double same_direction = 0.9, same_ratio = 0.05, largest_ratio = 0.98;
    const double ratio = count_ > 0 ? length / length_ : 0.0;
    const bool steady = count_ > 1 && ratio < largest_ratio && std::abs(ratio - ratio_) < same_ratio &&
                        step.dot(step_) > same_direction * step.norm() * step_.norm();
    step_ = step, length_ = length, ratio_ = ratio, ++count_;
    if (!steady) return 0.0;
    count_ = 0;
    return ratio / (1 - ratio);
  }

 private:
  Vector13 step_ = Vector13::Zero();
  double length_ = 0.0, ratio_ = 0.0;
  int count_ = 0;
};

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

void refine(const Trajectory& hand, const PoseStream& camera, const TimedHandEyeOptions& options, const Estimate& start,
            TimedHandEyeResult& result) {
  StreamFit fit(hand, camera, start);
  const std::vector<Row> at_start = errors_at(hand, camera, start);
  std::vector<Row> rows = at_start;
  Matrix6 S = rough_covariance(rows);
  ShrinkingSteps steps;
  result.fit.status = FitStatus::MaxIterations;
  result.fit.message = "the refinement did not converge; the stated uncertainty may be too small";
  for (int i = 1; i <= options.max_iterations && result.fit.status != FitStatus::Converged; ++i) {
    for (int step = 0; step < covariance_steps; ++step) reweigh(rows, S, options.tail);
    const Estimate before = fit.estimate();
    const double length = fit.move(rows, S, options.tail);
    if (!std::isfinite(length)) break;
    const Vector13 step = difference(before, fit.estimate());
    if (length < 2e-3)
      result.fit.status = FitStatus::Converged;
    else if (const double factor = steps.still_to_come(step, length); factor > 0)
      fit.perturb(factor * step);
    rows = errors_at(hand, camera, fit.estimate());
    result.fit.iterations = i;
  }
  reweigh(rows, S, options.tail);
  result.fit.initial_rms = weighted_rms(at_start, S, options.tail);
  fill(rows, S, fit, options, result);
}

}  // namespace kr5::calibration::timed
