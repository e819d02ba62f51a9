// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/model_parts.hpp>

#include <string>

#include <Eigen/LU>

#include <kr5/core/error.hpp>

namespace kr5::arm_log {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

std::string listed(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += (out.empty() ? "" : ", ") + name;
  return out;
}

void require_same_joints(const cell::Robot& described, const cell::Robot& recorded) {
  require(described.joints() == recorded.joints(),
          "found " + std::to_string(described.joints()) + " joints, expected " + std::to_string(recorded.joints()) +
              ", as the recording has; is this the model of its robot, and do --base and --tip name its arm?");
  const bool named = !described.joint_names.empty() && !recorded.joint_names.empty();
  require(!named || described.joint_names == recorded.joint_names,
          "found the joints " + listed(described.joint_names) + ", expected " + listed(recorded.joint_names) +
              ", as the recording has; is this the model of its robot?");
}

/// Gears and motors of the recording, with the friction of the description where it states any, and its rotors.
cell::Drives described_drives(const std::optional<cell::Drives>& described, cell::Drives recorded, bool states_rotors) {
  if (!described) return recorded;
  recorded.friction = described->friction;
  if (states_rotors) {
    const MatrixXd back = recorded.structure.inverse();
    recorded.rotor_inertia = (back.transpose() * described->rotor_inertia.asDiagonal() * back).diagonal();
  }
  return recorded;
}

/// Pose of the flange in the base, at zero joint angles.
Pose flange_at_zero(const cell::Cell& cell) {
  const Pose tool = cell.tool ? cell.tool->T_flange_tool : Pose::Identity();
  return cell::T_base_tool(cell, VectorXd::Zero(cell.robot.joints())) * tool.inverse();
}

/// The tool of the recording, unless the arm of the description reaches to its tip and so has it as a link.
cell::Tool described_tool(const cell::Cell& description, const cell::Cell& recorded) {
  const Eigen::Vector3d tip = cell::T_base_tool(recorded, VectorXd::Zero(recorded.robot.joints())).translation(),
                        flange = flange_at_zero(recorded).translation(),
                        end = flange_at_zero(description).translation();
  if ((end - flange).norm() <= (end - tip).norm()) return *recorded.tool;
  cell::Tool out;
  out.T_flange_sensor = recorded.tool->T_flange_tool.inverse() * recorded.tool->T_flange_sensor;
  return out;
}

template <class Part>
void keep(std::optional<Part>& described, const std::optional<Part>& recorded) {
  if (!described) described = recorded;
}

}  // namespace

std::vector<LogNote> add_parts_to_try(cell::Cell& cell) {
  std::vector<LogNote> out;
  if (!cell.drives && !cell.robot.links.empty()) {
    cell.drives = cell::unit_drives(cell.robot.joints());
    out.push_back({.kind = LogNoteKind::NoDrives});
  }
  if (!cell.tool) {
    cell.tool = cell::Tool{};
    out.push_back({.kind = LogNoteKind::NoTool});
  }
  return out;
}

cell::Cell described_cell(const cell::Cell& description, const cell::Cell& recorded, bool states_rotors) {
  require_same_joints(description.robot, recorded.robot);
  cell::Cell out = description;
  out.noise = recorded.noise;
  keep(out.servo, recorded.servo);
  keep(out.camera, recorded.camera);
  keep(out.board, recorded.board);
  keep(out.laser, recorded.laser);
  keep(out.contact, recorded.contact);
  keep(out.peg, recorded.peg);
  keep(out.tube, recorded.tube);
  if (out.targets.empty()) out.targets = recorded.targets;
  if (recorded.drives) out.drives = described_drives(out.drives, *recorded.drives, states_rotors);
  if (recorded.tool && (!out.tool || out.tool->mass == 0)) out.tool = described_tool(out, recorded);
  return out;
}

}  // namespace kr5::arm_log
