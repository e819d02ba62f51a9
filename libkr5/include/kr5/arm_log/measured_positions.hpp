// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/arm_log/time_span.hpp>
#include <kr5/core/fields.hpp>

/// @file
/// Measured positions that stand for a motion: smoothed, since speeds and accelerations follow from them.

namespace kr5::arm_log {

/// Seconds beyond an experiment that the filter may use.
inline constexpr double smoothing_margin = 5.0;

/// How measured positions are smoothed and thinned.
struct Smoothing {
  double cutoff = 0.0;     ///< Five times the bandwidth of the motion, or where it ends in the noise [Hz].
  double even_step = 0.0;  ///< Where the stamps came late and the samples were even; 0: the stamps hold [s].
  int stride = 1;          ///< Rows of the log of which the motion needs one.
  bool smooths = false;    ///< Whether the log is fast enough to have anything above the cut-off.
  Eigen::VectorXd speed_noise =
      {};  ///< Standard deviation of the speeds that the smoothed positions give [rad/s or m/s].

  static void each_field(auto& self, auto&& visit) {
    visit("cutoff", self.cutoff,
          "Half-power frequency: five times the bandwidth of the motion, or where it ends in the noise [Hz].");
    visit("even_step", self.even_step,
          "Step of the samples where the time stamps came late; 0: samples were taken when the stamps say [s].");
    visit("stride", self.stride, "Rows of the log of which the motion needs one.");
    visit("smooths", self.smooths, "Whether the log is fast enough to have anything above the cut-off.");
    visit("speed_noise", self.speed_noise,
          "Standard deviation of the speeds that the smoothed positions give, a joint each: of the noise of readings, "
          "and "
          "of the low-pass, which rings about stops by a hundredth of the RMS speed [rad/s or m/s].");
  }
};

/// The step of a log: the median of its steps, of an even number the larger one in the middle. @param t Times [s].
/// @throws InvalidArgument for fewer than two.
double middle_step(const Eigen::VectorXd& t);

/// The smoothing of a motion. @param t Times, rising [s]; @param q Rows x joints [rad or m]; @param loads In the same
/// rows, for the meaning of uneven stamps; may be empty.
/// @throws InvalidArgument for fewer than 30 rows, or such as do not tell how fast the arm moves.
Smoothing choose_smoothing(const Eigen::VectorXd& t, const Eigen::MatrixXd& q, const Eigen::MatrixXd& loads = {});

/// Positions over times of their own.
struct Positions {
  Eigen::VectorXd t;  ///< [s]
  Eigen::MatrixXd q;  ///< Rows x joints [rad or m].

  static void each_field(auto& self, auto&& visit) {
    visit("t", self.t, "Times [s].");
    visit("q", self.q, "Joint values, rows x joints [rad or m].");
  }
};

/// Positions at even steps, low-passed without delay; as they are where nothing is smoothed.
/// @throws InvalidArgument for a step that makes more than five million rows.
Positions smooth_positions(const Eigen::VectorXd& t, const Eigen::MatrixXd& q, const Smoothing& smoothing);

/// Positions at other times, by the cubic spline through them.
Eigen::MatrixXd positions_at(const Positions& positions, const Eigen::VectorXd& t);

/// The rows that an experiment keeps of a log: one in `smoothing.stride`, not those near an end of the positions that
/// were smoothed, where the filter knows one side only.
/// @param t Times of the log, rising [s]. @param experiment From its beginning up to its end. @param positions From the
/// first position to the last. @param most Rows above which every second one, third one ... is kept; 0: no limit.
std::vector<Eigen::Index> kept_rows(const Eigen::VectorXd& t, const Smoothing& smoothing, const TimeSpan& experiment,
                                    const TimeSpan& positions, int most = 0);

/// Rows of an experiment that a diagnosis simulates at most.
inline constexpr int max_experiment_rows = 3000;

}  // namespace kr5::arm_log
