// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include <kr5/identification/joint_log.hpp>
#include <kr5/identification/joint_motion.hpp>

/// @file
/// From the log of a controller to a motion that an estimator may read (Hayat et al. 2022, section 4.4.3.2): the clock
/// repaired, positions and torques smoothed without delay, speeds and accelerations by central differences, fewer
/// rows. What is wrong with the log is named; from a faulty log nothing comes out.

namespace kr5::identification {

/// Where speeds come from.
enum class SpeedSource {
  Positions,  ///< Central differences of the smoothed positions.
  Logged,     ///< The smoothed log of speeds; accelerations are its central differences.
};
constexpr auto enum_names(SpeedSource) {
  return names<SpeedSource>({{SpeedSource::Positions, "positions"}, {SpeedSource::Logged, "logged"}});
}

/// What the time stamps of uneven steps mean.
enum class ClockModel {
  Automatic,  ///< The one of both under which the positions are smoother.
  Stamps,     ///< Samples were taken when the stamps say.
  Even,       ///< Samples were taken at even steps; the stamps came late.
};
constexpr auto enum_names(ClockModel) {
  return names<ClockModel>(
      {{ClockModel::Automatic, "automatic"}, {ClockModel::Stamps, "stamps"}, {ClockModel::Even, "even"}});
}

struct ConditioningOptions {
  double cutoff = 0.0;  ///< [Hz]
  int filter_order = 4;
  int decimation = 0;
  double edge = 1.0;  ///< [-]
  SpeedSource speeds = SpeedSource::Positions;
  ClockModel clock = ClockModel::Automatic;
  double max_gap = 5.0;       ///< [-]
  double torque_delay = 0.0;  ///< [s]
  bool smooth_torques = true;
  bool leave_out_faulty = false;
  std::string accept;
  Eigen::VectorXd lower;            ///< [rad or m]
  Eigen::VectorXd upper;            ///< [rad or m]
  Eigen::VectorXd expected_torque;  ///< [N m or N]
  std::vector<int> slides;

  /// @throws InvalidArgument naming the field.
  void validate() const;
  /// Whether findings of this kind are accepted.
  bool accepts(LogFault fault) const;

  static void each_field(auto& self, auto&& visit) {
    visit("cutoff", self.cutoff,
          "Half-power frequency of the low-pass of positions and torques, run forward and backward; 0: five times the "
          "frequency below which 99 % of the power of the speeds lies [Hz].");
    visit("filter_order", self.filter_order, "Order of the Butterworth low-pass of one pass.");
    visit(
        "decimation", self.decimation,
        "Number of rows of the log of which one is kept; 0: as many as leave four samples per period of the cut-off.");
    visit("edge", self.edge, "Periods of the cut-off left out at both ends of each run [-].");
    visit("speeds", self.speeds,
          "Source of the speeds: positions (central differences of the smoothed positions) | logged.");
    visit("clock", self.clock,
          "Meaning of uneven time stamps: stamps (samples were taken then) | even (samples are even, stamps came late) "
          "| automatic (whichever makes the positions smoother).");
    visit("max_gap", self.max_gap,
          "Step of time, in median steps, above which a run ends when it is also above 10 ms [-].");
    visit("torque_delay", self.torque_delay, "Time by which torques were logged later than positions [s].");
    visit("smooth_torques", self.smooth_torques,
          "Torques low-passed as the positions are; without, dry friction is not blurred about its reversals, and the "
          "rows are not decimated unless asked for.");
    visit("leave_out_faulty", self.leave_out_faulty,
          "Spans of missing, saturated or frozen values, and of brakes, are left out instead of refused.");
    visit("accept", self.accept, "Kinds of findings, separated by commas, for which the log is not refused.");
    visit("lower", self.lower, "Lower joint limits; empty: a full turn, slides unlimited [rad or m].");
    visit("upper", self.upper, "Upper joint limits; empty: a full turn, slides unlimited [rad or m].");
    visit("expected_torque", self.expected_torque,
          "RMS torque of each joint by an assumed model, to distinguish currents from torques; empty: unknown [N m or "
          "N].");
    visit("slides", self.slides, "Prismatic joints, from 1.");
  }
};

/// A motion to estimate from, and what was found in its log.
struct ConditionedMotion {
  JointMotion motion;                ///< Empty unless usable().
  Eigen::MatrixXd tau_measured;      ///< Torques at the rows of `motion` as they were logged [N m or N].
  std::vector<LogFinding> findings;  ///< Errors first.
  double step = 0.0;                 ///< Of the log [s].
  double cutoff = 0.0;               ///< [Hz]
  int decimation = 1;
  bool even_clock = false;
  std::string message = "not run";

  bool usable() const { return motion.samples() > 0; }

  static void each_field(auto& self, auto&& visit) {
    visit("motion", self.motion, "Conditioned motion; empty when the log must not be used.");
    visit("tau_measured", self.tau_measured, "Logged torques at the rows of motion, not smoothed [N m or N].");
    visit("findings", self.findings, "What is wrong with the log, errors first.");
    visit("step", self.step, "Median step of the log [s].");
    visit("cutoff", self.cutoff, "Half-power frequency of the low-pass [Hz].");
    visit("decimation", self.decimation, "Rows of the log of which one was kept.");
    visit("even_clock", self.even_clock, "True when the time stamps were replaced by even ones.");
    visit("message", self.message, "Explanation.");
  }
};

/// Frequency below which 99 % of the power of the speeds lies, of the fastest joint: the bandwidth of a motion [Hz].
/// @param q Samples x joints at even steps; @param step [s].
double motion_bandwidth(const Eigen::Ref<const Eigen::MatrixXd>& q, double step);

/// Half-power frequency of the low-pass by which positions lose their noise and not the motion: five times its
/// bandwidth, or the frequency above which no joint moves by more than its noise, where that is lower, but at least 1.5
/// times the bandwidth and at most 0.4 of the rate [Hz].
/// @param q Samples x joints at even steps; @param step [s]; @param noise Standard deviation of the readings of each
/// joint [rad or m].
double motion_cutoff(const Eigen::Ref<const Eigen::MatrixXd>& q, double step, const Eigen::VectorXd& noise);

/// Standard deviation of the speeds that readings of unit noise give, low-passed (zero_phase_low_pass) and differenced
/// [1/s]. @param step Of the readings [s]; @param cutoff [Hz]; 0: not low-passed.
double speed_noise_gain(double step, double cutoff, int filter_order = 4);

/// The faults of a log, errors first; empty for a sound one.
/// @throws InvalidArgument for sizes that differ or invalid options.
std::vector<LogFinding> check_log(const JointLog& log, const ConditioningOptions& options = {});

/// The motion of a log, conditioned. When check_log finds an error that is neither accepted nor left out, the motion is
/// empty and the message names the first.
/// @throws InvalidArgument for sizes that differ or invalid options.
ConditionedMotion condition_log(const JointLog& log, const ConditioningOptions& options = {});

/// Options by which further logs are conditioned as these were: the medians of their cutoffs and decimations, where the
/// options leave both to the log. The same options when a log was not usable, or there is none.
ConditioningOptions conditioning_like(std::span<const ConditionedMotion> motions, const ConditioningOptions& options);

}  // namespace kr5::identification
