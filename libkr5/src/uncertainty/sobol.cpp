// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/uncertainty/sobol.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "scrambled_sobol.hpp"

namespace kr5::uncertainty {
namespace {

/// Inputs that have indices, by their place among all.
std::vector<Eigen::Index> checked_free(const std::vector<UncertainInput>& inputs) {
  require(!inputs.empty(), "sobol_indices: there are no inputs");
  require(inputs.size() <= 1000, "sobol_indices: at most 1000 inputs");
  std::vector<Eigen::Index> out;
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    inputs[k].validate();
    if (!inputs[k].averaged) out.push_back(static_cast<Eigen::Index>(k));
  }
  require(!out.empty(), "sobol_indices: every input is averaged over");
  return out;
}

/// Sums over the rows of a replicate, a column an output: rows 0 to 2 of f, f^2 and of half the squared difference of
/// both matrices, then of each input the products of its first-order and of its total index.
using Sums = Eigen::MatrixXd;
constexpr Eigen::Index sum_f = 0, sum_squares = 1, sum_differences = 2, sum_inputs = 3;

struct Averages {
  std::vector<Sums> by_replicate;
  Eigen::RowVectorXd centre, largest;
  Eigen::Index rows = 0;
};

Averages averages_of(const Rows& outputs, Eigen::Index free, int replicates) {
  const Eigen::Index each = free + 2, n = outputs.rows() / each, count = outputs.cols();
  Averages out{
      .by_replicate = std::vector<Sums>(static_cast<std::size_t>(replicates), Sums::Zero(sum_inputs + 2 * free, count)),
      .centre = Eigen::RowVectorXd::Zero(count),
      .largest = outputs.cwiseAbs().colwise().maxCoeff(),
      .rows = n};
  for (Eigen::Index i = 0; i < n; ++i)  // against rounding: variances of outputs far from 0
    out.centre += (outputs.row(i * each) + outputs.row(i * each + each - 1)) / static_cast<double>(2 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    Sums& sums = out.by_replicate[static_cast<std::size_t>(i % replicates)];
    const auto block = outputs.middleRows(i * each, each);
    for (Eigen::Index o = 0; o < count; ++o) {
      const double a = block(0, o) - out.centre[o], b = block(each - 1, o) - out.centre[o];
      double* column = &sums(0, o);
      column[sum_f] += (a + b) / 2;
      column[sum_squares] += (a * a + b * b) / 2;
      column[sum_differences] += (a - b) * (a - b) / 2;
      for (Eigen::Index k = 0; k < free; ++k) {
        const double mixed = block(1 + k, o) - out.centre[o];
        column[sum_inputs + k] += b * (mixed - a);
        column[sum_inputs + free + k] += (a - mixed) * (a - mixed) / 2;
      }
    }
  }
  return out;
}

/// Variance of an output from its sums; where inputs are averaged over, both matrices share them.
double variance_of(const Eigen::Ref<const Eigen::VectorXd>& sums, double rows, bool averaged) {
  if (averaged) return sums[sum_differences] / rows;
  const double mean = sums[sum_f] / rows;
  return std::max(0.0, sums[sum_squares] / rows - mean * mean);
}

/// Indices (first of every input, then total) of one output from its sums.
Eigen::VectorXd indices_of(const Eigen::Ref<const Eigen::VectorXd>& sums, double rows, double variance) {
  return sums.tail(sums.size() - sum_inputs) / (rows * variance);
}

/// How often a bootstrap sample draws each replicate: resamples x replicates.
Eigen::MatrixXd bootstrap_counts(const SobolOptions& options) {
  Random random(options.seed + 1);
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(options.resamples, options.replicates);
  for (Eigen::Index r = 0; r < out.rows(); ++r)
    for (int k = 0; k < options.replicates; ++k) out(r, random.integer(options.replicates)) += 1;
  return out;
}

/// Standard errors of the indices of one output, by drawing replicates.
Eigen::VectorXd standard_errors(const Averages& averages, Eigen::Index output, const Eigen::MatrixXd& counts,
                                bool averaged) {
  const Eigen::Index replicates = counts.cols(), size = averages.by_replicate.front().rows();
  Eigen::MatrixXd own(replicates, size);
  for (Eigen::Index r = 0; r < replicates; ++r)
    own.row(r) = averages.by_replicate[static_cast<std::size_t>(r)].col(output).transpose();
  const Eigen::MatrixXd drawn = counts * own;
  Eigen::MatrixXd indices(drawn.rows(), size - sum_inputs);
  const auto rows = static_cast<double>(averages.rows);
  Eigen::Index used = 0;
  for (Eigen::Index r = 0; r < drawn.rows(); ++r) {
    const Eigen::VectorXd sums = drawn.row(r).transpose();
    if (const double v = variance_of(sums, rows, averaged); v > 0)
      indices.row(used++) = indices_of(sums, rows, v).transpose();
  }
  if (used < 2) return Eigen::VectorXd::Zero(indices.cols());
  const auto valid = indices.topRows(used);
  const Eigen::RowVectorXd mean = valid.colwise().mean();
  const double few =
      static_cast<double>(replicates) / static_cast<double>(replicates - 1);  // of a bootstrap of so many
  return ((valid.rowwise() - mean).colwise().squaredNorm() * few / static_cast<double>(used - 1)).cwiseSqrt();
}

void add_negative_note(SobolResult& out) {
  constexpr double rounding = 1e-12;
  const auto count = (out.first.array() < -rounding).count();
  if (count == 0) return;
  Eigen::Index input = 0, output = 0;
  const double least = out.first.minCoeff(&input, &output);
  const auto beyond = (out.first_high.array() < -rounding).count();
  std::ostringstream text;
  text << count << (count == 1 ? " first-order estimate is" : " first-order estimates are") << " negative, the least "
       << least << " (" << out.inputs[static_cast<std::size_t>(input)] << ", output " << output + 1
       << "): no index is below zero, but the estimate of a small one scatters about it. ";
  if (beyond == 0)
    text << "Zero lies within the interval of each; more samples narrow them.";
  else
    text << "Zero lies outside the interval of " << beyond
         << ", as chance makes of some among many; where that stays with another seed, the model does not give the "
            "same output for the same input.";
  out.notes.push_back(text.str());
}

}  // namespace

