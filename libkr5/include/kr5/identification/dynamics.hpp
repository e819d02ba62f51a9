// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <kr5/core/fit_report.hpp>
#include <kr5/identification/base_parameters.hpp>
#include <kr5/kinematics/body.hpp>

/// @file
/// Identification of an arm's dynamics from motions with torques (Hayat et al. 2022, section 4.3; Gautier 1997; Janot,
/// Vandanjon, Gautier 2014; Lee, Wensing, Park 2020).

namespace kr5::identification {

enum class Estimator {
  Ordinary,     ///< Least squares of all torques alike.
  Weighted,     ///< Each joint by the variance of its residuals, estimated in turns.
  Robust,       ///< The same with Huber's loss.
  Instruments,  ///< Instrumental variables, for regressors with noise.
  Consistent,   ///< Weighted, over bodies that can exist, with the log-det divergence as prior: a convex problem.
};
constexpr auto enum_names(Estimator) {
  return names<Estimator>({{Estimator::Ordinary, "ordinary"},
                           {Estimator::Weighted, "weighted"},
                           {Estimator::Robust, "robust"},
                           {Estimator::Instruments, "instruments"},
                           {Estimator::Consistent, "consistent"}});
}

struct DynamicsOptions {
  Estimator estimator = Estimator::Weighted;
  double held_out = 1.0 / 3.0;    ///< Last part of the samples, on which the estimate is judged only [-].
  bool choose_terms = false;      ///< Offers further friction terms; those that surely predict better stay.
  bool choose_estimate = false;   ///< Estimator, prior_spread and min_speed as thirds left out are predicted best.
  int blocks = 10;                ///< Of time, for the cross-validation of `choose_terms`.
  double huber = 1.345;           ///< Limit of the Huber loss [standard deviations].
  double min_speed = 0.0;         ///< Part of the RMS speed below which a joint's rows are left out [-].
  int max_iterations = 20;        ///< Of weights.
  int max_body_iterations = 300;  ///< Steps of Consistent.
  std::vector<kinematics::Body> prior_bodies;  ///< For Consistent, one a link in its frame; empty: balls of 2 kg.
  double prior_spread = 0.5;  ///< Of the logarithm of their masses and radii; 2.0 at least without bodies [-].

  /// @throws InvalidArgument naming the field.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("estimator", self.estimator, "Estimator: ordinary | weighted | robust | instruments | consistent.");
    visit("held_out", self.held_out, "Last part of the samples, held out for validation [-].");
    visit("choose_terms", self.choose_terms, "Friction terms chosen by cross-validation over blocks of time.");
    visit("choose_estimate", self.choose_estimate,
          "Estimator (weighted, and consistent where prior_bodies are given), prior_spread and min_speed chosen by "
          "predicting each third of the samples from the other two.");
    visit("blocks", self.blocks, "Number of blocks of the cross-validation.");
    visit("huber", self.huber, "Limit of the Huber loss [standard deviations].");
    visit("min_speed", self.min_speed,
          "Fraction of the RMS speed of a joint below which its torques are left out of the fit; 0: none. Near rest "
          "and reversals the direction of dry friction is unknown; 0.02 suits an arm that pauses [-].");
    visit("max_iterations", self.max_iterations, "Maximum number of iterations of the weights.");
    visit("max_body_iterations", self.max_body_iterations, "Maximum number of steps of the consistent estimator.");
    visit("prior_bodies", self.prior_bodies, "Expected bodies of the links, for consistent; empty: balls of 2 kg.");
    visit("prior_spread", self.prior_spread, "Spread of the logarithm of prior masses and radii [-].");
  }
};

/// Torques of one part of the samples as the estimate predicts them.
struct TorqueError {
  Eigen::VectorXd rms;       ///< Of each joint [N m or N].
  Eigen::VectorXd relative;  ///< The same over the RMS of the measured torque [-].
  double total = 0.0;        ///< Norm of all errors over the norm of all torques [-].

  static void each_field(auto& self, auto&& visit) {
    visit("rms", self.rms, "RMS error of each joint [N m or N].");
    visit("relative", self.relative, "The same over the RMS of the measured torque [-].");
    visit("total", self.total, "Norm of all errors over the norm of all torques [-].");
  }
};

