// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/uncertainty/sobol.hpp>

#include <algorithm>
#include <cmath>
#include <sstream>

#include <boost/math/special_functions/erf.hpp>
#include <boost/random/sobol.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

namespace kr5::uncertainty {
namespace {

constexpr double root_two = 1.4142135623730951;

void check(const std::vector<UncertainInput>& inputs) {
  require(!inputs.empty(), "sobol_indices: there are no inputs");
  require(inputs.size() <= 1000, "sobol_indices: at most 1000 inputs");
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const UncertainInput& input = inputs[i];
    const std::string where = "input " + (input.name.empty() ? std::to_string(i) : input.name) + ": ";
    if (input.law == InputLaw::Uniform) {
      require(std::isfinite(input.low) && std::isfinite(input.high) && input.low < input.high,
              where + "low must lie below high");
      continue;
    }
    require(std::isfinite(input.mean), where + "mean must be finite");
    require(input.sigma > 0 && std::isfinite(input.sigma), where + "sigma must be positive");
    require(input.truncation > 0, where + "truncation must be positive [-]");
  }
}

/// Points of the unit cube: a Sobol sequence, shifted by a random vector modulo one, so that seeds are independent.
class ShiftedSobol {
 public:
  ShiftedSobol(std::size_t dimension, std::uint64_t seed) : sequence_(dimension), shift_(dimension) {
    Random random(seed);
    for (double& s : shift_) s = random.uniform();
  }
  void next(Eigen::Ref<Eigen::RowVectorXd> out) {
    constexpr double scale = 1.0 / 18446744073709551616.0;  // of 64 bits
    for (Eigen::Index k = 0; k < out.size(); ++k) {
      const double u = static_cast<double>(sequence_()) * scale + shift_[static_cast<std::size_t>(k)];
      out[k] = std::clamp(u - std::floor(u), 1e-15, 1 - 1e-15);
    }
  }

 private:
  boost::random::sobol sequence_;
  std::vector<double> shift_;
};

/// Sample matrices with the outputs of the model; grows by whole blocks.
struct Evaluations {
  const BatchModel& model;
  const std::vector<UncertainInput>& inputs;
  ShiftedSobol sequence;
  Eigen::MatrixXd of_a, of_b;             ///< Samples x outputs.
  std::vector<Eigen::MatrixXd> of_mixed;  ///< By input whose column is that of B.

