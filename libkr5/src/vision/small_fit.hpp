// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace kr5::vision {

/// Sums of a least-squares step.
template <int N>
struct Normal {
  Eigen::Matrix<double, N, N> A = Eigen::Matrix<double, N, N>::Zero();
  Eigen::Matrix<double, N, 1> g = Eigen::Matrix<double, N, 1>::Zero();
  double cost = 0.0;
  int count = 0;

  /// One residual (model - seen), down-weighted beyond 3 `scale` (Huber).
  void add(const Eigen::Matrix<double, N, 1>& J, double residual, double scale) {
    const double size = std::abs(residual), bound = 3 * scale, w = size > bound ? bound / size : 1.0;
    for (int c = 0; c < N; ++c) {  // the lower half, in whole pairs; Eigen's rankUpdate is slower at this size
      const double factor = w * J[c];
      for (int r = c & ~1; r < N; ++r) A(r, c) += factor * J[r];
    }
    g += w * residual * J;
    cost += size > bound ? bound * (2 * size - bound) : size * size;
    ++count;
  }
};

constexpr double unknown_scale = 1e6;

template <int N>
struct SmallFit {
  Eigen::Matrix<double, N, 1> x;
  Eigen::Matrix<double, N, N> covariance;
  double sigma = 0.0;  ///< Of one residual.
  bool good = false;
};

/// Levenberg-Marquardt for a handful of parameters. `sums(x, scale)` returns the Normal at x; `settled(step)` says
/// when what a step leaves undone no longer matters: it is taken, and is the last. `scale`: of a residual, when known.
template <int N, class Sums, class Settled>
SmallFit<N> small_fit(Eigen::Matrix<double, N, 1> x, const Sums& sums, const Settled& settled,
                      double scale = unknown_scale, int max_steps = 30) {
  SmallFit<N> fit;
  fit.x = x;
  double lambda = 1e-4;
  Normal<N> now = sums(x, scale);
  if (now.count <= N) return fit;
  for (int i = 0; i < max_steps; ++i) {
    Eigen::Matrix<double, N, N> A = now.A.template selfadjointView<Eigen::Lower>();
    A.diagonal() *= 1 + lambda;
    const Eigen::Matrix<double, N, 1> step = -A.ldlt().solve(now.g);
    if (!step.allFinite()) return fit;
    if (scale < unknown_scale && settled(step)) {
      fit.good = true;
      x += step;
      break;
    }
    const Normal<N> next = sums(x + step, scale);
    if (!(next.cost <= now.cost * (1 + 1e-12)) || next.count <= N) {
      fit.good = settled(step);  // so small a step that leads nowhere: this is the minimum
      if (fit.good || (lambda *= 20) > 1e6) break;
      continue;
    }
    // Parameters that can stand in for each other wander on along the bottom of the valley: the height counts as well.
    fit.good = now.cost - next.cost < 1e-5 * next.cost;
    x += step;
    now = next;
    lambda = std::max(lambda * 0.1, 1e-9);
    if (fit.good && scale < unknown_scale) break;
    const double robust = std::max(std::sqrt(now.cost / (now.count - N)), 0.5);
    if (std::abs(robust - scale) > 0.2 * scale) {
      scale = robust;
      now = sums(x, scale);
    } else if (fit.good) {
      break;
    }
  }
  const Eigen::Matrix<double, N, N> A = now.A.template selfadjointView<Eigen::Lower>();
  fit.x = x;
  fit.sigma = std::sqrt(now.cost / (now.count - N));
  fit.covariance = fit.sigma * fit.sigma * A.ldlt().solve(Eigen::Matrix<double, N, N>::Identity());
  fit.good = fit.good && fit.covariance.allFinite();
  return fit;
}

/// Normal distribution function and density from a table (error below 3e-6).
class NormalTable {
 public:
  static const NormalTable& get() {
    static const NormalTable table;
    return table;
  }
  template <class T>
  void operator()(T z, T& cdf, T& pdf) const {
    if (z <= -limit) return void((cdf = 0, pdf = 0));
    if (z >= limit) return void((cdf = 1, pdf = 0));
    const T position = (z + static_cast<T>(limit)) * per_unit;
    const auto i = static_cast<std::size_t>(position);
    const T t = position - static_cast<T>(i);
    cdf = static_cast<T>(cdf_[i]) + t * static_cast<T>(cdf_[i + 1] - cdf_[i]);
    pdf = static_cast<T>(pdf_[i]) + t * static_cast<T>(pdf_[i + 1] - pdf_[i]);
  }

 private:
  static constexpr int per_unit = 128;
  static constexpr double limit = 4.5;
  static constexpr std::size_t size = static_cast<std::size_t>(2 * limit * per_unit) + 2;
  std::array<double, size> cdf_, pdf_;

  NormalTable() {
    for (std::size_t i = 0; i < size; ++i) {
      const double z = static_cast<double>(i) / per_unit - limit;
      cdf_[i] = 0.5 * std::erfc(-z * M_SQRT1_2);
      pdf_[i] = std::exp(-z * z / 2) * 0.3989422804014327;
    }
  }
};

}  // namespace kr5::vision