void SobolOptions::validate() const {
  const auto power = [](int x) { return x > 0 && (x & (x - 1)) == 0; };
  require(power(replicates) && replicates >= 8 && replicates <= 4096,
          "replicates must be a power of two from 8 to 4096");
  require(power(samples), "samples must be a power of two, found " + std::to_string(samples));
  require(samples >= 2 * replicates, "samples must be at least two for each of the " + std::to_string(replicates) +
                                         " replicates, found " + std::to_string(samples));
  require(max_samples == 0 || max_samples >= samples, "max_samples must be 0 or at least samples");
  require(tolerance >= 0 && std::isfinite(tolerance), "tolerance must not be negative [-]");
  require(max_samples == 0 || tolerance > 0, "tolerance must be positive where max_samples is given [-]");
  require(resamples >= 20, "resamples must be at least 20");
  require(confidence > 0 && confidence < 1, "confidence must lie between 0 and 1 [-]");
  require(resolution >= 0 && std::isfinite(resolution), "resolution must not be negative");
}

Rows sobol_design(const std::vector<UncertainInput>& inputs, int first, int rows, const SobolOptions& options) {
  options.validate();
  require(first >= 0 && rows > 0, "sobol_design: rows begin at 0, and there is at least one");
  const std::vector<Eigen::Index> free = checked_free(inputs);
  const auto d = static_cast<Eigen::Index>(inputs.size()), each = static_cast<Eigen::Index>(free.size()) + 2;
  const ScrambledSobol sequence(d + each - 2, options.replicates, options.seed);
  Rows out(rows * each, d);
  Eigen::MatrixXd points;
  for (int r = 0; r < options.replicates; ++r) {
    const int begin = (first - r + options.replicates - 1) / options.replicates;  // first point of this replicate
    const int end = (first + rows - r + options.replicates - 1) / options.replicates;
    if (end <= begin) continue;
    points.resize(end - begin, sequence.dimension());
    sequence.points(r, begin, points);
    for (int p = begin; p < end; ++p) {
      auto block = out.middleRows((p * options.replicates + r - first) * each, each);
      for (Eigen::Index k = 0; k < d; ++k)
        block.col(k).setConstant(inputs[static_cast<std::size_t>(k)].quantile(points(p - begin, k)));
      for (Eigen::Index k = 0; k < each - 2; ++k) {
        const Eigen::Index input = free[static_cast<std::size_t>(k)];
        const double b = inputs[static_cast<std::size_t>(input)].quantile(points(p - begin, d + k));
        block(1 + k, input) = block(each - 1, input) = b;
      }
    }
  }
  return out;
}

