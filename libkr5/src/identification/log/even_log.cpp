// SPDX-License-Identifier: BSD-3-Clause
#include "identification/log/even_log.hpp"

#include <algorithm>
#include <cmath>

namespace kr5::identification {

namespace {

constexpr double clock_evenness = 0.02;  // mean deviation of steps above which rows are resampled, of a step
constexpr double smoother = 0.9;         // roughness under one clock, of that under the other, that decides

VectorXd even_grid(const VectorXd& t, double step) {
  const auto count = static_cast<Index>(std::floor((t[t.size() - 1] - t[0]) / step + 1e-6)) + 1;
  return VectorXd::LinSpaced(count, t[0], t[0] + step * static_cast<double>(count - 1));
}

/// Sum over the joints of the RMS second difference, each over the range of its joint.
double roughness(const MatrixXd& q) {
  const Index n = q.rows();
  const MatrixXd d = q.topRows(n - 2) - 2 * q.middleRows(1, n - 2) + q.bottomRows(n - 2);
  const VectorXd range = (q.colwise().maxCoeff() - q.colwise().minCoeff()).transpose().cwiseMax(1e-3);
  return (d.colwise().norm().transpose().cwiseQuotient(range)).sum() / std::sqrt(static_cast<double>(n));
}

bool uneven(const VectorXd& t, double step) {
  const Index n = t.size() - 1;
  return ((t.tail(n) - t.head(n)).array() - step).abs().mean() > clock_evenness * step;
}

/// Whether the samples of a run are even although its stamps are not.
bool samples_are_even(const VectorXd& t, const MatrixXd& q, double step, ClockModel model) {
  if (model != ClockModel::Automatic) return model == ClockModel::Even;
  return roughness(q) < smoother * roughness(resampled_log(t, q, even_grid(t, step)));
}

}  // namespace

MatrixXd resampled_log(const VectorXd& t, const MatrixXd& y, const VectorXd& grid) {
  MatrixXd out(grid.size(), y.cols());
  Index k = 0;
  const Index last = t.size() - 1;
  for (Index i = 0; i < grid.size(); ++i) {
    while (k + 1 < last && t[k + 1] <= grid[i]) ++k;
    const double h = t[k + 1] - t[k], s = std::clamp((grid[i] - t[k]) / h, 0.0, 1.0);
    const Index before = std::max<Index>(k - 1, 0), after = std::min(k + 2, last);
    const double s2 = s * s, s3 = s2 * s;
    const auto left = (y.row(k + 1) - y.row(before)) / (t[k + 1] - t[before]);
    const auto right = (y.row(after) - y.row(k)) / (t[after] - t[k]);
    out.row(i) = (2 * s3 - 3 * s2 + 1) * y.row(k) + (3 * s2 - 2 * s3) * y.row(k + 1) + h * (s3 - 2 * s2 + s) * left +
                 h * (s3 - s2) * right;
  }
  return out;
}

EvenRun even_run(const OrderedLog& data, const RowRange& run, ClockModel model, bool& even_clock) {
  const auto part = [&](const MatrixXd& m) {
    return m.size() > 0 ? MatrixXd(m.middleRows(run.first, run.size())) : MatrixXd();
  };
  const VectorXd t = data.log.t.segment(run.first, run.size());
  EvenRun out{t,
              part(data.log.q),
              part(data.log.qd),
              part(data.log.tau),
              part(data.log.temperature),
              (t[t.size() - 1] - t[0]) / static_cast<double>(t.size() - 1)};
  if (!uneven(t, data.step)) return out;
  if (samples_are_even(t, out.q, data.step, model)) {
    out.t = VectorXd::LinSpaced(t.size(), t[0], t[t.size() - 1]);
    even_clock = true;
    return out;
  }
  out.step = data.step;
  out.t = even_grid(t, data.step);
  out.q = resampled_log(t, out.q, out.t);
  if (out.qd.size() > 0) out.qd = resampled_log(t, out.qd, out.t);
  out.tau = resampled_log(t, out.tau, out.t);
  if (out.temperature.size() > 0) out.temperature = resampled_log(t, out.temperature, out.t);
  return out;
}

}  // namespace kr5::identification
