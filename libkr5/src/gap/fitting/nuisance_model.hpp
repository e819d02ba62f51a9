// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include "gap/screening/signature.hpp"

/// @file
/// Small errors of many nominal parameters, which every real model has and which are no cause: signatures of masses,
/// torque constants and friction with a Gaussian prior. Hypotheses compete for what the nuisance parameters cannot
/// take.

namespace kr5::gap {

/// Signatures of a relative change of 1 of each nuisance parameter (of 2 for friction, which is known half as well).
struct NuisanceModel {
  std::vector<Signature> signatures;
  Eigen::MatrixXd gram;  ///< On fit experiments.

  bool empty() const { return signatures.empty(); }
};

/// Masses of links and tool, torque constants, dry and viscous friction.
NuisanceModel make_nuisance_model(const ComparisonData& data, const Eigen::VectorXd& base, int threads);

/// NuisanceModel of one size, marginalised: with W = I - N (N'N + 1/size^2)^-1 N', chi2 = r'Wr and evidence -1/2 log|I
/// + size^2 N'N|. Size 0: none.
class NuisancePrior {
 public:
  NuisancePrior() = default;
  NuisancePrior(const NuisanceModel& nuisance, double size);

  double size() const { return size_; }
  double log_det() const { return log_det_; }
  /// a' (N'N + 1/size^2)^-1 b for a = N' u, b = N' v.
  Eigen::MatrixXd inner(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) const;
  /// Most likely relative change of each parameter, from N' r.
  Eigen::VectorXd estimate(const Eigen::VectorXd& b) const;

 private:
  double size_ = 0.0;
  double log_det_ = 0.0;
  Eigen::MatrixXd inverse_;
};

/// N' u for each signature, and N' r; fit blocks only.
Eigen::MatrixXd project(const NuisanceModel& nuisance, const std::vector<Signature>& columns);
Eigen::VectorXd project(const ComparisonData& data, const NuisanceModel& nuisance, const Eigen::VectorXd& counted);

/// Takes the most likely nuisance parameters out of residuals: counted - N eta.
Eigen::VectorXd without_nuisance(const ComparisonData& data, const NuisanceModel& nuisance, const NuisancePrior& prior,
                                 const Eigen::VectorXd& counted);

/// Sum of squares of that nuisance, each change over its standard deviation.
double nuisance_cost(const ComparisonData& data, const NuisanceModel& nuisance, const NuisancePrior& prior,
                     const Eigen::VectorXd& counted);

}  // namespace kr5::gap
