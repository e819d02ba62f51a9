// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/predict/wrench.hpp>

#include <cmath>

namespace kr5::predict {

using Eigen::Index;

namespace {

void lag(double time_constant, const Eigen::VectorXd& t, const Run& run, Eigen::Ref<Eigen::MatrixXd> wrench) {
  for (Index i = run.first + 1; i < run.last; ++i) {
    const double part = 1.0 - std::exp(-(t[i] - t[i - 1]) / time_constant);
    wrench.row(i) = wrench.row(i - 1) + part * (wrench.row(i) - wrench.row(i - 1));
  }
}

}  // namespace

void sense(const cell::Effects& effects, const Eigen::VectorXd& t, const std::vector<Run>& runs,
           Eigen::Ref<Eigen::MatrixXd> wrench) {
  Eigen::Matrix<double, 6, 6> C = Eigen::Matrix<double, 6, 6>::Zero();
  for (Index c = 0; c < 6; ++c) {
    const cell::WrenchEffects& e = effects.wrench[static_cast<std::size_t>(c)];
    require(e.source >= 0 && e.source < 6,
            "effects.ft_crosstalk: source: found " + std::to_string(e.source) + ", expected 0 to 5");
    C(c, c) += e.gain;
    C(c, e.source) += e.crosstalk_gain;
  }
  if (!C.isIdentity(0.0)) wrench = (wrench * C.transpose()).eval();
  for (Index c = 0; c < 6; ++c) {
    const cell::WrenchEffects& e = effects.wrench[static_cast<std::size_t>(c)];
    wrench.col(c).array() += e.bias + e.rate * t.array();
  }
  if (effects.sensors.ft_lag > 0.0)
    for (const Run& run : runs) lag(effects.sensors.ft_lag, t, run, wrench);
}

}  // namespace kr5::predict
