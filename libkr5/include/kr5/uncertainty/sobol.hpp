// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <kr5/uncertainty/uncertain_input.hpp>

/// @file
/// Global sensitivity by Sobol's indices: uncertain inputs ranked by their share of the variance of an output (Hayat
/// et al. 2022, section 3.2.2).

namespace kr5::uncertainty {

struct SobolOptions {
  int samples = 4096;
  int max_samples = 0;
  double tolerance = 0.0;  ///< [-]
  int replicates = 16;
  int resamples = 1000;
  double confidence = 0.95;  ///< [-]
  double resolution = 0.0;
  std::uint64_t seed = 1;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("samples", self.samples,
          "Rows of each of the two sample matrices, a power of two; the model is evaluated about (inputs + 2) times as "
          "often.");
    visit("max_samples", self.max_samples,
          "Rows up to which they are doubled until every interval is narrower than `tolerance`; 0: they are not.");
    visit("tolerance", self.tolerance, "Half width of an interval that suffices [-].");
    visit("replicates", self.replicates,
          "Independent randomisations of the sequence, a power of two, from whose scatter the intervals come.");
    visit("resamples", self.resamples, "Bootstrap samples behind the intervals.");
    visit("confidence", self.confidence, "Confidence of the intervals [-].");
    visit("resolution", self.resolution,
          "Standard deviation up to which an output counts as constant, in its unit; its rounding always does.");
    visit("seed", self.seed, "Random seed.");
  }
};

/// Indices of every input (row) for every output (column) [-]; of inputs that are averaged over there are none.
struct SobolResult {
  std::vector<std::string> inputs;
  Eigen::MatrixXd first, first_low, first_high;
  Eigen::MatrixXd total, total_low, total_high;
  Eigen::VectorXd mean;
  Eigen::VectorXd variance;
  int samples = 0;
  std::int64_t evaluations = 0;
  bool converged = true;
  std::vector<std::string> notes;

  static void each_field(auto& self, auto&& visit) {
    visit("inputs", self.inputs, "Names of the inputs.");
    visit("first", self.first, "First-order indices, inputs x outputs: share of the variance by the input alone [-].");
    visit("first_low", self.first_low, "Lower ends of their intervals [-].");
    visit("first_high", self.first_high, "Upper ends of their intervals [-].");
    visit("total", self.total, "Total indices, inputs x outputs: share with all its interactions [-].");
    visit("total_low", self.total_low, "Lower ends of their intervals [-].");
    visit("total_high", self.total_high, "Upper ends of their intervals [-].");
    visit("mean", self.mean, "Mean of each output, in its unit.");
    visit("variance", self.variance, "Variance of each output, in the square of its unit.");
    visit("samples", self.samples, "Rows of each sample matrix that were used.");
    visit("evaluations", self.evaluations, "Evaluations of the model.");
    visit("converged", self.converged, "Whether every interval is as narrow as was asked for.");
    visit("notes", self.notes, "Explanations, such as of negative estimates.");
  }
};

/// Inputs at which the model is to be evaluated for rows `first` to `first + rows` of the sample matrices A and B: for
/// each the row of A, that with the value of B in one input after the other (without those averaged over), and the row
/// of B. The order is that of SALib. Row i belongs to replicate i mod `replicates`: any number of rows may be added.
/// @throws InvalidArgument for no inputs, or one that is not valid.
Rows sobol_design(const std::vector<UncertainInput>& inputs, int first, int rows, const SobolOptions& options = {});

/// Indices from the outputs at a design of a whole number of rows for every replicate, its rows from 0 in order.
///
/// First-order indices after Saltelli et al. 2010, total ones after Jansen 1999. The replicates are independent, so
/// drawing them with replacement gives the standard error of an estimate; the interval is that with Student's factor.
/// An output without variance has indices 0.
/// @throws InvalidArgument for outputs that are not finite or of another number.
SobolResult sobol_estimate(const Rows& outputs, const std::vector<UncertainInput>& inputs,
                           const SobolOptions& options = {});

/// Whether half of every interval is at most `tolerance`.
bool intervals_within(const SobolResult& result, double tolerance);

/// Estimates the indices of a model: design, evaluation, estimate, and more rows until the intervals are narrow enough.
/// @throws InvalidArgument for no inputs, invalid options, or a model whose outputs are not finite or of another size.
SobolResult sobol_indices(const BatchModel& model, const std::vector<UncertainInput>& inputs,
                          const SobolOptions& options = {});

}  // namespace kr5::uncertainty
