// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <kr5/cell/drives.hpp>
#include <kr5/cell/effects.hpp>
#include <kr5/cell/noise.hpp>
#include <kr5/cell/robot.hpp>
#include <kr5/cell/sensors.hpp>
#include <kr5/cell/target.hpp>
#include <kr5/cell/tool.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/io/node.hpp>
#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// Nominal model of a robot cell: format `kr5-cell/1`. Frames: B base, F flange, E tool tip, S force sensor,
/// C camera, L line scanner, W board, T tube.

namespace kr5::cell {

/// The nominal cell with its active effects. A part that a cell does not have is absent.
struct Cell {
  std::string name;
  Robot robot;
  std::optional<Drives> drives;
  std::optional<Servo> servo;
  std::optional<Tool> tool;
  std::optional<Camera> camera;
  std::optional<Board> board;
  std::vector<Target> targets;
  std::optional<LineScanner> laser;
  std::optional<Contact> contact;
  std::optional<Peg> peg;
  std::optional<Tube> tube;
  Noise noise;
  Effects effects;

  /// Checks everything that `load_cell` checks; simulators call it.
  /// @throws InvalidArgument with every error of form and value.
  void validate() const;
  /// Whether validate() finds none.
  bool valid() const;

  /// Whether its joints have torque servos, so that commands move it forward.
  bool has_torque_servos() const { return servo && !servo->torque.empty(); }

  /// The document the cell was read from, so that it is written back in that form. No part of what the cell is.
  std::shared_ptr<const io::Node> source;

  static constexpr std::array<std::string_view, 1> required = {"robot"};
  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the cell.");
    visit("robot", self.robot, "Robot arm.");
    visit("drives", self.drives, "Motors and gears.");
    visit("servo", self.servo, "Servo of the axes and of the path correction.");
    visit("tool", self.tool, "Tool on the flange.");
    visit("camera", self.camera, "Camera.");
    visit("board", self.board, "Marker board.");
    visit("targets", self.targets, "Further boards and marker maps.");
    visit("laser", self.laser, "Line scanner.");
    visit("contact", self.contact, "Contact of the tool with its surroundings.");
    visit("peg", self.peg, "Peg that is inserted.");
    visit("tube", self.tube, "Tube that receives the peg.");
    visit("noise", self.noise, "Standard deviation of every sensor; 0 where there is none.");
    visit("effects", self.effects, "Active effects: <id>.<target>.<parameter>.");
  }
};

/// Reads a cell in any of its forms.
/// @throws IoError with file, line, field, the value found and what was expected of every error: unknown or missing
///         keys, types, sizes that do not fit the number of joints, effects on parts that are not there, values that no
///         cell has or that cannot be simulated. Warnings (values that look like another unit) are for `check`.
Cell load_cell(const std::filesystem::path& file);
Cell parse_cell(std::string_view yaml, const std::string& source);

/// Writes a cell in the form in which it was read, where what changed allows; reads back bit for bit.
void save_cell(const Cell& cell, const std::filesystem::path& file);
std::string to_yaml(const Cell& cell);

/// The nominal arm, effects apart.
kinematics::DhChain nominal_chain(const Cell& cell);
/// Nominal pose of the tool tip in the base for joint values q [rad or m].
Pose T_base_tool(const Cell& cell, const Eigen::VectorXd& q);
/// Nominal camera and scanner in the flange, or nothing when the cell has none there.
std::optional<Pose> T_flange_camera(const Cell& cell);
std::optional<Pose> T_flange_scanner(const Cell& cell);

}  // namespace kr5::cell
