// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/uncertainty/uncertain_input.hpp>

#include <cmath>

#include <boost/math/special_functions/erf.hpp>

#include <kr5/core/error.hpp>

namespace kr5::uncertainty {
namespace {

constexpr double root_two = 1.4142135623730951;
using InDouble = boost::math::policies::policy<boost::math::policies::promote_double<false>>;

double spread_of(const UncertainInput& input) {
  return input.law == InputLaw::Uniform ? (input.high - input.low) / std::sqrt(12.0) : input.sigma;
}

}  // namespace

double UncertainInput::quantile(double u) const {
  if (law == InputLaw::Uniform) return low + u * (high - low);
  const double tail = std::erfc(truncation / root_two) / 2;  // below the cut
  const double p = tail + u * (1 - 2 * tail);
  return mean - sigma * root_two * boost::math::erfc_inv(2 * p, InDouble());
}

void UncertainInput::validate() const {
  std::string where = "input ";
  where += name.empty() ? "without a name" : name;
  where += ": ";
  if (law == InputLaw::Uniform) {
    require(std::isfinite(low) && std::isfinite(high) && low < high, where + "low must lie below high");
    return;
  }
  require(std::isfinite(mean), where + "mean must be finite");
  require(sigma > 0 && std::isfinite(sigma), where + "sigma must be positive");
  require(truncation > 0, where + "truncation must be positive [-]");
}

OneAtATime one_at_a_time(const BatchModel& model, const std::vector<UncertainInput>& inputs, int steps) {
  require(!inputs.empty(), "one_at_a_time: there are no inputs");
  require(steps >= 2, "steps must be at least 2");
  const auto d = static_cast<Eigen::Index>(inputs.size());
  Eigen::RowVectorXd centre(d);
  for (Eigen::Index k = 0; k < d; ++k) {
    inputs[static_cast<std::size_t>(k)].validate();
    centre[k] = inputs[static_cast<std::size_t>(k)].quantile(0.5);
  }
  const Eigen::Index each = 2 + steps;
  Rows x = centre.replicate(1 + d * each, 1);
  for (Eigen::Index k = 0; k < d; ++k) {
    const UncertainInput& input = inputs[static_cast<std::size_t>(k)];
    const double sigma = spread_of(input);
    const bool uniform = input.law == InputLaw::Uniform;
    const double half =
        uniform ? (input.high - input.low) / 2 : sigma * (std::isfinite(input.truncation) ? input.truncation : 3.0);
    const Eigen::Index first = 1 + k * each;
    x(first, k) -= sigma;
    x(first + 1, k) += sigma;
    for (int i = 0; i < steps; ++i) x(first + 2 + i, k) += half * (2.0 * i / (steps - 1) - 1);
  }
  Rows y = model(x);
  require(y.rows() == x.rows() && y.cols() > 0, "the model gave " + std::to_string(y.rows()) + " rows of outputs for " +
                                                    std::to_string(x.rows()) + " rows of inputs");
  require(y.allFinite(), "the model gave an output that is not finite");
  OneAtATime out;
  out.centre = y.row(0).transpose();
  y.rowwise() -= Eigen::RowVectorXd(y.row(0));
  for (Eigen::MatrixXd* m : {&out.minus, &out.plus, &out.lowest, &out.highest}) m->resize(d, y.cols());
  for (Eigen::Index k = 0; k < d; ++k) {
    out.inputs.push_back(inputs[static_cast<std::size_t>(k)].name);
    const auto block = y.middleRows(1 + k * each, each);
    out.minus.row(k) = block.row(0);
    out.plus.row(k) = block.row(1);
    out.lowest.row(k) = block.bottomRows(steps).colwise().minCoeff();
    out.highest.row(k) = block.bottomRows(steps).colwise().maxCoeff();
  }
  return out;
}

}  // namespace kr5::uncertainty
