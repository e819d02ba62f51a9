// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye_diagnosis/reading_fit.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <kr5/core/levenberg_marquardt.hpp>
#include <kr5/geometry/pose_derivatives.hpp>

#include "calibration/hand_eye/closed_form.hpp"
#include "calibration/hand_eye/model.hpp"

namespace kr5::calibration::evidence {
namespace {

// Below these the noise of a robot is not looked for: readings are printed with as many digits.
constexpr double min_position = 1e-6, min_rotation = 1e-6;

/// One pair as the fit sees it.
struct Pair {
  Vector6 r;
  Matrix6 S, S_inverse;
  Eigen::Matrix<double, 6, Eigen::Dynamic> J;
  double excess = 0.0;
  double spread = 1.0;  ///< Variance of this pair over the usual one, as its residual suggests.
};

/// Degrees of freedom of Student's t that are tried for poses whose noise varies, beside the normal distribution.
constexpr double tails[] = {8.0, 3.0};

Pose scaled(const Pose& T, double scale) {
  Pose out = T;
  out.translation() *= scale;
  return out;
}

class Fitter {
 public:
  /// @param tail Degrees of freedom of the noise of a pair, multivariate t; 0: normal.
  Fitter(const Reading& reading, const Sightings& sightings, double tail = 0.0)
      : reading_(reading), sightings_(sightings), tail_(tail) {
    solution_.assign(reading.robot.size(), 0);
    pairs_.resize(reading.robot.size());
  }

  ReadingFit run() {
    start();
    double last = 1e300;
    for (int k = 0; k < 60; ++k) {
      if (k < 6) choose_solutions();
      if (!step()) return {};
      for (int s = 0; s < 2; ++s) update_noise();
      linearise();
      update_spread();
      const double now = score();
      if (!std::isfinite(now)) return {};
      if (k > 6 && std::abs(last - now) < 1e-4) break;
      last = now;
    }
    return finish();
  }

 private:
  const Sighting& sighting(int i) const {
    return sightings_.views[static_cast<std::size_t>(reading_.sighting[static_cast<std::size_t>(i)])];
  }
  const Sighting::Solution& solution(int i) const {
    return sighting(i).solutions[static_cast<std::size_t>(solution_[static_cast<std::size_t>(i)])];
  }
  const Pose& target(int i, const ReadingFit& at) const {
    return reading_.split > 0 && i >= reading_.split ? at.Y_after : at.Y;
  }
  const Pose& target(int i) const { return target(i, fit_); }
  Pose robot(int i, const ReadingFit& at) const {
    const auto k = static_cast<std::size_t>(i);
    return reading_.drift.empty() ? reading_.robot[k] : reading_.robot[k] * to_pose(at.lag * reading_.drift[k]);
  }
  /// How pair i misses the robot pose [m, rad].
  Vector6 residual(int i, const ReadingFit& at) const {
    const Pose seen = scaled(solution(i).T_camera_target, at.scale);
    return hand_eye::robot_residual(reading_.mount, {at.X, target(i, at)}, robot(i, at), seen);
  }
  double inflation(int i) const {
    return reading_.inflation.empty() ? 1.0 : reading_.inflation[static_cast<std::size_t>(i)];
  }

  void start() {
    std::vector<Pose> robot, seen;
    for (int i = 0; i < reading_.size(); ++i) {
      if (inflation(i) > 1.0 || (reading_.split > 0 && i >= reading_.split && reading_.split * 2 >= reading_.size()) ||
          (reading_.split > 0 && i < reading_.split && reading_.split * 2 < reading_.size()))
        continue;
      robot.push_back(reading_.robot[static_cast<std::size_t>(i)]);
      seen.push_back(solution(i).T_camera_target);
    }
    const ClosedForm c = closed_form(robot, seen, reading_.mount, reading_.free_scale);
    fit_.X = c.X, fit_.Y = fit_.Y_after = c.Z, fit_.scale = c.scale;
    if (reading_.split > 0) start_other_half();
    start_noise();
    linearise();
  }

  /// The half of the views that the closed form has not seen takes its target pose from the other's X.
  void start_other_half() {
    const bool late = reading_.split * 2 >= reading_.size();
    std::vector<Pose> targets;
    for (int i = late ? reading_.split : 0; i < (late ? reading_.size() : reading_.split); ++i) {
      const Pose& T = reading_.robot[static_cast<std::size_t>(i)];
      const Pose G = reading_.mount == Mount::EyeInHand ? T : T.inverse();
      targets.push_back(G * fit_.X * scaled(solution(i).T_camera_target, fit_.scale));
    }
    (late ? fit_.Y_after : fit_.Y) = mean_pose(targets);
  }

