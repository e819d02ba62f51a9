// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>

/// @file
/// Uncertain inputs of a model, and its outputs when one of them changes alone.

namespace kr5::uncertainty {

/// One row a sample.
using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Outputs (samples x outputs) of inputs (samples x inputs).
using BatchModel = std::function<Rows(const Rows&)>;

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
  bool averaged = false;

  /// Value that the input stays below with probability u, 0 < u < 1.
  double quantile(double u) const;
  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the input.");
    visit("law", self.law, "Distribution: normal | uniform.");
    visit("mean", self.mean, "Mean of a normal input, in its unit.");
    visit("sigma", self.sigma, "Standard deviation of a normal input before it is cut off, in its unit.");
    visit("low", self.low, "Lower end of a uniform input, in its unit.");
    visit("high", self.high, "Upper end of a uniform input, in its unit.");
    visit("truncation", self.truncation,
          "Standard deviations at which a normal input is cut off; infinite: it is not [-].");
    visit("averaged", self.averaged,
          "Whether the indices of the others are averages over it, and it has none of its own.");
  }
};

/// Outputs when one input alone is changed.
struct OneAtATime {
  std::vector<std::string> inputs;
  Eigen::VectorXd centre;
  Eigen::MatrixXd minus, plus, lowest, highest;

  static void each_field(auto& self, auto&& visit) {
    visit("inputs", self.inputs, "Names of the inputs.");
    visit("centre", self.centre, "Outputs with every input at its median.");
    visit("minus", self.minus, "Change of the outputs with an input one standard deviation lower, inputs x outputs.");
    visit("plus", self.plus, "The same one standard deviation higher.");
    visit("lowest", self.lowest, "Minimum change of the outputs over the range of an input, inputs x outputs.");
    visit("highest", self.highest, "Maximum change over that range.");
  }
};

/// Changes every input by itself: at its median less and plus one standard deviation, and at `steps` places over its
/// range (of a normal input that is not cut off, over three standard deviations), the others at their medians.
/// @throws InvalidArgument for no inputs or a model whose outputs are not finite or of another size.
OneAtATime one_at_a_time(const BatchModel& model, const std::vector<UncertainInput>& inputs, int steps = 13);

}  // namespace kr5::uncertainty
