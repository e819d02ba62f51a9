// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>

/// @file
/// Global sensitivity by Sobol's indices: which uncertain input makes how much of the variance of an output (Hayat et
/// al. 2022, section 3.2.2).

namespace kr5::uncertainty {

enum class InputLaw {
  Normal,   ///< Of mean and standard deviation, cut off at `truncation` standard deviations.
  Uniform,  ///< Between two ends.
};
constexpr auto enum_names(InputLaw) {
  return names<InputLaw>({{InputLaw::Normal, "normal"}, {InputLaw::Uniform, "uniform"}});
}

/// An uncertain input of a model.
struct UncertainInput {
  std::string name;
  InputLaw law = InputLaw::Normal;
  double mean = 0.0;
  double sigma = 1.0;
  double low = 0.0;
  double high = 1.0;
  double truncation = 3.0;  ///< [-]

  /// Value that the input stays below with probability u, 0 < u < 1.
  double quantile(double u) const;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the input.");
    visit("law", self.law, "Distribution: normal | uniform.");
    visit("mean", self.mean, "Mean of a normal input, in its unit.");
    visit("sigma", self.sigma, "Standard deviation of a normal input before it is cut off, in its unit.");
    visit("low", self.low, "Lower end of a uniform input, in its unit.");
    visit("high", self.high, "Upper end of a uniform input, in its unit.");
    visit("truncation", self.truncation, "Standard deviations at which a normal input is cut off [-].");
  }
};

struct SobolOptions {
  int samples = 4096;
  int max_samples = 0;
  double tolerance = 0.0;  ///< [-]
  int resamples = 200;
  double confidence = 0.95;  ///< [-]
  std::uint64_t seed = 1;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit(
        "samples", self.samples,
        "Rows of each of the two sample matrices, a power of two; the model is evaluated (inputs + 2) times as often.");
    visit("max_samples", self.max_samples,
          "Rows up to which they are doubled until every interval is narrower than `tolerance`; 0: they are not.");
    visit("tolerance", self.tolerance, "Half the width of an interval that suffices [-].");
    visit("resamples", self.resamples, "Bootstrap samples behind the intervals.");
    visit("confidence", self.confidence, "Confidence of the intervals [-].");
    visit("seed", self.seed, "Random seed.");
  }
};

/// Indices of every input (row) for every output (column) [-].
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

/// Outputs (samples x outputs) of inputs (samples x inputs).
using BatchModel = std::function<Eigen::MatrixXd(const Eigen::MatrixXd&)>;

/// Estimates first-order indices (Saltelli et al. 2010) and total indices (Jansen 1999) on a Sobol sequence with a
/// random shift, with bootstrap intervals over its rows. An output without variance has indices 0.
/// @throws InvalidArgument for no inputs, invalid options, or a model whose outputs are not finite or of another size.
SobolResult sobol_indices(const BatchModel& model, const std::vector<UncertainInput>& inputs,
                          const SobolOptions& options = {});

}  // namespace kr5::uncertainty