  void start_noise() {
    std::vector<double> p, r;
    for (int i = 0; i < reading_.size(); ++i) {
      const Vector6 e = residual(i, fit_);
      p.push_back(e.head<3>().norm());
      r.push_back(e.tail<3>().norm());
    }
    std::nth_element(p.begin(), p.begin() + p.size() / 2, p.end());
    std::nth_element(r.begin(), r.begin() + r.size() / 2, r.end());
    fit_.sigma_position = std::max(p[p.size() / 2], min_position);
    fit_.sigma_rotation = std::max(r[r.size() / 2], min_rotation);
  }

  /// Residual, covariance and derivatives of pair i at the present estimate.
  void linearise(int i) {
    Pair& pair = pairs_[static_cast<std::size_t>(i)];
    const Sighting::Solution& s = solution(i);
    const Pose C = scaled(s.T_camera_target, fit_.scale);
    pair.r = residual(i, fit_);
    pair.excess = s.excess;
    const auto by = hand_eye::robot_derivatives(reading_.mount, {fit_.X, target(i)}, C, pair.r);
    const Matrix6& B = by.by_target_seen;
    Vector6 unit = Vector6::Ones();
    unit.head<3>() *= fit_.scale;
    Vector6 noise;
    noise << Eigen::Vector3d::Constant(fit_.sigma_position * fit_.sigma_position),
        Eigen::Vector3d::Constant(fit_.sigma_rotation * fit_.sigma_rotation);
    pair.S = B * (unit.asDiagonal() * s.covariance * unit.asDiagonal()) * B.transpose();
    pair.S.diagonal() += noise;
    pair.S *= inflation(i);
    pair.S_inverse = pair.S.llt().solve(Matrix6::Identity());
    pair.J.setZero(6, 12 + reading_.extra());
    pair.J.leftCols<6>() = by.by_x;
    const int at = reading_.split > 0 && i >= reading_.split ? 12 : 6;
    pair.J.middleCols<6>(at) = by.by_z;
    int next = reading_.split > 0 ? 18 : 12;
    if (reading_.free_scale)  // log of the scale
      pair.J.col(next++) = B.leftCols<3>() * (C.linear().transpose() * C.translation());
    if (!reading_.drift.empty())
      pair.J.col(next) = -vector_by_perturbation(pair.r) * adjoint(to_pose(pair.r).inverse()) *
                         reading_.drift[static_cast<std::size_t>(i)];
  }
  void linearise() {
    for (int i = 0; i < reading_.size(); ++i) linearise(i);
  }

  void choose_solutions() {
    for (int i = 0; i < reading_.size(); ++i) {
      int& chosen = solution_[static_cast<std::size_t>(i)];
      double best = 1e300;
      int winner = 0;
      for (int k = 0; k < static_cast<int>(sighting(i).solutions.size()); ++k) {
        chosen = k;
        linearise(i);
        const double cost = misfit(i);
        if (cost < best) best = cost, winner = k;
      }
      chosen = winner;
      linearise(i);
    }
  }

  /// A squared residual of a pair in units of its noise, whose variance is so many times the usual one.
  static double misfit(const Pair& p, const Vector6& r, double spread) {
    return r.dot(p.S_inverse * r) / spread + p.excess;
  }
  double misfit(int i) const {
    const Pair& p = pairs_[static_cast<std::size_t>(i)];
    return misfit(p, p.r, 1.0);
  }
  /// Squared residuals in units of the noise of each pair.
  double total_misfit() const {
    double sum = 0;
    for (const Pair& p : pairs_) sum += misfit(p, p.r, p.spread);
    return sum;
  }
  double score() const {
    double sum = 0;
    for (int i = 0; i < reading_.size(); ++i)
      sum += cost(misfit(i)) + std::log(pairs_[static_cast<std::size_t>(i)].S.determinant());
    return sum;
  }
  /// What a squared distance costs in -2 log likelihood, without the constant of the normal distribution.
  double cost(double squared) const {
    if (tail_ == 0) return squared;
    return (tail_ + 6) * std::log1p(squared / tail_) + 6 * std::log(tail_ / 2) -
           2 * (std::lgamma((tail_ + 6) / 2) - std::lgamma(tail_ / 2));
  }
  /// One round of expectation maximisation for the t distribution.
  void update_spread() {
    if (tail_ == 0) return;
    for (int i = 0; i < reading_.size(); ++i)
      pairs_[static_cast<std::size_t>(i)].spread = (tail_ + misfit(i)) / (tail_ + 6);
  }

  Eigen::MatrixXd information() const {
    const int n = 12 + reading_.extra();
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n, n);
    for (const Pair& p : pairs_) H.noalias() += p.J.transpose() * p.S_inverse * p.J / p.spread;
    return H;
  }

