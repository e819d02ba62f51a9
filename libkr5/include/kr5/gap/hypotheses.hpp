// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/cell/cell.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/gap/diagnosis.hpp>

/// @file
/// What a gap may come from: every effect of the catalogue on every target, as a function of a few numbers.

namespace kr5::gap {

/// One number of a hypothesis, in units of a size that such an effect often has, 0 where the effect is off.
struct Coordinate {
  double lower = -1e9;
  double upper = 1e9;
  double step = 0.02;  ///< Of finite differences.
  bool shape = false;  ///< Says nothing by itself (a time constant); does not scale with the effect.
  bool whole = false;  ///< Only whole numbers can be told apart (cycles of a servo).
  // Of effects that no catalogue names: how the coordinate is reported.
  std::string name = {};
  std::string unit = {};
  double size = 1.0;  ///< What 1 stands for [unit].
};

/// Where the signature of an effect is taken: the changes of the prediction from "off" to each of these points. The
/// changes are taken as linear in between; effects that are not have several of them.
struct Probe {
  std::vector<Eigen::VectorXd> points;
  bool indivisible = false;  ///< Shows nothing of the effect unless its points change the columns in different ways.
};

/// An effect on a target, with every discrete choice (cycles, source, element, a or b) made.
struct Hypothesis : EffectName {
  std::string choice;      ///< The discrete choice in words; empty where there is none.
  double log_prior = 0.0;  ///< Of this choice among those of the same effect and target.
  /// How far a simulator may be off with it, of its own size, beyond what it is off anyway.
  double inaccuracy = 0.0;
  std::vector<Coordinate> coordinates;
  std::vector<Probe> probes;
  /// Sets the effect in a cell, the rest of which it leaves alone.
  std::function<void(cell::Cell&, const Eigen::VectorXd&)> apply;
  /// Changes what the simulator shows, for what a cell cannot hold (a fault of a sensor). Either of the two may be
  /// empty.
  std::function<void(io::Table&, const cell::Experiment&, const Eigen::VectorXd&)> change = {};
  /// Of the recording (a clock that is off), not of the cell: it competes with effects, and is warned of, not blamed.
  bool of_recording = false;

  int size() const { return static_cast<int>(coordinates.size()); }
  EffectName name() const { return *this; }
};

/// One number of an effect that no catalogue names, in its own unit; 0 where the effect is off.
struct OwnCoordinate {
  std::string name;
  std::string unit;
  double size = 1.0;
  double lower = -1e9;
  double upper = 1e9;
  std::vector<double> shapes = {};

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name in reports.");
    visit("unit", self.unit, "Unit in reports.");
    visit("size", self.size,
          "Usual size of the coordinate [unit]; the standard deviation of the prior is three times as large.");
    visit("lower", self.lower, "Smallest value [unit].");
    visit("upper", self.upper, "Largest value [unit].");
    visit("shapes", self.shapes,
          "Initial values, for a coordinate that alone does not determine the size of the effect, such as a time "
          "constant or a speed [unit]; at most one coordinate has them, and not the first.");
  }
};

/// An effect that no catalogue names. `apply` and `change` get the numbers in their own units; either may be empty.
struct OwnEffect : EffectName {
  std::vector<OwnCoordinate> coordinates;
  /// Sets the effect in a cell.
  std::function<void(cell::Cell&, const Eigen::VectorXd&)> apply;
  /// Changes what the simulator shows (columns to be predicted, a row for each row of the experiment), for what a cell
  /// cannot hold. Called from any thread.
  std::function<void(io::Table&, const cell::Experiment&, const Eigen::VectorXd&)> change;
  double inaccuracy = 0.0;
};

/// The same as the diagnosis wants it.
/// @throws InvalidArgument for no coordinate, no name, a size that is not positive, bounds that leave out 0 (of what is
///         no shape), or neither `apply` nor `change`.
Hypothesis own_hypothesis(const OwnEffect& effect);

/// Times between which an experiment was made, for effects that grow with time [s].
struct TimeSpan {
  double first = 0.0;
  double last = 1.0;
};
TimeSpan span_of(const cell::Recording& recording);

/// All effects of the catalogue on all targets of a cell, but those that are periodic in a joint angle: their cycles
/// come from the data.
std::vector<Hypothesis> hypotheses(const cell::Cell& cell, const TimeSpan& span);

/// An effect of the catalogue that is periodic in the angle of a joint (from 0).
struct PeriodicEffect {
  std::string effect;
  int joint = 0;
};
std::vector<PeriodicEffect> periodic_effects(const cell::Cell& cell);

/// A periodic effect with so many cycles a turn; coordinates are the amplitudes of sine and cosine.
Hypothesis periodic_hypothesis(const cell::Cell& cell, const PeriodicEffect& effect, int cycles);

/// Coordinates of a hypothesis at a size that such an effect often has.
Eigen::VectorXd typical_point(const Hypothesis& hypothesis);

/// The cell with an effect of the catalogue added at a size that such an effect often has: the first of its discrete
/// choices, and one cycle a turn where it is periodic.
/// @throws InvalidArgument for an unknown effect, and for a target that this cell does not have.
cell::Cell with_typical_effect(const cell::Cell& cell, const EffectName& name, const TimeSpan& span = {});

}  // namespace kr5::gap
