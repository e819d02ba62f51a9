// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye/noise.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include <kr5/core/linear.hpp>
#include <kr5/uncertainty/confidence.hpp>

namespace kr5::calibration::hand_eye {
namespace {

using Matrix6x12 = Eigen::Matrix<double, 6, 12>;

// Below these nothing a robot or a camera does can be seen; they keep exact data solvable.
const Eigen::Vector3d noise_floor = Eigen::Vector3d(1e-7, 1e-7, 1e-5).cwiseAbs2();
constexpr double lever_deviation = 1.25;  // of the logarithm of the ratio of the two robot deviations

/// Derivative of the covariance of y by variance k.
Matrix6 derivative(const LinearView& view, int k) {
  if (k == 2) return view.U;
  Matrix6 E = Matrix6::Zero();
  E.diagonal().segment<3>(3 * k).setOnes();
  return E;
}

/// What REML and its information matrix need of the data, at given variances.
struct Moments {
  Estimate estimate;
  Eigen::Vector3d trace = Eigen::Vector3d::Zero();        ///< tr(P V_k)
  Eigen::Vector3d quadratic = Eigen::Vector3d::Zero();    ///< y' P V_k P y
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  ///< tr(P V_k P V_l) / 2
  std::array<Matrix12, 3> P;                              ///< F' V^-1 V_k V^-1 F
};

/// The pixels inside each view tell their own variance, whatever the robot does.
void add_pixels(std::span<const WeightedView> views, const Variances& v, Moments& m) {
  double squares = 0, dof = 0;
  for (const WeightedView& w : views) {
    squares += w.view.pixel_squares;
    dof += w.view.pixel_dof;
  }
  m.trace[2] += dof / v.value[2];
  m.quadratic[2] += squares / (v.value[2] * v.value[2]);
  m.information(2, 2) += 0.5 * dof / (v.value[2] * v.value[2]);
}

/// tr(A B)
double trace_of(const auto& A, const auto& B) { return A.cwiseProduct(B.transpose()).sum(); }

// Eigen's general product is slow for matrices of this size, hence lazyProduct.
Moments moments(std::span<const WeightedView> views, const Variances& v) {
  Moments m;
  m.estimate = solve(views, v);
  const Matrix12& C = m.estimate.covariance;
  for (auto& p : m.P) p.setZero();
  for (const auto& [view, weight] : views) {
    const Matrix6 V_inverse = weight * v.of(view).ldlt().solve(Matrix6::Identity());
    const Matrix6x12 G = V_inverse.lazyProduct(view.F);
    const Vector6 r = V_inverse * (view.y - view.F * m.estimate.b);
    const Matrix6 fitted = G.lazyProduct(C).eval().lazyProduct(G.transpose());
    std::array<Matrix6, 3> VD, FD;
    for (int k = 0; k < 3; ++k) {
      const Matrix6 D = derivative(view, k) / weight;
      m.P[k] += G.transpose().lazyProduct(D.lazyProduct(G).eval());
      VD[k] = V_inverse.lazyProduct(D);
      FD[k] = fitted.lazyProduct(D);
      m.trace[k] += VD[k].trace() - FD[k].trace();
      m.quadratic[k] += r.dot(D * r);
    }
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 3; ++l) m.information(k, l) += 0.5 * trace_of(VD[k], VD[l]) - trace_of(FD[k], VD[l]);
  }
  std::array<Matrix12, 3> CP;
  for (int k = 0; k < 3; ++k) CP[k] = C.lazyProduct(m.P[k]);
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < 3; ++l) m.information(k, l) += 0.5 * trace_of(CP[k], CP[l]);
  add_pixels(views, v, m);
  return m;
}

/// What uncertainty W of the variances adds to C, to first order: sum of W_kl (Q_kl - P_k C P_l) with
/// Q_kl = F' V^-1 V_k V^-1 V_l V^-1 F.
Matrix12 spread_of_variances(std::span<const WeightedView> views, const Variances& v, const Moments& m,
                             const Eigen::Matrix3d& W) {
  Matrix12 sum = Matrix12::Zero();
  for (const auto& [view, weight] : views) {
    const Matrix6 V_inverse = weight * v.of(view).ldlt().solve(Matrix6::Identity());
    const Matrix6x12 G = V_inverse * view.F;
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 3; ++l)
        sum += W(k, l) / (weight * weight) * G.transpose() * derivative(view, k) * V_inverse * derivative(view, l) * G;
  }
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < 3; ++l) sum -= W(k, l) * m.P[k] * m.estimate.covariance * m.P[l];
  return sum;
}

/// Adds the loose expectation of the ratio of robot position and rotation noise to score and information in
/// log-variances: without it three views could put all scatter into either.
void add_lever(const Variances& v, Eigen::Vector3d& score, Eigen::Matrix3d& information) {
  if (!v.free[0] || !v.free[1]) return;
  const double off = 0.5 * std::log(v.value[0] / v.value[1]) - std::log(v.lever);
  const double pull = 1 / (lever_deviation * lever_deviation);
  const Eigen::Vector3d by(0.5, -0.5, 0);
  score -= pull * off * by;
  information += pull * by * by.transpose();
}

