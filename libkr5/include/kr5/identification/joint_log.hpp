// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>

namespace kr5::identification {

/// What a controller logged of a motion, as it came: a row a sample, a column a joint.
struct JointLog {
  Eigen::VectorXd t;                                ///< [s]
  Eigen::MatrixXd q;                                ///< [rad or m]
  Eigen::MatrixXd qd;                               ///< Empty when no speeds were logged [rad/s or m/s].
  Eigen::MatrixXd tau;                              ///< On the joint side [N m or N].
  std::vector<std::string> q_names;                 ///< Empty: q1, q2, ...
  std::vector<std::string> qd_names;                ///< Empty: qd1, qd2, ...
  std::vector<std::string> tau_names;               ///< Empty: tau1, tau2, ...
  Eigen::MatrixXd temperature = {};                 ///< Of the joints; empty when none were logged [deg C].
  std::vector<std::string> temperature_names = {};  ///< Empty: temperature1, temperature2, ...

  int joints() const { return static_cast<int>(q.cols()); }
  /// Name of a column, for messages; `joint` from 0.
  std::string q_name(Eigen::Index joint) const;
  std::string qd_name(Eigen::Index joint) const;
  std::string tau_name(Eigen::Index joint) const;
  std::string temperature_name(Eigen::Index joint) const;

  /// The log with these rows only, in this order.
  JointLog with_rows(const std::vector<Eigen::Index>& rows) const;

  /// Sizes only; faults of the numbers are for check_log to tell.
  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("t", self.t, "Times of the samples [s].");
    visit("q", self.q, "Joint values, samples x joints [rad or m].");
    visit("qd", self.qd, "Logged joint speeds, samples x joints; empty: none were logged [rad/s or m/s].");
    visit("tau", self.tau, "Torques of the drives on the joint side, samples x joints [N m or N].");
    visit("q_names", self.q_names, "Names of the columns of q in the log; empty: q1, q2, ...");
    visit("qd_names", self.qd_names, "Names of the columns of qd in the log; empty: qd1, qd2, ...");
    visit("tau_names", self.tau_names, "Names of the columns of tau in the log; empty: tau1, tau2, ...");
    visit("temperature", self.temperature,
          "Logged temperatures of the joints, samples x joints; empty: none were logged [deg C].");
    visit("temperature_names", self.temperature_names,
          "Names of the columns of temperature in the log; empty: temperature1, temperature2, ...");
  }
};

/// The log before its last part, and that part: the share `last` [-] of its span of time. Rows without a time stay in
/// the first.
/// @throws InvalidArgument for sizes that differ, or a share that is not 0 to 1.
std::pair<JointLog, JointLog> split_log(const JointLog& log, double last);

/// What may be wrong with a log.
enum class LogFault {
  NotFinite,         ///< Empty, NaN or infinite numbers.
  ClockBackward,     ///< Time that goes back.
  ClockDuplicate,    ///< Equal times.
  ClockGap,          ///< Missing samples.
  ClockJitter,       ///< Uneven steps.
  PositionRange,     ///< Positions beyond the limits.
  Degrees,           ///< Degrees for radians.
  NeverMoved,        ///< A joint that stands throughout.
  SpeedScale,        ///< Speed that is a multiple of the derivative of the position.
  SpeedSign,         ///< Speed of the opposite sign.
  SpeedDelay,        ///< Speed logged late.
  SpeedUnrelated,    ///< Speed that is not the derivative of the position.
  Saturated,         ///< Values that are flat at their extreme.
  Frozen,            ///< Values that stop changing although the arm moves.
  Brake,             ///< Torques at rest that cannot hold the arm: brakes do.
  ReversedTorque,    ///< Torque whose friction and inertia push the wrong way.
  TorqueDelay,       ///< Positions and torques by two clocks.
  CurrentForTorque,  ///< Numbers of a size that suggests currents or motor-side torques.
  TemperatureRange,  ///< Temperatures that no drive has: another unit, or a channel without a sensor.
};

constexpr auto enum_names(LogFault) {
  return names<LogFault>({{LogFault::NotFinite, "not_finite"},
                          {LogFault::ClockBackward, "clock_backward"},
                          {LogFault::ClockDuplicate, "clock_duplicate"},
                          {LogFault::ClockGap, "clock_gap"},
                          {LogFault::ClockJitter, "clock_jitter"},
                          {LogFault::PositionRange, "position_range"},
                          {LogFault::Degrees, "degrees"},
                          {LogFault::NeverMoved, "never_moved"},
                          {LogFault::SpeedScale, "speed_scale"},
                          {LogFault::SpeedSign, "speed_sign"},
                          {LogFault::SpeedDelay, "speed_delay"},
                          {LogFault::SpeedUnrelated, "speed_unrelated"},
                          {LogFault::Saturated, "saturated"},
                          {LogFault::Frozen, "frozen"},
                          {LogFault::Brake, "brake"},
                          {LogFault::ReversedTorque, "reversed_torque"},
                          {LogFault::TorqueDelay, "torque_delay"},
                          {LogFault::CurrentForTorque, "current_for_torque"},
                          {LogFault::TemperatureRange, "temperature_range"}});
}

/// What a finding means for an estimate.
enum class LogSeverity {
  Note,     ///< Repaired, or without consequence.
  Warning,  ///< The estimate may suffer.
  Error,    ///< Nothing is to be estimated from it.
};

constexpr auto enum_names(LogSeverity) {
  return names<LogSeverity>(
      {{LogSeverity::Note, "note"}, {LogSeverity::Warning, "warning"}, {LogSeverity::Error, "error"}});
}

/// One thing that is wrong with a log.
struct LogFinding {
  LogFault fault = LogFault::NotFinite;
  LogSeverity severity = LogSeverity::Error;
  std::string column;  ///< As in the log.
  int joint = 0;       ///< From 1; 0: no single one.
  double begin = 0.0;  ///< [s]
  double end = 0.0;    ///< [s]
  double value = 0.0;  ///< What was measured of the fault: a factor [-], a delay [s], a level.
  std::string text;

  static void each_field(auto& self, auto&& visit) {
    visit("fault", self.fault, "Kind of fault.");
    visit("severity", self.severity, "Consequence: error (nothing is estimated), warning or note.");
    visit("column", self.column, "Column of the log.");
    visit("joint", self.joint, "Joint, from 1; 0: no single one.");
    visit("begin", self.begin, "Beginning of the time span [s].");
    visit("end", self.end, "End of the time span [s].");
    visit("value", self.value, "Measure of the fault: factor [-], delay [s], level or count.");
    visit("text", self.text, "What was found, what was expected and the remedy.");
  }
};

}  // namespace kr5::identification
