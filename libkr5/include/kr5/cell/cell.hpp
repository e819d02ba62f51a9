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
/// What is believed about a robot cell: format `kr5-cell/1`. Frames: B base, F flange, E tool tip, S force sensor,
/// C camera, L line scanner, W board, T tube.

namespace kr5::cell {

/// The believed cell, and every effect it may carry. A part that a cell does not have is absent.
struct Cell {
  std::string name;
  Robot robot;
  std::optional<Drives> drives;
  std::optional<Servo> servo;
  std::optional<Tool> tool;
  std::optional<Camera> camera;
  std::optional<Board> board;
  std::vector<Target> targets;
  std::optional<Laser> laser;
  std::optional<Contact> contact;
  std::optional<Peg> peg;
  std::optional<Tube> tube;
  Noise noise;
  Effects effects;

  /// The document the cell was read from, so that it is written back in that form. No part of what the cell is.
  std::shared_ptr<const io::Node> source;

  static constexpr std::array<std::string_view, 1> required = {"robot"};
  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the cell.");
    visit("robot", self.robot, "The arm.");
    visit("drives", self.drives, "Motors and gears.");
    visit("servo", self.servo, "How commands become motion.");
    visit("tool", self.tool, "What the flange carries.");
    visit("camera", self.camera, "The camera.");
    visit("board", self.board, "The marker board it looks at.");
    visit("targets", self.targets, "Other boards and marker maps.");
    visit("laser", self.laser, "The line scanner.");
    visit("contact", self.contact, "Contact of the tool with what it presses on.");
    visit("peg", self.peg, "The part that is inserted.");
    visit("tube", self.tube, "The hole.");
    visit("noise", self.noise, "Standard deviation of every sensor; 0 where there is none.");
    visit("effects", self.effects, "Effects that are switched on: <id>.<target>.<parameter>.");
  }
};

/// Reads a cell in any of its forms.
/// @throws IoError with file, line, field, the value found and what was expected of everything that is wrong in form:
///         unknown or missing keys, types, sizes that do not fit the number of joints, effects on parts that are not
///         there. What only looks wrong (units, masses) is for `check`.
Cell load_cell(const std::filesystem::path& file);
Cell parse_cell(std::string_view yaml, const std::string& source);

/// Writes a cell in the form in which it was read, where what changed allows; reads back bit for bit.
void save_cell(const Cell& cell, const std::filesystem::path& file);
std::string to_yaml(const Cell& cell);

/// The nominal arm, effects apart.
kinematics::DhChain chain(const Cell& cell);
/// Nominal pose of the tool tip in the base for joint values q [rad or m].
Pose T_B_E(const Cell& cell, const Eigen::VectorXd& q);
/// Nominal camera and scanner in the flange, or nothing when the cell has none there.
std::optional<Pose> T_F_C(const Cell& cell);
std::optional<Pose> T_F_L(const Cell& cell);

}  // namespace kr5::cell
