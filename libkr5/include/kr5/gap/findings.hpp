// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <kr5/cell/columns.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/core/fields.hpp>

/// @file
/// What a diagnosis finds about a recording itself: its noise, its clocks, what of it was not compared, and what it
/// cannot show. Sentences are made of it in sentences.hpp.

namespace kr5::gap {

/// Noise that is not what the cell declares; a diagnosis takes the measured one.
struct NoiseRatio {
  std::string key;
  std::optional<cell::Kind> kind = {};
  double ratio = 1.0;  ///< [-]
  double std = 0.0;    ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("key", self.key, "Key in `noise` of the cell, e.g. current.");
    visit("kind", self.kind, "Kind of experiment to which it applies; without: all.");
    visit("ratio", self.ratio, "Ratio of measured to declared noise [-].");
    visit("std", self.std, "Standard deviation of the ratio [-].");
  }
};

/// Columns that were logged late or early relative to the others.
struct ClockFault {
  std::string group;
  std::vector<cell::Kind> kinds;
  double delay = 0.0;  ///< [s]
  double std = 0.0;    ///< [s]

  static void each_field(auto& self, auto&& visit) {
    visit("group", self.group, "Group of the columns: positions | currents | torques | wrench.");
    visit("kinds", self.kinds, "Kinds of experiments in which they are.");
    visit("delay", self.delay, "Time by which they were logged late; negative: early [s].");
    visit("std", self.std, "Standard deviation of the delay [s].");
  }
};

/// A column of one experiment.
struct ColumnName {
  std::string experiment;
  std::string column;

  static void each_field(auto& self, auto&& visit) {
    visit("experiment", self.experiment, "Name of the experiment.");
    visit("column", self.column, "Name of the column.");
  }
};

enum class LeftOutReason {
  NoiseNotStated,  ///< The cell does not state the noise of the columns.
  NotPredicted,    ///< The simulator does not predict them.
  NotFinite,       ///< The simulation gives no finite value.
  Refused,         ///< The simulator refuses the experiment.
};
constexpr auto enum_names(LeftOutReason) {
  using enum LeftOutReason;
  return names<LeftOutReason>({{NoiseNotStated, "noise_not_stated"},
                               {NotPredicted, "not_predicted"},
                               {NotFinite, "not_finite"},
                               {Refused, "refused"}});
}

/// What was recorded and not compared.
struct LeftOut {
  cell::Kind kind = cell::Kind::Motion;
  std::string experiment = {};
  std::vector<std::string> columns = {};
  LeftOutReason reason = LeftOutReason::NotPredicted;
  std::string detail = {};

  static void each_field(auto& self, auto&& visit) {
    visit("kind", self.kind, "Kind of experiment.");
    visit("experiment", self.experiment, "Name of the experiment; empty: all of the kind.");
    visit("columns", self.columns, "Columns that were not compared; empty: all.");
    visit("reason", self.reason, "Reason: noise_not_stated | not_predicted | not_finite | refused.");
    visit("detail", self.detail, "Key in `noise` that the cell does not state, or the message of the simulator.");
  }
};

/// A kind of experiment of which there is none to fit effects, or none to check them.
struct MissingSplit {
  cell::Kind kind = cell::Kind::Motion;
  cell::Split split = cell::Split::Check;

  static void each_field(auto& self, auto&& visit) {
    visit("kind", self.kind, "Kind of experiment.");
    visit("split", self.split, "Use of the data of which there is none: fit | check.");
  }
};

/// What a simulator may be off in one column without any effect, where that is known of the column.
struct ColumnError {
  std::string column;  ///< Kind of experiment and column: `motion.tau3`.
  double error = 0.0;  ///< RMS, in the unit of the column.

  static void each_field(auto& self, auto&& visit) {
    visit("column", self.column, "Kind of experiment and column, e.g. motion.tau3.");
    visit("error", self.error, "RMS error, in the unit of the column.");
  }
};

/// Variance of a mean of many values of noise over that of as many independent ones, whose neighbours have a
/// correlation: (1 + r) / (1 - r) [-].
inline double colour_factor(double correlation) { return (1 + correlation) / (1 - correlation); }

/// Noise of one column whose neighbouring rows are alike.
struct ColumnCorrelation {
  std::string column;        ///< `motion.tau3`
  double correlation = 0.0;  ///< Of neighbouring rows, from 0 to below 1 [-].

  static void each_field(auto& self, auto&& visit) {
    visit("column", self.column, "Kind of experiment and column, e.g. motion.tau3.");
    visit("correlation", self.correlation, "Correlation of the noise of neighbouring rows [-].");
  }
};

enum class ScopeReason {
  FewRows,    ///< An experiment of so few rows shows neither a gap nor its absence.
  AtRest,     ///< A motion in which nothing is commanded to move.
  OneKind,    ///< Experiments of one kind only, which speaks for a part of the cell.
  Described,  ///< In words of an older file.
};
constexpr auto enum_names(ScopeReason) {
  using enum ScopeReason;
  return names<ScopeReason>(
      {{FewRows, "few_rows"}, {AtRest, "at_rest"}, {OneKind, "one_kind"}, {Described, "described"}});
}

/// A limit of what a recording can show.
struct ScopeLimit {
  ScopeReason reason = ScopeReason::OneKind;
  cell::Kind kind = cell::Kind::Motion;
  std::string experiment = {};
  int rows = 0;
  std::string note = {};

  static void each_field(auto& self, auto&& visit) {
    visit("reason", self.reason, "Reason: few_rows | at_rest | one_kind | described.");
    visit("kind", self.kind, "Kind of experiment.");
    visit("experiment", self.experiment, "Name of the experiment; empty: all.");
    visit("rows", self.rows, "Number of its rows.");
    visit("note", self.note, "Limit in words of a file of format kr5-gap/1.");
  }
};

}  // namespace kr5::gap
