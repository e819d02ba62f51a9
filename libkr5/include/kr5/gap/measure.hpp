// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/cell/recording.hpp>
#include <kr5/cell/simulator.hpp>
#include <kr5/core/fields.hpp>

/// @file
/// How far a simulation is from what was recorded, in units of noise.

namespace kr5::gap {

/// Gap of one column of one experiment: RMS of (recorded - simulated) over the noise of the column; 1 is the floor.
struct ColumnGap {
  std::string experiment;
  cell::Kind kind = cell::Kind::Motion;
  std::string column;
  std::string target;
  std::string unit;
  cell::Split split = cell::Split::Fit;
  int rows = 0;
  int left_out = 0;
  double gap = 0.0;    ///< [-]
  double limit = 0.0;  ///< [-]
  bool exceeds = false;
  double rms = 0.0;
  double noise = 0.0;

  static void each_field(auto& self, auto&& visit) {
    visit("experiment", self.experiment, "Name of the experiment.");
    visit("kind", self.kind, "Kind of the experiment.");
    visit("column", self.column, "Name of the column; orientation is rx ry rz, of Log(R_simulated^T R_recorded).");
    visit("target", self.target, "Target of the catalogue nearest to the column, e.g. joint3, camera.");
    visit("unit", self.unit, "Unit of `rms` and `noise`.");
    visit("split", self.split, "Use of the data: fit | check.");
    visit("rows", self.rows, "Number of rows compared.");
    visit("left_out", self.left_out,
          "Number of rows not compared: rays of a scan that meet the sphere in only one of the two.");
    visit("gap", self.gap, "RMS of recorded minus simulated over the noise; 1 is the floor [-].");
    visit("limit", self.limit, "Limit that noise alone stays below in 99.9 % of recordings, by chi-square [-].");
    visit("exceeds", self.exceeds, "Whether the gap is above the limit.");
    visit("rms", self.rms, "RMS of recorded minus simulated.");
    visit("noise", self.noise, "Standard deviation of one sample that the cell of the recording states.");
  }
};

/// Gap of all columns that have something in common.
struct GapPart {
  std::string by;
  std::string name;
  int columns = 0;
  int exceeding = 0;
  double gap = 0.0;    ///< [-]
  double share = 0.0;  ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("by", self.by, "Shared property: subsystem | target | channel | experiment | pose region | speed.");
    visit("name", self.name, "Value of that property, e.g. drives, joint3, motor current, motion-2, at rest.");
    visit("columns", self.columns, "Number of columns.");
    visit("exceeding", self.exceeding, "Number of columns above their limit.");
    visit("gap", self.gap, "RMS of their gaps [-].");
    visit("share", self.share,
          "Fraction of the excess (gap^2 - 1, by rows, of columns above their limit) in this part; negative where the "
          "residuals are below the noise [-].");
  }
};

struct Measure {
  double gap = 0.0;  ///< [-]
  int exceeding = 0;
  std::vector<ColumnGap> columns;
  std::vector<GapPart> parts = {};
  std::vector<std::string> refused = {};

  static void each_field(auto& self, auto&& visit) {
    visit("gap", self.gap, "RMS of the gaps of all columns [-].");
    visit("exceeding", self.exceeding, "Number of columns above their limit.");
    visit("columns", self.columns, "Compared columns, in the order of the recording.");
    visit("parts", self.parts,
          "Gaps by subsystem, target, channel and experiment, and of the rows by pose region and speed; in each group "
          "the largest first.");
    visit("refused", self.refused, "Experiments that the simulator cannot predict, and why.");
  }
};

/// The gap of so many rows that noise alone exceeds once in a thousand columns, or in any of so many columns once in a
/// thousand recordings, by chi-square; infinite without rows [-].
double noise_limit(double rows, int columns = 1);

/// Gap of every column that was recorded, that the simulator predicts for `cell`, and whose noise the recording's cell
/// states.
/// @throws InvalidArgument for a cell of another robot, and when all that could be compared is refused.
Measure measure(const cell::Recording& recording, const cell::Cell& cell, const cell::Simulator& simulator);
/// The same of the cell that the recording names.
Measure measure(const cell::Recording& recording, const cell::Simulator& simulator);

}  // namespace kr5::gap
