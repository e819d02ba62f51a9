// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/cell/cell.hpp>
#include <kr5/core/fields.hpp>

/// @file
/// The path correction of a controller along one axis, cycle by cycle (Hayat et al. 2022, section 5.3).

namespace kr5::physics {

/// Servo, cycle, mode and limits of a path correction, effects included.
struct PathServo {
  cell::SecondOrder servo;
  double cycle = 0.0;  ///< [s]
  cell::Correction correction;

  /// @throws InvalidArgument naming the field that is not there or not positive.
  explicit PathServo(const cell::Cell& cell);

  /// Where a path begins whose first correction is this: there for absolute ones, at 0 for relative ones [m].
  double start(double first) const { return correction.mode == cell::CorrectionMode::Absolute ? first : 0.0; }
};

/// A path correction on its way.
struct PathCorrectionState {
  double start = 0.0, last = 0.0;  ///< [m]
  std::vector<double> line;        ///< [m]
  bool limited = false;
  Eigen::Vector2d servo = Eigen::Vector2d::Zero();  ///< [m, m/s]

  static void each_field(auto& self, auto&& visit) {
    visit("start", self.start, "Where it began [m].");
    visit("last", self.last, "Last command within the limits [m].");
    visit("line", self.line, "Commands on their way, the next one first [m].");
    visit("limited", self.limited, "Whether a limit changed what was last asked.");
    visit("servo", self.servo, "Position and speed behind the servo [m, m/s].");
  }
};

/// From corrections to what the servo is commanded: mode, limits, and the delay in whole cycles.
class PathCommand {
 public:
  PathCommand(const PathServo& servo, double start);

  /// Command held over the next cycle, when `asked` is given at its beginning and the arm is at z [m].
  double next(double asked, double z);
  /// A limit changed what was last asked.
  bool limited() const { return limited_; }
  /// All but the servo.
  PathCorrectionState state() const;
  /// @throws InvalidArgument for a line of another length than the delay.
  void restore(const PathCorrectionState& state);

 private:
  cell::Correction correction_;
  double start_, last_;
  std::vector<double> line_;  ///< Commands on their way, the next one at `at_`.
  std::size_t at_ = 0;
  bool limited_ = false;
};

/// The arm under path corrections: the exact response of its servo.
class PathCorrection {
 public:
  PathCorrection(const PathServo& servo, double start);

  /// One cycle further.
  void advance(double asked);
  double z() const { return state_[0]; }      ///< [m]
  double speed() const { return state_[1]; }  ///< [m/s]
  bool limited() const { return command_.limited(); }
  PathCorrectionState state() const;
  /// @throws InvalidArgument as PathCommand.
  void restore(const PathCorrectionState& state);

 private:
  PathCommand command_;
  Eigen::Matrix2d decay_;
  Eigen::Vector2d state_;
};

}  // namespace kr5::physics
