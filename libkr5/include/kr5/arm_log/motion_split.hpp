// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

#include <kr5/arm_log/time_span.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/physics/row_range.hpp>

/// @file
/// Which parts of logged motions are to fit and which to check: whole runs where there are several, else a log cut at
/// rest, else one that is simulated from its beginning and judged by its last rows.

namespace kr5::arm_log {

/// Rows of the parts between gaps of the clock. @param t Rising [s]. @param max_gap Step above which a part ends; 0:
/// five median steps, 10 ms at least [s].
std::vector<physics::RowRange> parts_without_gap(const Eigen::VectorXd& t, double max_gap = 0.0);

/// Whether any joint goes further than its noise; q: rows x joints [rad or m].
bool joints_move(const Eigen::MatrixXd& q);
/// Spans in which all joints stand; q: rows x joints [rad or m].
std::vector<TimeSpan> rests(const Eigen::VectorXd& t, const Eigen::MatrixXd& q);
/// How fast each joint surely moves at the first row, noise of the readings taken off [rad/s or m/s]. 0 where it is
/// still far slower than its command: an arm that begins at rest. @param command May be empty.
Eigen::VectorXd sure_initial_speeds(const Eigen::VectorXd& t, const Eigen::MatrixXd& q,
                                    const Eigen::MatrixXd& command = {});

/// A logged motion, as far as its split depends on it.
struct LoggedMotion {
  Eigen::VectorXd t;           ///< Rising [s].
  Eigen::MatrixXd q;           ///< Measured, or commands where nothing was measured [rad or m].
  Eigen::MatrixXd command;     ///< Beside what was measured; may be empty [rad or m].
  bool commanded = false;      ///< Whether the commands are simulated, so that a motion must begin at rest.
  bool stepwise = false;       ///< Whether torque servos move the arm, which is simulated step by step.
  double settle = 0.0;         ///< After which a servo has forgotten how it began [s].
  double max_gap = 0.0;        ///< Step above which a part ends; 0: five median steps, 10 ms at least [s].
  bool kept_to_check = false;  ///< Whether it is one to judge by; all others are fitted then.

  static void each_field(auto& self, auto&& visit) {
    visit("t", self.t, "Times, in ascending order [s].");
    visit("q", self.q, "Measured joint values, or commands where nothing was measured, rows x joints [rad or m].");
    visit("command", self.command, "Commands beside what was measured; may be empty [rad or m].");
    visit("commanded", self.commanded, "Whether the commands are simulated, so that a motion must begin at rest.");
    visit("stepwise", self.stepwise, "Whether torque servos move the arm, which is simulated step by step.");
    visit("settle", self.settle, "Time after which a servo has forgotten how it began [s].");
    visit("max_gap", self.max_gap, "Step above which a part ends; 0: five median steps, 10 ms at least [s].");
    visit("kept_to_check", self.kept_to_check, "Whether it is one to judge by; all others are fitted then.");
  }
};

/// Why a log was cut where it was.
enum class CutReason {
  Uncut,     ///< Whole runs.
  AtRest,    ///< The arm rests there.
  Measured,  ///< Measured positions need no rest to begin from.
  LeadIn,    ///< The arm never rests: its last rows are judged, after a lead-in.
};
constexpr auto enum_names(CutReason) {
  return names<CutReason>({{CutReason::Uncut, "uncut"},
                           {CutReason::AtRest, "at_rest"},
                           {CutReason::Measured, "measured"},
                           {CutReason::LeadIn, "lead_in"}});
}

/// An experiment of a log.
struct MotionSpan {
  int log = 0;                                              ///< From 0.
  double begin = -std::numeric_limits<double>::infinity();  ///< [s]
  double end = std::numeric_limits<double>::infinity();     ///< [s]
  cell::Split split = cell::Split::Fit;
  double lead_in = 0.0;              ///< Simulated and not judged [s].
  CutReason cut = CutReason::Uncut;  ///< Of this part and the next.
  bool stretch = false;              ///< One of several stretches, spread over a long part.
  double initial_speed = 0.0;        ///< Of the fastest joint, where that is why there is a lead-in [rad/s or m/s].

  static void each_field(auto& self, auto&& visit) {
    visit("log", self.log, "Log that it is a part of, from 0.");
    visit("begin", self.begin, "First time; minus infinity: the beginning of the log [s].");
    visit("end", self.end, "Time before which it ends; infinity: the end of the log [s].");
    visit("split", self.split, "Use: fit | check.");
    visit("lead_in", self.lead_in, "Beginning that is simulated and not judged [s].");
    visit("cut", self.cut, "Why the log was cut there: uncut | at_rest | measured | lead_in.");
    visit("stretch", self.stretch, "Whether it is one of several stretches, spread over a long part.");
    visit("initial_speed", self.initial_speed,
          "Speed of the fastest joint at the beginning, where that is why there is a lead-in [rad/s or m/s].");
  }
};

/// The experiments of logged motions, 70 % of the motion to fit, in the order of the logs, unless some are kept to
/// check. Measured parts that are too long to be simulated at the rate that their motion needs
/// (measured_positions.hpp) become stretches, spread evenly. Of arms that are simulated step by step those in which
/// most moves are taken, each with a lead-in, as far as 16,000 steps to fit and 8,000 to check reach.
/// @throws InvalidArgument for sizes that differ, no log, or none to fit.
std::vector<MotionSpan> split_motions(const std::vector<LoggedMotion>& logs);

}  // namespace kr5::arm_log