/// Errors of torques, samples x joints [N m or N]; zeros without samples. Of a joint whose measured torques are all 0,
/// `relative` is the norm of its errors.
/// @throws InvalidArgument for sizes that differ.
TorqueError torque_error(const Eigen::MatrixXd& measured, const Eigen::MatrixXd& predicted);

struct DynamicsResult {
  FitReport fit;
  Estimator estimator = Estimator::Weighted;  ///< As chosen, or given.
  double prior_spread = 0.0;                  ///< As chosen, or given; counts for Consistent [-].
  double min_speed = 0.0;                     ///< As chosen, or given [-].
  DynamicsModel model;                        ///< With the terms that were chosen.
  BaseParameters base;
  Observability observability;  ///< Of the samples that were fitted.
  Eigen::VectorXd values;       ///< Base parameters [SI].
  Eigen::VectorXd deviations;   ///< Their standard deviations, for residuals as correlated as found.
  Eigen::MatrixXd covariance;
  Eigen::VectorXd parameters;            ///< Standard parameters that predict; bodies, when they are consistent.
  std::vector<kinematics::Body> bodies;  ///< In the frames of the links; of Consistent only.
  Eigen::MatrixXd predicted;             ///< Torques of all samples [N m or N].
  Eigen::VectorXd sigma;                 ///< Standard deviation of the residuals of each joint [N m or N].
  Eigen::VectorXd correlation;           ///< Samples that count as one, of each joint [-].
  TorqueError fitted, held_out;
  int first_held_out = 0;  ///< Sample at which the held-out part begins.

  /// Value and standard deviation of a parameter that is a base parameter of its own, such as "fc2".
  std::optional<std::pair<double, double>> parameter(const std::string& name) const;

  static void each_field(auto& self, auto&& visit) {
    visit("fit", self.fit, "Report of the estimation.");
    visit("estimator", self.estimator, "Estimator, as chosen or given.");
    visit("prior_spread", self.prior_spread, "Spread of the priors, as chosen or given; counts for consistent [-].");
    visit("min_speed", self.min_speed, "Part of the RMS speed below which rows are left out, as chosen or given [-].");
    visit("model", self.model, "Model with the terms that were chosen.");
    visit("base", self.base, "Base parameters.");
    visit("observability", self.observability, "Information in the fitted samples.");
    visit("values", self.values, "Base parameters [SI].");
    visit("deviations", self.deviations, "Standard deviations of the base parameters [SI].");
    visit("covariance", self.covariance, covariance_doc("base", "Covariance of the base parameters [SI]."));
    visit("parameters", self.parameters, "Standard parameters that predict the torques [SI].");
    visit("bodies", self.bodies, "Body of each link in its frame; of the consistent estimator only.");
    visit("predicted", self.predicted, "Predicted torques of all samples [N m or N].");
    visit("sigma", self.sigma, "Standard deviation of the residuals of each joint [N m or N].");
    visit("correlation", self.correlation, "Number of samples that count as one, of each joint [-].");
    visit("fitted", self.fitted, "Errors of the samples that were fitted.");
    visit("held_out", self.held_out, "Errors of the samples that were held out.");
    visit("first_held_out", self.first_held_out, "Sample at which the held-out part begins.");
  }
};

/// The dynamics of an arm from its motion and torques.
///
/// The noise of each joint's torques may last from sample to sample, but joints are taken as independent of each other:
/// noise of the accelerations, which reaches the torques of several joints at once, makes the covariance too small (of
/// 95 % regions with 2 rad/s^2 and instruments 89 % held the truth).
/// @param instruments For Estimator::Instruments: the same motion, sample by sample, with other noise or none (q, qd,
///        qdd): commanded, simulated, or recorded again; its torques are not read.
/// @throws InvalidArgument naming field and remedy; data that do not tell the parameters are a status.
DynamicsResult identify_dynamics(const JointMotion& motion, const DynamicsModel& model,
                                 const DynamicsOptions& options = {}, const JointMotion* instruments = nullptr);

/// Torques of a motion by an estimate, samples x joints [N m or N].
Eigen::MatrixXd predict_torques(const DynamicsResult& result, const JointMotion& motion);

}  // namespace kr5::identification