/// Covariance of the free variances.
Eigen::Matrix3d variance_covariance(const Moments& m, const Variances& v) {
  Eigen::Vector3d score = Eigen::Vector3d::Zero();
  const Eigen::Matrix3d scale = v.value.asDiagonal();
  Eigen::Matrix3d information = scale * m.information * scale;
  add_lever(v, score, information);
  for (int k = 0; k < 3; ++k)
    if (!v.free[k]) {
      information.row(k).setZero();
      information.col(k).setZero();
      information(k, k) = 1;
    }
  Eigen::Matrix3d W = information.ldlt().solve(Eigen::Matrix3d::Identity());
  for (int k = 0; k < 3; ++k)
    if (!v.free[k]) W(k, k) = 0;
  return scale * W * scale;
}

}  // namespace

Matrix6 Variances::robot() const {
  Matrix6 S = Matrix6::Zero();
  S.diagonal() << value[0], value[0], value[0], value[1], value[1], value[1];
  return S;
}

Estimate solve(std::span<const WeightedView> views, const Variances& variances) {
  Matrix12 N = Matrix12::Zero();
  Vector12 h = Vector12::Zero();
  for (const auto& [view, weight] : views) {
    const Matrix6x12 G = weight * variances.of(view).ldlt().solve(view.F);
    N += view.F.transpose().lazyProduct(G);
    h += G.transpose() * view.y;
  }
  // Metres and radians differ in size: judge the rank with a unit diagonal.
  const Vector12 s = N.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const SymmetricEigen eigen = symmetric_eigen(s.asDiagonal() * N * s.asDiagonal());
  Estimate out;
  const Vector12 values = eigen.values;
  out.regular = values.allFinite() && values[0] > 1e-11 * values[11];
  const Vector12 inverse = values.cwiseMax(1e-13 * values[11]).cwiseInverse();
  out.covariance = s.asDiagonal() * eigen.vectors * inverse.asDiagonal() * eigen.vectors.transpose() * s.asDiagonal();
  out.b = out.covariance * h;
  return out;
}

void estimate_variances(std::span<const WeightedView> views, Variances& v, int max_steps) {
  for (int k = 0; k < 3; ++k)
    if (v.free[k]) v.value[k] = std::max(v.value[k], noise_floor[k]);
  for (int step = 0; step < max_steps; ++step) {
    const Moments m = moments(views, v);
    const Eigen::Matrix3d scale = v.value.asDiagonal();
    Eigen::Vector3d score = 0.5 * scale * (m.quadratic - m.trace);
    Eigen::Matrix3d information = scale * m.information * scale;
    add_lever(v, score, information);
    for (int k = 0; k < 3; ++k)
      if (!v.free[k] || (v.value[k] <= noise_floor[k] && score[k] < 0)) {
        information.row(k).setZero();
        information.col(k).setZero();
        information(k, k) = 1;
        score[k] = 0;
      }
    information.diagonal().array() += 1e-9;
    const Eigen::Vector3d change = information.ldlt().solve(score).cwiseMax(-1.5).cwiseMin(1.5);
    if (!change.allFinite()) return;
    for (int k = 0; k < 3; ++k)
      if (v.free[k]) v.value[k] = std::max(v.value[k] * std::exp(change[k]), noise_floor[k]);
    if (change.cwiseAbs().maxCoeff() < 1e-5) return;
  }
}

WidenedCovariance widened_covariance(std::span<const WeightedView> views, const Variances& v, int first) {
  const Moments m = moments(views, v);
  const Matrix12& C = m.estimate.covariance;
  WidenedCovariance out{C.block<6, 6>(first, first), uncertainty::known_noise};
  if (!v.free[0] && !v.free[1] && !v.free[2]) return out;
  const Eigen::Matrix3d W = variance_covariance(m, v);
  const Matrix12 bias = spread_of_variances(views, v, m, W);
  const Matrix6 T = C.block<6, 6>(first, first).ldlt().solve(Matrix6::Identity());
  std::array<Matrix6, 3> S;
  for (int k = 0; k < 3; ++k) S[k] = T * (C * m.P[k] * C).block<6, 6>(first, first);
  double A1 = 0, A2 = 0;
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < 3; ++l) {
      A1 += W(k, l) * S[k].trace() * S[l].trace();
      A2 += W(k, l) * (S[k] * S[l]).trace();
    }
  if (!(A2 > 1e-9)) return out;
  // Kenward and Roger 1997, section 3: the F distribution with the same first two moments.
  const double n = 6, B = (A1 + 6 * A2) / (2 * n), g = ((n + 1) * A1 - (n + 4) * A2) / ((n + 2) * A2);
  const double below = 3 * n + 2 * (1 - g), c1 = g / below, c2 = (n - g) / below, c3 = (n + 2 - g) / below;
  const double mean = 1 / (1 - std::min(A2 / n, 0.9));
  const double variance = 2 / n * (1 + c1 * B) / (std::pow(1 - std::min(c2 * B, 0.9), 2) * (1 - std::min(c3 * B, 0.9)));
  const double ratio = variance / (2 * mean * mean);
  out.dof = n * ratio > 1 ? std::clamp(4 + (n + 2) / (n * ratio - 1), 3.0, uncertainty::known_noise)
                          : uncertainty::known_noise;
  const double scale = out.dof / (mean * (out.dof - 2));
  out.covariance =
      (C + 2 * C * bias * C).block<6, 6>(first, first) * (uncertainty::covariance_inflation(n, out.dof) / scale);
  return out;
}

}  // namespace kr5::calibration::hand_eye
