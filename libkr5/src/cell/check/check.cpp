// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/check.hpp>

#include <algorithm>
#include <set>
#include <system_error>
#include <tuple>

#include <kr5/cell/recording.hpp>
#include <kr5/core/error.hpp>

#include "cell/cell_document.hpp"
#include "cell/check/columns.hpp"
#include "cell/check/data.hpp"
#include "cell/check/form.hpp"
#include "cell/check/units.hpp"
#include "cell/check/values.hpp"
#include "cell/recording_document.hpp"

namespace kr5::cell {
namespace {

namespace fs = std::filesystem;
using io::Diagnostic;
using io::Node;

void append(std::vector<Diagnostic>& to, std::vector<Diagnostic> from) {
  for (Diagnostic& p : from) to.push_back(std::move(p));
}

void append_unit_warnings(const Cell& cell, const Node& root, const std::string& file,
                          std::vector<Diagnostic>& diagnostics) {
  DiagnosticCollector c(file, root, io::Severity::Warning);
  check_units(cell, root, c);
  append(diagnostics, c.take());
}

/// Parts of the cell without which a kind of experiment means nothing.
std::vector<std::pair<std::string, bool>> needs(Kind kind, const Cell& cell) {
  const bool tool_servo = cell.servo && cell.servo->tool;
  switch (kind) {
    case Kind::Motion:
      return {};
    case Kind::Poses:
      return {};
    case Kind::Views:
      return {{"camera", cell.camera.has_value()}, {"board", cell.board || !cell.targets.empty()}};
    case Kind::Scan:
      return {{"laser.target", cell.laser && cell.laser->target}};
    case Kind::Step:
      return {{"servo.tool", tool_servo}};
    case Kind::Press:
      return {{"servo.tool", tool_servo}, {"contact", cell.contact.has_value()}};
    case Kind::Profile:
      return {{"contact", cell.contact.has_value()}, {"peg", cell.peg.has_value()}, {"tube", cell.tube.has_value()}};
  }
  return {};
}

/// Whether the cell has what the recording measured.
void check_parts(const Recording& recording, const Node& root, const std::string& file,
                 std::vector<Diagnostic>& diagnostics) {
  DiagnosticCollector errors(file, root), warnings(file, root, io::Severity::Warning);
  std::set<std::string> reported;
  for (const Experiment& e : recording.experiments) {
    for (const auto& [part, there] : needs(e.kind, recording.cell))
      if (!there && reported.insert(part).second)
        errors.add(part, "what the experiment '" + e.name + "' (" + std::string(name_of(e.kind)) + ") was made with",
                   "nothing");
    for (const Column& column : columns(e.kind, recording.cell.robot.joints())) {
      if (column.noise.empty() || e.data.find(column.name) < 0) continue;
      if (recording.cell.noise.of(column.noise, column.joint) == 0 && reported.insert(column.noise).second)
        warnings.add("noise." + column.noise, "the standard deviation of column " + column.name + " of '" + e.name +
                                                  "' [" + column.unit + "]; without it the column is not compared");
    }
  }
  append(diagnostics, errors.take());
  append(diagnostics, warnings.take());
}

/// Rows that are used to fit may not judge, whatever their file is called.
void check_repeated_data(const Recording& recording, std::vector<Diagnostic>& diagnostics) {
  const std::vector<Experiment>& all = recording.experiments;
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (all[i].kind == all[k].kind && all[i].data.columns == all[k].data.columns &&
          all[i].data.values.rows() == all[k].data.values.rows() && all[i].data.values == all[k].data.values)
        diagnostics.push_back({(recording.folder / all[i].file).string(), 0, "",
                               "the rows of '" + all[k].name + "' again", "every experiment once"});
}

}  // namespace

void check_recording(const ReadRecording& read, const Node& root, const std::string& cell_file,
                     std::vector<Diagnostic>& diagnostics) {
  append_unit_warnings(read.recording.cell, root, cell_file, diagnostics);
  check_parts(read.recording, root, cell_file, diagnostics);
  for (std::size_t i = 0; i < read.recording.experiments.size(); ++i)
    if (read.usable[i]) {
      const Experiment& e = read.recording.experiments[i];
      check_data(e, read.recording.cell, (read.recording.folder / e.file).string(), read.lines[i], diagnostics);
    }
  check_repeated_data(read.recording, diagnostics);
}

namespace {

/// Whether sizes and parts of a cell fit each other, so that it can be computed with.
bool has_form(const Cell& cell) {
  const Node nothing;
  DiagnosticCollector form("", nothing);
  check_form(cell, form);
  return form.take().empty();
}

/// File by file from the top, as a person mends them.
void sort_by_place(std::vector<Diagnostic>& diagnostics) {
  std::stable_sort(diagnostics.begin(), diagnostics.end(), [](const Diagnostic& a, const Diagnostic& b) {
    return std::tie(a.file, a.line) < std::tie(b.file, b.line);
  });
}

/// Text of a key of a YAML file; when it cannot be had, the first of `guesses` that stands anywhere in the file.
std::string value_of(const fs::path& file, const char* key, const std::vector<std::string>& guesses) {
  const std::string text = io::read_text(file);
  try {
    const Node root = io::parse_yaml(text, file.string());
    if (const Node* value = root.find(key)) return value->scalar;
  } catch (const IoError&) {
    for (const std::string& guess : guesses)
      if (text.find(guess) != std::string::npos) return guess;
  }
  return "";
}

/// Cells and recordings below a folder. What cannot be looked at, such as a loop of links, is passed over.
std::vector<fs::path> search(const fs::path& folder) {
  std::vector<fs::path> found;
  std::set<fs::path> cells_of_recordings;
  std::error_code error;
  fs::recursive_directory_iterator at(folder, fs::directory_options::skip_permission_denied, error);
  for (; !error && at != fs::recursive_directory_iterator(); at.increment(error)) {
    const fs::path file = at->path();
    std::error_code unreadable;
    if (!at->is_regular_file(unreadable) || (file.extension() != ".yaml" && file.extension() != ".yml")) continue;
    if (file.filename() == "recording.yaml") {
      found.push_back(file);
      cells_of_recordings.insert((file.parent_path() / value_of(file, "cell", {"cell.yaml"})).lexically_normal());
    } else if (value_of(file, "format", {"kr5-cell/1"}) == "kr5-cell/1") {
      found.push_back(file);
    }
  }
  if (error) throw IoError(folder.string() + ": cannot be searched: " + error.message());
  std::erase_if(found, [&](const fs::path& file) { return cells_of_recordings.contains(file.lexically_normal()); });
  std::sort(found.begin(), found.end());
  return found;
}

void check_cell_file(const fs::path& file, std::vector<Diagnostic>& diagnostics) {
  const std::optional<Node> root = read_document(file, diagnostics);
  if (!root) return;
  const Cell cell = read_cell(*root, file.string(), diagnostics);
  if (cell.source) append_unit_warnings(cell, *root, file.string(), diagnostics);
}

void check_recording_file(const fs::path& file, std::vector<Diagnostic>& diagnostics) {
  const ReadRecording read = read_recording(file.parent_path(), diagnostics);
  if (read.cell_usable)
    check_recording(read, *read.recording.cell.source, (read.recording.folder / read.recording.cell_file).string(),
                    diagnostics);
}

}  // namespace

std::vector<fs::path> find_documents(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::none) throw IoError(path.string() + ": cannot be read: " + error.message());
  if (!fs::exists(status)) throw IoError(path.string() + ": no such file or folder");
  return fs::is_directory(status) ? search(path) : std::vector<fs::path>{path};
}

