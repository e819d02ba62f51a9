// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/cubic_spline.hpp>

#include <algorithm>

namespace kr5::physics {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// Slopes at the points: one tridiagonal system, its first and last row the not-a-knot conditions (de Boor 1978, IV).
VectorXd slopes(const VectorXd& h, const VectorXd& d) {
  const Index n = d.size() + 1;
  VectorXd low(n), diagonal(n), up(n), s(n);
  for (Index i = 1; i < n - 1; ++i) {
    low[i] = h[i];
    diagonal[i] = 2 * (h[i - 1] + h[i]);
    up[i] = h[i - 1];
    s[i] = 3 * (h[i] * d[i - 1] + h[i - 1] * d[i]);
  }
  const double first = h[0] + h[1], last = h[n - 2] + h[n - 3];
  diagonal[0] = h[1], up[0] = first;
  s[0] = ((h[0] + 2 * first) * h[1] * d[0] + h[0] * h[0] * d[1]) / first;
  diagonal[n - 1] = h[n - 3], low[n - 1] = last;
  s[n - 1] = (h[n - 2] * h[n - 2] * d[n - 3] + (2 * last + h[n - 2]) * h[n - 3] * d[n - 2]) / last;
  for (Index i = 1; i < n; ++i) {
    const double m = low[i] / diagonal[i - 1];
    diagonal[i] -= m * up[i - 1];
    s[i] -= m * s[i - 1];
  }
  s[n - 1] /= diagonal[n - 1];
  for (Index i = n - 2; i >= 0; --i) s[i] = (s[i] - up[i] * s[i + 1]) / diagonal[i];
  return s;
}

}  // namespace

SplinePieces cubic_spline(const Eigen::Ref<const VectorXd>& t, const Eigen::Ref<const VectorXd>& y) {
  const Index n = t.size();
  SplinePieces out = SplinePieces::Zero(std::max<Index>(n - 1, 0), 4);
  if (n < 2) return out;
  const VectorXd h = t.tail(n - 1) - t.head(n - 1);
  const VectorXd d = (y.tail(n - 1) - y.head(n - 1)).cwiseQuotient(h);
  VectorXd s = VectorXd::Constant(n, d[0]);
  if (n == 3) {
    const double bend = (d[1] - d[0]) / (h[0] + h[1]);
    s << d[0] - bend * h[0], d[0] + bend * h[0], d[1] + bend * h[1];
  } else if (n > 3) {
    s = slopes(h, d);
  }
  for (Index k = 0; k < n - 1; ++k) {
    const double c3 = (s[k] + s[k + 1] - 2 * d[k]) / (h[k] * h[k]);
    out.row(k) << y[k], s[k], (d[k] - s[k]) / h[k] - c3 * h[k], c3;
  }
  return out;
}

Eigen::Matrix<double, Eigen::Dynamic, 3> spline_motion(const Eigen::Ref<const VectorXd>& t,
                                                       const Eigen::Ref<const VectorXd>& y) {
  const SplinePieces pieces = cubic_spline(t, y);
  const Index n = t.size(), last = pieces.rows() - 1;
  Eigen::Matrix<double, Eigen::Dynamic, 3> out(n, 3);
  if (last < 0) {
    out.setZero();
    out.col(0) = y;
    return out;
  }
  for (Index k = 0; k < n; ++k) {
    const Index piece = std::min(k, last);
    out.row(k) = spline_state(pieces.row(piece), t[k] - t[piece]).transpose();
  }
  return out;
}

}  // namespace kr5::physics