  /// One step of both poses and what else is free, at fixed covariances.
  bool step() {
    NormalEquations<Eigen::Dynamic> equations(12 + reading_.extra());
    equations.information = information();
    for (const Pair& p : pairs_) equations.gradient += p.J.transpose() * (p.S_inverse * p.r) / p.spread;
    equations.cost = total_misfit();
    equations.count = 6 * reading_.size();
    // The covariances say what the unit is; they move after each step, so that a coarse end is enough.
    LevenbergMarquardt<Eigen::Dynamic> optimizer({.tolerance = 1e-6, .sigma = 1.0, .initial_damping = 1e-9});
    optimizer.begin(equations);
    while (optimizer.running()) {
      const ReadingFit trial = moved(optimizer.step());
      if (!optimizer.accept(misfit_at(trial))) continue;
      fit_ = trial;
      return true;
    }
    if (optimizer.status() == LevenbergMarquardtStatus::Converged) fit_ = moved(optimizer.step());
    return optimizer.status() != LevenbergMarquardtStatus::NotFinite;
  }

  ReadingFit moved(const Eigen::VectorXd& d) const {
    ReadingFit out = fit_;
    out.X = fit_.X * to_pose(d.head<6>());
    out.Y = fit_.Y * to_pose(d.segment<6>(6));
    int next = 12;
    if (reading_.split > 0)
      out.Y_after = fit_.Y_after * to_pose(d.segment<6>(12)), next = 18;
    else
      out.Y_after = out.Y;
    if (reading_.free_scale) out.scale *= std::exp(std::clamp(d[next], -0.5, 0.5)), ++next;
    if (!reading_.drift.empty()) out.lag += d[next];
    return out;
  }

  double misfit_at(const ReadingFit& at) const {
    double sum = 0;
    for (int i = 0; i < reading_.size(); ++i) {
      const Pair& p = pairs_[static_cast<std::size_t>(i)];
      sum += misfit(p, residual(i, at), p.spread);
    }
    return sum;
  }

  /// Fisher scoring of the two variances of the robot.
  void update_noise() {
    linearise();
    Eigen::Vector2d g = Eigen::Vector2d::Zero();
    Eigen::Matrix2d I = Eigen::Matrix2d::Zero();
    for (int i = 0; i < reading_.size(); ++i) {
      const Pair& p = pairs_[static_cast<std::size_t>(i)];
      const Matrix6 W = inflation(i) * p.S_inverse;
      const Vector6 u = p.S_inverse * p.r * std::sqrt(inflation(i) / p.spread);
      g -= Eigen::Vector2d(W.topLeftCorner<3, 3>().trace() - u.head<3>().squaredNorm(),
                           W.bottomRightCorner<3, 3>().trace() - u.tail<3>().squaredNorm());
      const double across = W.topRightCorner<3, 3>().squaredNorm();
      I += (Eigen::Matrix2d() << W.topLeftCorner<3, 3>().squaredNorm(), across, across,
            W.bottomRightCorner<3, 3>().squaredNorm())
               .finished();
    }
    const Eigen::Vector2d d = I.ldlt().solve(g);
    const auto moved = [](double sigma, double change, double least) {
      const double variance = std::clamp(sigma * sigma + change, 0.2 * sigma * sigma, 9.0 * sigma * sigma);
      return std::max(std::sqrt(variance), least);
    };
    if (!d.allFinite()) return;
    fit_.sigma_position = moved(fit_.sigma_position, d[0], min_position);
    fit_.sigma_rotation = moved(fit_.sigma_rotation, d[1], min_rotation);
  }

  ReadingFit finish() {
    fit_.score = score();
    for (int i = 0; i < reading_.size(); ++i) fit_.chi_squared.push_back(misfit(i));
    Eigen::MatrixXd H = information();
    if (tail_ > 0) {  // of the t distribution: its Fisher information, and standard deviations in place of its scales
      H *= (tail_ + 6) / (tail_ + 8);
      const double std_of_scale = std::sqrt(tail_ / (tail_ - 2));
      fit_.sigma_position *= std_of_scale, fit_.sigma_rotation *= std_of_scale;
    }
    H.diagonal().array() += 1e-9;
    fit_.covariance = H.ldlt().solve(Eigen::MatrixXd::Identity(H.rows(), H.cols()));
    fit_.usable = fit_.covariance.allFinite() && std::isfinite(fit_.score);
    return fit_;
  }

  const Reading& reading_;
  const Sightings& sightings_;
  const double tail_;
  std::vector<int> solution_;
  std::vector<Pair> pairs_;
  ReadingFit fit_;
};

}  // namespace

ReadingFit fit_reading(const Reading& reading, const Sightings& sightings) {
  if (reading.size() < 3) return {};
  ReadingFit best = Fitter(reading, sightings).run();
  if (!sightings.noise_varies) return best;
  for (const double tail : tails)
    if (ReadingFit other = Fitter(reading, sightings, tail).run();
        other.usable && !(best.usable && best.score < other.score))
      best = std::move(other);
  return best;
}

}  // namespace kr5::calibration::evidence
