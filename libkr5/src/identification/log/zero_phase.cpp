// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/zero_phase.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <vector>

#include <kr5/core/error.hpp>

namespace kr5::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int max_filter_order = 12;

/// Second-order section in transposed direct form II, of unit gain at rest; of a first-order one b2 and a2 are zero.
struct FilterSection {
  double b0 = 1.0, b1 = 0.0, b2 = 0.0, a1 = 0.0, a2 = 0.0;
};

/// Sections of a Butterworth low-pass: bilinear transform of its analogue poles, the cut-off prewarped.
std::vector<FilterSection> butterworth_sections(int order, double cutoff, double step) {
  const double w = std::tan(std::numbers::pi * cutoff * step);
  std::vector<FilterSection> out;
  for (int k = 0; k < order / 2; ++k) {
    const double damping = 2 * std::cos(std::numbers::pi * (order - 1 - 2 * k) / (2.0 * order));
    const double scale = 1 / (1 + damping * w + w * w);
    const double b = w * w * scale;
    out.push_back({b, 2 * b, b, 2 * (w * w - 1) * scale, (1 - damping * w + w * w) * scale});
  }
  if (order % 2 == 1) out.push_back({w / (1 + w), w / (1 + w), 0.0, (w - 1) / (1 + w), 0.0});
  return out;
}

/// One pass, in place, from the state in which the filter has always been given the first value.
void filter_pass(const std::vector<FilterSection>& sections, VectorXd& x) {
  for (const FilterSection& f : sections) {
    double s1 = (1 - f.b0) * x[0], s2 = (f.b2 - f.a2) * x[0];
    for (double& value : x) {
      const double in = value;
      value = f.b0 * in + s1;
      s1 = f.b1 * in - f.a1 * value + s2;
      s2 = f.b2 * in - f.a2 * value;
    }
  }
}

/// Samples by which a signal is continued, in which the slowest section forgets all but a thousandth.
Index padding_length(double cutoff, double step, int order, Index samples) {
  const double settling = order / (cutoff * step);
  return std::min<Index>(samples - 1, static_cast<Index>(std::ceil(std::min(settling, 1e9))));
}

}  // namespace

MatrixXd zero_phase_low_pass(const Eigen::Ref<const MatrixXd>& values, double step, double cutoff, int order) {
  require(step > 0 && std::isfinite(step), "step must be positive [s]");
  require(order >= 1 && order <= max_filter_order, "order: 1 to 12");
  require(cutoff > 0 && cutoff * step < 0.5, "cutoff: found " + std::to_string(cutoff) +
                                                 " Hz, expected less than half the sampling rate, " +
                                                 std::to_string(0.5 / step) + " Hz");
  require(values.rows() >= 2, "values: at least two samples");
  const std::vector<FilterSection> sections = butterworth_sections(order, cutoff, step);
  const Index n = values.rows(), pad = padding_length(cutoff, step, order, n);
  MatrixXd out(n, values.cols());
  VectorXd x(n + 2 * pad);
  for (Index c = 0; c < values.cols(); ++c) {
    x.segment(pad, n) = values.col(c);
    for (Index k = 1; k <= pad; ++k) {
      x[pad - k] = 2 * values(0, c) - values(k, c);
      x[pad + n - 1 + k] = 2 * values(n - 1, c) - values(n - 1 - k, c);
    }
    filter_pass(sections, x);
    x.reverseInPlace();
    filter_pass(sections, x);
    out.col(c) = x.reverse().segment(pad, n);
  }
  return out;
}

MatrixXd central_differences(const Eigen::Ref<const MatrixXd>& values, double step) {
  require(values.rows() >= 3, "values: at least three samples");
  require(step > 0, "step must be positive [s]");
  const Index n = values.rows();
  MatrixXd out(n, values.cols());
  out.middleRows(1, n - 2) = (values.bottomRows(n - 2) - values.topRows(n - 2)) / (2 * step);
  out.row(0) = (-3 * values.row(0) + 4 * values.row(1) - values.row(2)) / (2 * step);
  out.row(n - 1) = (3 * values.row(n - 1) - 4 * values.row(n - 2) + values.row(n - 3)) / (2 * step);
  return out;
}

MatrixXd second_differences(const Eigen::Ref<const MatrixXd>& values, double step) {
  require(values.rows() >= 3, "values: at least three samples");
  require(step > 0, "step must be positive [s]");
  const Index n = values.rows();
  MatrixXd out(n, values.cols());
  out.middleRows(1, n - 2) =
      (values.topRows(n - 2) - 2 * values.middleRows(1, n - 2) + values.bottomRows(n - 2)) / (step * step);
  out.row(0) = out.row(1);
  out.row(n - 1) = out.row(n - 2);
  return out;
}

}  // namespace kr5::identification
