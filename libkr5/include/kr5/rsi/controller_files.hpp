// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <kr5/robot/command.hpp>
#include <kr5/rsi/telegram_layout.hpp>

/// @file
/// What a controller needs to take part: its sensor configuration, the signal flow that wires the channels of the
/// Ethernet object to corrections and readings, and the KRL program that switches RSI on.

namespace kr5::rsi {

struct ProgramOptions {
  std::string name = "kr5_rsi";
  robot::CommandMode mode = robot::CommandMode::Absolute;
  robot::CommandFrame frame = robot::CommandFrame::Base;
  std::optional<double> cycle = {};  ///< [s]
  std::vector<double> start = {};    ///< [rad]
  int timeout = 100;
  int flag = 1;
  double axis_limit = 0.0873;        ///< [rad]
  double translation_limit = 0.005;  ///< [m]
  double rotation_limit = 0.0873;    ///< [rad]
  double external_limit = 0.005;     ///< [rad or m]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of program and files, at most 24 letters, digits and underscores.");
    visit("mode", self.mode, "Corrections: absolute (all of it each cycle) | relative (what is added in a cycle).");
    visit("frame", self.frame, "Axes of Cartesian corrections: base | tool.");
    visit("cycle", self.cycle, "Cycle, 4 or 12 ms; none: 12 ms of a KR C2, 4 ms of the others [s].");
    visit("start", self.start, "Joint values at which the program starts; empty: where the arm stands [rad].");
    visit("timeout", self.timeout, "Answers that may be late in succession before the controller stops.");
    visit("flag", self.flag, "Number of the $FLAG that is true while the connection is interrupted; 0: none.");
    visit("axis_limit", self.axis_limit, "Greatest correction of an axis, in either direction [rad].");
    visit("translation_limit", self.translation_limit, "Greatest correction along X, Y and Z, either way [m].");
    visit("rotation_limit", self.rotation_limit, "Greatest correction of the orientation [rad].");
    visit("external_limit", self.external_limit, "Greatest correction of an external axis, either way [rad or m].");
  }
};

/// A file, and the folder of the controller that it belongs to.
struct ControllerFile {
  std::string name;
  std::string folder;
  std::string text;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the file.");
    visit("folder", self.folder, "Folder on the controller.");
    visit("text", self.text, "What stands in it.");
  }
};

struct ControllerFiles {
  std::vector<ControllerFile> files;
  /// Elements that are in the configuration, and that nothing is wired to: the controller refuses them until that is
  /// done by hand.
  std::vector<std::string> unwired;
  /// Objects of the signal flow whose numbering no published file confirms: to be compared in RSIVisual.
  std::vector<std::string> unconfirmed;

  static void each_field(auto& self, auto&& visit) {
    visit("files", self.files, "The files.");
    visit("unwired", self.unwired, "Tags of elements that must be wired by hand.");
    visit("unconfirmed", self.unconfirmed, "Objects whose numbering no published file confirms.");
  }
};

/// The files for the controller of the layout.
/// @throws InvalidArgument as `validate` of layout and options, and for a cycle that the controller does not have.
ControllerFiles controller_files(const TelegramLayout& layout, const ProgramOptions& options = {});

}  // namespace kr5::rsi
