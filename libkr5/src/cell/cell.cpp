// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/cell.hpp>

#include <kr5/core/error.hpp>
#include <kr5/io/format.hpp>
#include <kr5/kinematics/body.hpp>

#include "cell/cell_document.hpp"
#include "cell/check/form.hpp"
#include "cell/check/magnitude.hpp"
#include "cell/check/values.hpp"

namespace kr5::cell {
namespace {

using io::Node;

constexpr const char* cell_format = "kr5-cell/1";

/// Every field at its value, in the canonical form.
Node canonical(const Cell& cell) {
  Node node;
  node["format"] = Node::make_scalar(std::string(cell_format));
  for (auto& entry : io::detail::short_map(cell).entries) node.entries.push_back(std::move(entry));
  return node;
}

}  // namespace

Eigen::Matrix3d Tool::inertia_matrix() const { return kinematics::inertia_matrix(inertia); }

namespace {

/// The cell as far as its form allows; `source` is set when the form has no error.
Cell read_cell_form(const Node& root, const std::string& file, std::vector<io::Diagnostic>& diagnostics) {
  Cell cell;
  io::Reader reader(file);
  const Node* format = root.find("format");
  if (root.kind != Node::Kind::Map) {
    const std::string wanted = "a map with format: " + std::string(cell_format);
    if (root.scalar.starts_with("<")) {
      diagnostics.push_back({file, 1, "", "XML", wanted + "; kr5 cell import makes the cell of a URDF or MJCF"});
      return cell;
    }
    reader.report(root, "", wanted);
  } else if (!format) {
    reader.report_missing(root, "format", cell_format);
  } else if (format->scalar != cell_format) {
    reader.report(*format, "format", cell_format);
  }
  if (reader.diagnostics().empty()) {
    Node body = root;
    std::erase_if(body.entries, [](const auto& entry) { return entry.first == "format"; });
    reader.read(body, "", cell);
  }
  diagnostics.insert(diagnostics.end(), reader.diagnostics().begin(), reader.diagnostics().end());
  if (!reader.diagnostics().empty()) return cell;
  DiagnosticCollector collector(file, root);
  check_form(cell, collector);
  const std::vector<io::Diagnostic> found = collector.take();
  if (found.empty()) cell.source = std::make_shared<const Node>(root);
  diagnostics.insert(diagnostics.end(), found.begin(), found.end());
  return cell;
}

void append_value_errors(const Cell& cell, const Node& root, const std::string& file,
                         std::vector<io::Diagnostic>& diagnostics) {
  DiagnosticCollector collector(file, root);
  check_magnitude(cell, collector);
  std::vector<io::Diagnostic> found = collector.take();
  if (found.empty()) check_values(cell, collector);  // moments of what is not finite mean nothing
  for (io::Diagnostic& d : collector.take()) found.push_back(std::move(d));
  for (io::Diagnostic& d : found) diagnostics.push_back(std::move(d));
}

}  // namespace

Cell read_cell(const Node& root, const std::string& file, std::vector<io::Diagnostic>& diagnostics) {
  Cell cell = read_cell_form(root, file, diagnostics);
  if (cell.source) append_value_errors(cell, root, file, diagnostics);
  return cell;
}

std::vector<io::Diagnostic> cell_errors(const Cell& cell, const Node& root, const std::string& file) {
  DiagnosticCollector form(file, root);
  check_form(cell, form);
  std::vector<io::Diagnostic> found = form.take();
  if (found.empty()) append_value_errors(cell, root, file, found);
  return found;
}

bool Cell::valid() const {
  const Node nothing;  // the tree of the document is made only when there is something to say
  return cell_errors(*this, nothing, name).empty();
}

void Cell::validate() const {
  if (valid()) return;
  std::string text;
  for (const io::Diagnostic& d : cell_errors(*this, cell_node(*this), name.empty() ? "cell" : name))
    text += (text.empty() ? "" : "\n") + d.text();
  throw InvalidArgument(text);
}

Cell parse_cell(std::string_view yaml, const std::string& source) {
  std::vector<io::Diagnostic> diagnostics;
  Cell cell = read_cell(io::parse_yaml(yaml, source), source, diagnostics);
  io::throw_diagnostics(diagnostics);
  return cell;
}

Cell load_cell(const std::filesystem::path& file) { return parse_cell(io::read_text(file), file.string()); }

Node cell_node(const Cell& cell) {
  const Node now = canonical(cell);
  if (!cell.source) return now;
  std::vector<io::Diagnostic> diagnostics;
  const Cell then = read_cell_form(*cell.source, "", diagnostics);
  return io::merge_preserving_format(now, canonical(then), *cell.source);
}

std::string to_yaml(const Cell& cell) { return io::to_yaml(cell_node(cell)); }

void save_cell(const Cell& cell, const std::filesystem::path& file) {
  const std::string text = to_yaml(cell);
  parse_cell(text, file.string() + " (not written)");  // a file that nobody can read is not worth the old one
  io::write_text(file, text);
}

kinematics::DhChain nominal_chain(const Cell& cell) { return {cell.robot.T_base_0, cell.robot.dh}; }

Pose T_base_tool(const Cell& cell, const Eigen::VectorXd& q) {
  const Pose T_base_flange = nominal_chain(cell).flange(q);
  return cell.tool ? T_base_flange * cell.tool->T_flange_tool : T_base_flange;
}

std::optional<Pose> T_flange_camera(const Cell& cell) {
  if (!cell.camera || cell.camera->mount == Mount::EyeToHand) return std::nullopt;
  if (cell.camera->T_tool_camera && cell.tool) return cell.tool->T_flange_tool * *cell.camera->T_tool_camera;
  return cell.camera->T_flange_camera;
}

std::optional<Pose> T_flange_scanner(const Cell& cell) {
  if (!cell.laser) return std::nullopt;
  if (cell.laser->T_tool_scanner && cell.tool) return cell.tool->T_flange_tool * *cell.laser->T_tool_scanner;
  return cell.laser->T_flange_scanner;
}

}  // namespace kr5::cell
