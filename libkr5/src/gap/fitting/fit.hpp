// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <vector>

#include <Eigen/Core>

#include "gap/fitting/nuisance_model.hpp"
#include "gap/screening/signature.hpp"

/// @file
/// A set of effects, fitted together through the simulator, and how well it explains the recording.

namespace kr5::gap {

/// A hypothesis, what it touches, and its signatures on fit experiments about the nominal cell, one list a probe.
struct Candidate {
  Hypothesis hypothesis;
  std::vector<int> experiments;
  std::vector<std::vector<Signature>> signatures;
};

/// One effect at a value.
struct Part {
  const Candidate* candidate = nullptr;
  Eigen::VectorXd x;
};

/// A fitted set of effects; without any: the nominal cell.
struct Model {
  std::vector<Part> parts;
  Eigen::VectorXd residual;         ///< Stacked, at the optimum; NaN where not compared.
  std::vector<Signature> jacobian;  ///< Of all coordinates, on fit experiments.
  std::vector<Signature> check_jacobian;
  Eigen::MatrixXd information;        ///< Of all coordinates, nuisance parameters marginalised.
  Eigen::MatrixXd check_information;  ///< What the check experiments would add.
  Eigen::VectorXd update;             ///< By which they would move the coordinates.
  double chi2_fit = 0.0;              ///< NuisanceModel marginalised.
  double chi2_check = 0.0;    ///< Of the prediction with its uncertainty; most likely nuisance parameters taken out.
  double log_evidence = 0.0;  ///< Of the fit experiments, times the prediction of the check experiments.

  int coordinates() const {
    int n = 0;
    for (const Part& part : parts) n += part.candidate->hypothesis.size();
    return n;
  }
  bool has(const EffectName& name) const {
    return std::ranges::any_of(parts, [&](const Part& part) { return part.candidate->hypothesis.name() == name; });
  }
  /// Index of the first coordinate of a part among all.
  Eigen::Index first_coordinate(std::size_t part) const {
    Eigen::Index first = 0;
    for (std::size_t k = 0; k < part; ++k) first += parts[k].x.size();
    return first;
  }
};

/// stacked += factor times the slope of a coordinate of a model, on fit and check experiments.
void add_slope(const ComparisonData& data, double factor, const Model& model, Eigen::Index coordinate,
               Eigen::VectorXd& stacked);

/// When slopes are simulated.
enum class Slopes {
  AtEachPoint,
  WhereNeeded,  ///< Where steps lead no further, and at the end; between, they follow what the steps changed (Broyden).
};

/// What fitting needs besides the effects.
struct FitProblem {
  const ComparisonData& data;
  const NuisanceModel& nuisance;
  NuisancePrior prior;
  double log_prior_effect = 0.0;  ///< Of one more effect among all of them.
  Slopes slopes = Slopes::AtEachPoint;
  /// Standard deviation of a Gaussian prior of each coordinate about where its effect is off, in usual sizes, which
  /// keeps near what no datum tells; 0: none.
  double width = 0.0;
  bool far = false;  ///< Whether the nominal cell is so far off that slopes there lead nowhere.
};

struct FitOptions {
  int max_iterations = 40;
  int threads = 1;  ///< Over which the slopes of one fit are spread.
  /// A step that gains less of chi-square ends the fit: a fiftieth of what one random number is worth.
  double least_gain = 0.02;
  /// A model near the one that is fitted. Where slopes are simulated where needed, those that it has are not: a few
  /// steps follow them, so that a fit that is not near is one of its lower likelihoods.
  const Model* near = nullptr;
};

Setup setup_of(const ComparisonData& data, const std::vector<Part>& parts);

std::vector<Part> without(std::vector<Part> parts, std::size_t part);

/// Whether both are the same effects, whatever their values.
bool same_effects(const std::vector<Part>& a, const std::vector<Part>& b);

/// The nominal cell.
Model empty_model(const FitProblem& problem, const Eigen::VectorXd& base);

/// Fits all coordinates by bounded Levenberg-Marquardt on the fit experiments, from `parts`, simulating only what they
/// touch; `from.residual` holds at least the experiments none of them touches. A step to where the cell does not exist,
/// e.g. to a joint without inertia, is shortened.
Model fit(const FitProblem& problem, const Model& from, std::vector<Part> parts, const FitOptions& options = {});

/// What a model says of the check experiments, of which it has residual and slopes: the prediction with the uncertainty
/// of the fit, and with it the evidence.
void predict_check(const FitProblem& problem, Model& model);

/// What is counted of a model's residual when the check experiments may move its coordinates as far as the uncertainty
/// of the fit allows: what is left then is no error of the parameters. NuisanceModel taken out.
Eigen::VectorXd updated(const FitProblem& problem, const Model& model);

/// Log evidence (Laplace) of a model: misfit of the fit experiments, Occam factor of each coordinate under a Cauchy
/// prior of `prior_width` typical sizes, prior of its effects; times the prediction of the check experiments, which is
/// as wide as the uncertainty of the fitted coordinates makes it.
double log_evidence(const FitProblem& problem, const Model& model);

/// Width of the Cauchy prior of a coordinate, in usual sizes of its effect.
constexpr double prior_width = 3.0;

}  // namespace kr5::gap
