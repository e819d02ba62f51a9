// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/cell/drives.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/core/fit_report.hpp>

/// @file
/// The servo H(s) = k wn^2 / (s^2 + 2 zeta wn s + wn^2) with a delay, of a path correction or of a joint, from a log of
/// commands and responses (Hayat et al. 2022, section 5.3.1).

namespace kr5::identification {

/// Commands to one axis and where it was.
struct ServoLog {
  Eigen::VectorXd t;            ///< In ascending order within a run [s].
  Eigen::VectorXd command;      ///< [m or rad]
  Eigen::VectorXd response;     ///< [m or rad]
  std::vector<int> run_starts;  ///< First sample of each run, 0 first; empty: one run.

  /// @throws InvalidArgument naming field and row: sizes that differ, numbers that are not finite, times that do not
  ///         rise within a run.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("t", self.t, "Times, in ascending order within a run [s].");
    visit("command", self.command, "Command of each sample [m or rad].");
    visit("response", self.response, "Measured position at each sample [m or rad].");
    visit("run_starts", self.run_starts,
          "First sample of each run, 0 first; empty: one run. The axis rests when a run begins.");
  }
};

/// The command between two samples.
enum class CommandShape {
  Held,    ///< That of the sample before, as a controller holds it over a cycle.
  Smooth,  ///< A cubic spline through the samples, as of a planned motion.
};
constexpr auto enum_names(CommandShape) {
  return names<CommandShape>({{CommandShape::Held, "held"}, {CommandShape::Smooth, "smooth"}});
}

struct ServoOptions {
  CommandShape command = CommandShape::Held;
  bool fit_gain = true;
  bool fit_offset = true;
  double max_delay = 0.5;
  double accepted_std = 0.3;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("command", self.command, "Command between two samples: held (as over a cycle) | smooth (cubic spline).");
    visit("fit_gain", self.fit_gain, "Estimate the gain k; otherwise it is 1.");
    visit("fit_offset", self.fit_offset, "Estimate a constant offset of the response; otherwise it is 0.");
    visit("max_delay", self.max_delay, "Maximum delay that is searched [s].");
    visit("accepted_std", self.accepted_std,
          "Relative standard deviation of the natural frequency above which a response is refused [-].");
  }
};

/// Damping and frequency from the overshoot of a step and the period of the damped oscillation (eq. 5.11 and 5.12).
/// @param step and @param overshoot in one unit, both positive. @param period of the damped oscillation [s].
/// @throws InvalidArgument unless 0 < overshoot < step and the period is positive.
cell::SecondOrder servo_from_overshoot(double step, double overshoot, double period);

/// The formula of the book on a measured step, beside the fit of the whole response.
struct OvershootReading {
  double step = 0.0;               ///< [m or rad]
  double overshoot = 0.0;          ///< Greatest response beyond the end value [m or rad].
  double period = 0.0;             ///< Twice the time from the delayed command to the peak [s].
  double second_overshoot = 0.0;   ///< What the fitted servo would show one period later [m or rad].
  double damping_ratio = 0.0;      ///< By eq. 5.11 [-].
  double natural_frequency = 0.0;  ///< By eq. 5.12 [rad/s].

  static void each_field(auto& self, auto&& visit) {
    visit("step", self.step, "Size of the step [m or rad].");
    visit("overshoot", self.overshoot, "Maximum response beyond the end value [m or rad].");
    visit("period", self.period, "Twice the time from the delayed command to the peak [s].");
    visit("second_overshoot", self.second_overshoot,
          "Overshoot that the fitted servo would show one period later [m or rad].");
    visit("damping_ratio", self.damping_ratio, "Damping ratio by eq. 5.11 [-].");
    visit("natural_frequency", self.natural_frequency, "Natural frequency by eq. 5.12 [rad/s].");
  }
};

struct ServoResult {
  cell::SecondOrder servo;
  double gain = 1.0;
  double offset = 0.0;
  Eigen::MatrixXd covariance;
  double noise = 0.0;
  double correlation = 1.0;
  double cycle = 0.0;
  double max_speed = 0.0;
  std::optional<OvershootReading> overshoot;
  Eigen::VectorXd predicted;
  std::vector<std::string> overshoot_limits;
  std::vector<std::string> warnings;
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("servo", self.servo, "Natural frequency, damping ratio and delay.");
    visit("gain", self.gain, "Gain k: response at rest over command [-].");
    visit("offset", self.offset, "Response at rest to a command of 0 [m or rad].");
    visit("covariance", self.covariance,
          "Covariance of natural frequency [rad/s], damping ratio [-], delay [s], gain [-], offset [m or rad], with "
          "the correlation of the residuals; zero for what was not estimated.");
    visit("noise", self.noise, "Standard deviation of the residuals [m or rad].");
    visit("correlation", self.correlation,
          "Variance of a mean of residuals over that of residuals without correlation [-].");
    visit("cycle", self.cycle, "Time between two samples, median [s].");
    visit("max_speed", self.max_speed, "Maximum speed of the fitted response [m/s or rad/s].");
    visit("overshoot", self.overshoot, "Formula of the overshoot on the largest step; absent where none is seen.");
    visit("predicted", self.predicted, "Fitted response at each sample [m or rad].");
    visit("overshoot_limits", self.overshoot_limits,
          "What the formula of the overshoot cannot tell of this response; of no concern to the fit.");
    visit("warnings", self.warnings,
          "Quantities that the response does not determine, and evidence against the model.");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Least squares over the whole response, by the law that also simulates (`physics/second_order.hpp`): natural
/// frequency, damping ratio, a delay that need not be whole cycles, gain and offset, with their covariance.
/// `fit.usable()` is false when the command does not change, the response does not follow it, comes before it, or is
/// limited in speed; the message says which. @throws InvalidArgument for an invalid log or options.
ServoResult identify_servo(const ServoLog& log, const ServoOptions& options = {});

}  // namespace kr5::identification