SobolResult sobol_estimate(const Rows& outputs, const std::vector<UncertainInput>& inputs,
                           const SobolOptions& options) {
  const std::vector<Eigen::Index> free = checked_free(inputs);
  const auto d = static_cast<Eigen::Index>(free.size()), count = outputs.cols();
  options.validate();
  require(outputs.rows() > 0 && count > 0 && outputs.rows() % ((d + 2) * options.replicates) == 0,
          "sobol_estimate: " + std::to_string(outputs.rows()) + " rows of outputs are not " + std::to_string(d + 2) +
              " for each row of the design and as many of these in each replicate");
  require(outputs.allFinite(), "the model gave an output that is not finite");
  SobolResult out;
  for (const Eigen::Index k : free) out.inputs.push_back(inputs[static_cast<std::size_t>(k)].name);
  for (Eigen::MatrixXd* m : {&out.first, &out.first_low, &out.first_high, &out.total, &out.total_low, &out.total_high})
    m->setZero(d, count);
  const bool averaged = free.size() < inputs.size();
  const Averages averages = averages_of(outputs, d, options.replicates);
  const Eigen::MatrixXd counts = bootstrap_counts(options);
  const double factor = student_factor(options.replicates - 1, options.confidence);
  const auto rows = static_cast<double>(averages.rows);
  out.mean = averages.centre.transpose();
  out.variance.resize(count);
  for (Eigen::Index o = 0; o < count; ++o) {
    Eigen::VectorXd sums = Eigen::VectorXd::Zero(sum_inputs + 2 * d);
    for (const Sums& own : averages.by_replicate) sums += own.col(o);
    out.variance[o] = variance_of(sums, rows, averaged);
    const double rounding = 64 * std::numeric_limits<double>::epsilon() * averages.largest[o];
    if (out.variance[o] <= std::pow(std::max({rounding, options.resolution, 1e-150}), 2)) {
      out.variance[o] = 0;
      out.notes.push_back("output " + std::to_string(o + 1) + " does not vary: its indices are 0");
      continue;
    }
    const Eigen::VectorXd indices = indices_of(sums, rows, out.variance[o]);
    const Eigen::VectorXd half = factor * standard_errors(averages, o, counts, averaged);
    out.first.col(o) = indices.head(d), out.total.col(o) = indices.tail(d);
    out.first_low.col(o) = (indices - half).head(d), out.first_high.col(o) = (indices + half).head(d);
    out.total_low.col(o) = (indices - half).tail(d), out.total_high.col(o) = (indices + half).tail(d);
  }
  out.samples = static_cast<int>(averages.rows);
  out.evaluations = outputs.rows();
  out.converged = options.tolerance == 0 || intervals_within(out, options.tolerance);
  add_negative_note(out);
  return out;
}

bool intervals_within(const SobolResult& result, double tolerance) {
  return (result.first_high - result.first_low).maxCoeff() <= 2 * tolerance &&
         (result.total_high - result.total_low).maxCoeff() <= 2 * tolerance;
}

SobolResult sobol_indices(const BatchModel& model, const std::vector<UncertainInput>& inputs,
                          const SobolOptions& options) {
  options.validate();
  constexpr int block = 1024;  // rows whose inputs are held at a time
  Rows outputs;
  int done = 0;
  for (int samples = options.samples;; samples *= 2) {
    while (done < samples) {
      const int rows = std::min(block, samples - done);
      const Rows x = sobol_design(inputs, done, rows, options);
      const Rows y = model(x);
      require(y.rows() == x.rows() && y.cols() > 0, "the model gave " + std::to_string(y.rows()) +
                                                        " rows of outputs for " + std::to_string(x.rows()) +
                                                        " rows of inputs");
      require(done == 0 || y.cols() == outputs.cols(), "the model gave another number of outputs than before");
      require(y.allFinite(), "the model gave an output that is not finite");
      const Eigen::Index each = x.rows() / rows;
      if (outputs.rows() < samples * each) outputs.conservativeResize(samples * each, y.cols());
      outputs.middleRows(done * each, y.rows()) = y;
      done += rows;
    }
    SobolResult out = sobol_estimate(outputs, inputs, options);
    if (out.converged || 2 * static_cast<std::int64_t>(samples) > options.max_samples) return out;
  }
}

}  // namespace kr5::uncertainty