  Eigen::MatrixXd outputs_of(const Eigen::MatrixXd& x) {
    Eigen::MatrixXd y = model(x);
    require(y.rows() == x.rows() && y.cols() > 0, "the model gave " + std::to_string(y.rows()) +
                                                      " rows of outputs for " + std::to_string(x.rows()) +
                                                      " rows of inputs");
    require(of_a.size() == 0 || y.cols() == of_a.cols(), "the model gave another number of outputs than before");
    require(y.allFinite(), "the model gave an output that is not finite");
    return y;
  }
  static void append(Eigen::MatrixXd& all, const Eigen::MatrixXd& more) {
    const Eigen::Index before = all.rows();
    Eigen::MatrixXd grown(before + more.rows(), more.cols());
    if (before) grown.topRows(before) = all;
    grown.bottomRows(more.rows()) = more;
    all = std::move(grown);
  }
  void add(int rows) {
    const auto d = static_cast<Eigen::Index>(inputs.size());
    Eigen::MatrixXd A(rows, d), B(rows, d);
    Eigen::RowVectorXd u(2 * d);
    for (int r = 0; r < rows; ++r) {
      sequence.next(u);
      for (Eigen::Index k = 0; k < d; ++k) {
        A(r, k) = inputs[static_cast<std::size_t>(k)].quantile(u[k]);
        B(r, k) = inputs[static_cast<std::size_t>(k)].quantile(u[d + k]);
      }
    }
    const Eigen::MatrixXd outputs_a = outputs_of(A);
    append(of_a, outputs_a);
    append(of_b, outputs_of(B));
    of_mixed.resize(inputs.size());
    for (Eigen::Index k = 0; k < d; ++k) {
      const Eigen::VectorXd keep = A.col(k);
      A.col(k) = B.col(k);
      append(of_mixed[static_cast<std::size_t>(k)], outputs_of(A));
      A.col(k) = keep;
    }
  }
};

/// Per-sample terms of one output, whose weighted means give its indices: f, f^2, and for each input both products.
Eigen::MatrixXd terms_of(const Evaluations& e, Eigen::Index output) {
  const Eigen::Index n = e.of_a.rows(), d = static_cast<Eigen::Index>(e.of_mixed.size());
  const double centre = (e.of_a.col(output).mean() + e.of_b.col(output).mean()) / 2;  // for rounding and for variance
  const Eigen::ArrayXd a = e.of_a.col(output).array() - centre, b = e.of_b.col(output).array() - centre;
  Eigen::MatrixXd out(n, 2 + 2 * d);
  out.col(0) = (a + b) / 2;
  out.col(1) = (a.square() + b.square()) / 2;
  for (Eigen::Index k = 0; k < d; ++k) {
    const Eigen::ArrayXd ab = e.of_mixed[static_cast<std::size_t>(k)].col(output).array() - centre;
    out.col(2 + k) = b * (ab - a);
    out.col(2 + d + k) = (a - ab).square() / 2;
  }
  return out;
}

/// Rows of indices (first of every input, then total) from rows of weighted means of the terms.
Eigen::MatrixXd indices_of(const Eigen::MatrixXd& means) {
  const Eigen::VectorXd variance = means.col(1) - means.col(0).cwiseAbs2();
  Eigen::MatrixXd out = means.rightCols(means.cols() - 2);
  for (Eigen::Index r = 0; r < out.rows(); ++r) out.row(r) *= variance[r] > 1e-300 ? 1 / variance[r] : 0.0;
  return out;
}

/// Counts of a bootstrap over rows, over their number: resamples x samples.
Eigen::MatrixXd bootstrap_weights(int resamples, Eigen::Index samples, std::uint64_t seed) {
  Random random(seed);
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(samples, resamples);
  for (int r = 0; r < resamples; ++r)
    for (Eigen::Index k = 0; k < samples; ++k) out(random.integer(static_cast<int>(samples)), r) += 1;
  return out.transpose() / static_cast<double>(samples);
}

double quantile_of(std::vector<double>& values, double p) {
  const auto at = static_cast<std::ptrdiff_t>(
      std::clamp(p * static_cast<double>(values.size()), 0.0, static_cast<double>(values.size()) - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

void estimate(const Evaluations& e, const SobolOptions& options, SobolResult& out) {
  const Eigen::Index d = static_cast<Eigen::Index>(e.of_mixed.size()), outputs = e.of_a.cols(), n = e.of_a.rows();
  for (Eigen::MatrixXd* m : {&out.first, &out.first_low, &out.first_high, &out.total, &out.total_low, &out.total_high})
    m->setZero(d, outputs);
  out.mean = (e.of_a.colwise().mean() + e.of_b.colwise().mean()).transpose() / 2;
  out.variance.resize(outputs);
  const Eigen::MatrixXd weights = bootstrap_weights(options.resamples, n, options.seed + 1);
  const double tail = (1 - options.confidence) / 2;
  for (Eigen::Index o = 0; o < outputs; ++o) {
    const Eigen::MatrixXd terms = terms_of(e, o);
    const Eigen::MatrixXd means = terms.colwise().mean();
    out.variance[o] = std::max(0.0, means(0, 1) - means(0, 0) * means(0, 0));
    const Eigen::MatrixXd indices = indices_of(means), drawn = indices_of(weights * terms);
    for (Eigen::Index k = 0; k < 2 * d; ++k) {
      std::vector<double> values(drawn.col(k).data(), drawn.col(k).data() + drawn.rows());
      const double low = quantile_of(values, tail), high = quantile_of(values, 1 - tail);
      const Eigen::Index input = k % d;
      (k < d ? out.first : out.total)(input, o) = indices(0, k);
      (k < d ? out.first_low : out.total_low)(input, o) = low;
      (k < d ? out.first_high : out.total_high)(input, o) = high;
    }
  }
}

bool narrow(const SobolResult& result, double tolerance) {
  return (result.first_high - result.first_low).maxCoeff() <= 2 * tolerance &&
         (result.total_high - result.total_low).maxCoeff() <= 2 * tolerance;
}

void add_notes(SobolResult& out) {
  const auto negative = (out.first.array() < 0).count();
  if (negative > 0) {
    std::ostringstream text;
    text << negative << " first-order estimates are negative, the least " << out.first.minCoeff()
         << ": indices are not, so these are zero within their intervals; more samples bring them nearer";
    out.notes.push_back(text.str());
  }
  for (Eigen::Index o = 0; o < out.variance.size(); ++o)
    if (out.variance[o] <= 1e-300)
      out.notes.push_back("output " + std::to_string(o + 1) + " does not vary: its indices are 0");
}

}  // namespace

double UncertainInput::quantile(double u) const {
  if (law == InputLaw::Uniform) return low + u * (high - low);
  const double tail = boost::math::erfc(truncation / root_two) / 2;  // below the cut
  const double p = tail + u * (1 - 2 * tail);
  return mean - sigma * root_two * boost::math::erfc_inv(2 * p);
}

void SobolOptions::validate() const {
  require(samples >= 8 && (samples & (samples - 1)) == 0, "samples must be a power of two, at least 8");
  require(max_samples == 0 || max_samples >= samples, "max_samples must be 0 or at least samples");
  require(tolerance >= 0 && std::isfinite(tolerance), "tolerance must not be negative [-]");
  require(max_samples == 0 || tolerance > 0, "tolerance must be positive where max_samples is given [-]");
  require(resamples >= 20, "resamples must be at least 20");
  require(confidence > 0 && confidence < 1, "confidence must lie between 0 and 1 [-]");
}

SobolResult sobol_indices(const BatchModel& model, const std::vector<UncertainInput>& inputs,
                          const SobolOptions& options) {
  options.validate();
  check(inputs);
  Evaluations evaluations{model, inputs, ShiftedSobol(2 * inputs.size(), options.seed), {}, {}, {}};
  SobolResult out;
  for (const UncertainInput& input : inputs) out.inputs.push_back(input.name);
  evaluations.add(options.samples);
  estimate(evaluations, options, out);
  while (options.max_samples > 0 && !narrow(out, options.tolerance) &&
         2 * evaluations.of_a.rows() <= options.max_samples) {
    evaluations.add(static_cast<int>(evaluations.of_a.rows()));
    estimate(evaluations, options, out);
  }
  out.converged = options.tolerance == 0 || narrow(out, options.tolerance);
  out.samples = static_cast<int>(evaluations.of_a.rows());
  out.evaluations = static_cast<std::int64_t>(out.samples) * static_cast<std::int64_t>(inputs.size() + 2);
  add_notes(out);
  return out;
}

}  // namespace kr5::uncertainty