std::vector<Diagnostic> check(const fs::path& path) {
  std::vector<Diagnostic> diagnostics;
  const std::vector<fs::path> documents = find_documents(path);
  if (documents.empty())
    diagnostics.push_back({path.string(), 0, "", "no cell and no recording",
                           "a file with format: kr5-cell/1, or a folder with a recording.yaml"});
  for (const fs::path& file : documents) {
    if (file.filename() == "recording.yaml")
      check_recording_file(file, diagnostics);
    else
      check_cell_file(file, diagnostics);
  }
  sort_by_place(diagnostics);
  return diagnostics;
}

std::vector<Diagnostic> check(const Cell& cell) {
  const Node root = cell_node(cell);
  std::vector<Diagnostic> diagnostics = cell_errors(cell, root, cell.name);
  if (has_form(cell)) append_unit_warnings(cell, root, cell.name, diagnostics);
  sort_by_place(diagnostics);
  return diagnostics;
}

std::vector<Diagnostic> check(const Recording& recording) {
  const Node root = cell_node(recording.cell);
  const std::string cell_file = (recording.folder / recording.cell_file).string();
  std::vector<Diagnostic> diagnostics = cell_errors(recording.cell, root, cell_file);
  if (!has_form(recording.cell)) return diagnostics;
  ReadRecording read{recording, true, {}, {}};
  for (const Experiment& e : recording.experiments) {
    const std::string file = (recording.folder / e.file).string();
    read.lines.emplace_back();
    read.usable.push_back(e.data.values.rows() > 0 &&
                          check_columns(e, recording.cell.robot.joints(), file, diagnostics));
  }
  check_recording(read, root, cell_file, diagnostics);
  sort_by_place(diagnostics);
  return diagnostics;
}

}  // namespace kr5::cell
