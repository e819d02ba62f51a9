// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/cell.hpp>

#include <kr5/core/error.hpp>
#include <kr5/io/form.hpp>
#include <kr5/kinematics/body.hpp>

#include "cell/check_cell.hpp"

namespace kr5::cell {
namespace {

using io::Node;

constexpr const char* cell_format = "kr5-cell/1";

/// Every field at its value, in the canonical form.
Node canonical(const Cell& cell) {
  Node node;
  node["format"] = Node::of(std::string(cell_format));
  for (auto& entry : io::detail::short_map(cell).entries) node.entries.push_back(std::move(entry));
  return node;
}

}  // namespace

Eigen::Matrix3d Tool::inertia_matrix() const { return kinematics::inertia_matrix(inertia); }

Cell read_cell(const Node& root, const std::string& file, std::vector<io::Problem>& problems) {
  Cell cell;
  io::Reader reader(file);
  const Node* format = root.find("format");
  if (root.kind != Node::Kind::Map)
    reader.problem(root, "", "a map with format: " + std::string(cell_format));
  else if (!format)
    reader.missing(root, "format", cell_format);
  else if (format->scalar != cell_format)
    reader.problem(*format, "format", cell_format);
  if (reader.problems().empty()) {
    Node body = root;
    std::erase_if(body.entries, [](const auto& entry) { return entry.first == "format"; });
    reader.read(body, "", cell);
  }
  problems.insert(problems.end(), reader.problems().begin(), reader.problems().end());
  if (!reader.problems().empty()) return cell;
  Complaints complaints(file, root);
  check_form(cell, complaints);
  for (io::Problem& p : complaints.take()) problems.push_back(std::move(p));
  cell.source = std::make_shared<const Node>(root);
  return cell;
}

Cell parse_cell(std::string_view yaml, const std::string& source) {
  std::vector<io::Problem> problems;
  Cell cell = read_cell(io::parse_yaml(yaml, source), source, problems);
  io::throw_problems(problems);
  return cell;
}

Cell load_cell(const std::filesystem::path& file) { return parse_cell(io::read_text(file), file.string()); }

Node cell_node(const Cell& cell) {
  const Node now = canonical(cell);
  if (!cell.source) return now;
  std::vector<io::Problem> problems;
  const Cell then = read_cell(*cell.source, "", problems);
  return io::keep_form(now, canonical(then), *cell.source);
}

std::string to_yaml(const Cell& cell) { return io::to_yaml(cell_node(cell)); }

void save_cell(const Cell& cell, const std::filesystem::path& file) {
  const std::string text = to_yaml(cell);
  parse_cell(text, file.string() + " (not written)");  // a file that nobody can read is not worth the old one
  io::write_text(file, text);
}

kinematics::DhChain chain(const Cell& cell) { return {cell.robot.T_B_0, cell.robot.dh}; }

Pose T_B_E(const Cell& cell, const Eigen::VectorXd& q) {
  const Pose T_B_F = chain(cell).flange(q);
  return cell.tool ? T_B_F * cell.tool->T_F_E : T_B_F;
}

std::optional<Pose> T_F_C(const Cell& cell) {
  if (!cell.camera || cell.camera->mount == CameraMount::Base) return std::nullopt;
  if (cell.camera->T_E_C && cell.tool) return cell.tool->T_F_E * *cell.camera->T_E_C;
  return cell.camera->T_F_C;
}

std::optional<Pose> T_F_L(const Cell& cell) {
  if (!cell.laser) return std::nullopt;
  if (cell.laser->T_E_L && cell.tool) return cell.tool->T_F_E * *cell.laser->T_E_L;
  return cell.laser->T_F_L;
}

}  // namespace kr5::cell
