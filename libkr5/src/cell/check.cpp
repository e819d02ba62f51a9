// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/check.hpp>

#include <algorithm>
#include <set>
#include <tuple>

#include <kr5/cell/recording.hpp>
#include <kr5/core/error.hpp>

#include "cell/check_cell.hpp"
#include "cell/read_recording.hpp"

namespace kr5::cell {
namespace {

namespace fs = std::filesystem;
using io::Node;
using io::Problem;

void append(std::vector<Problem>& to, std::vector<Problem> from) {
  for (Problem& p : from) to.push_back(std::move(p));
}

void check_values(const Cell& cell, const Node& root, const std::string& file, std::vector<Problem>& problems) {
  Complaints c(file, root);
  check_physics(cell, c);
  check_units(cell, root, c);
  append(problems, c.take());
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
                 std::vector<Problem>& problems) {
  Complaints c(file, root);
  std::set<std::string> told;
  for (const Experiment& e : recording.experiments) {
    for (const auto& [part, there] : needs(e.kind, recording.cell))
      if (!there && told.insert(part).second)
        c.add(part, "what the experiment '" + e.name + "' (" + std::string(name_of(e.kind)) + ") was made with",
              "nothing");
    for (const Column& column : columns(e.kind, recording.cell.robot.joints())) {
      if (column.noise.empty() || e.data.find(column.name) < 0) continue;
      Noise::each_field(recording.cell.noise, [&](const char* name, double value, const char*) {
        if (column.noise == name && value == 0 && told.insert(column.noise).second)
          c.add("noise." + column.noise,
                "the standard deviation of column " + column.name + " of '" + e.name + "' [" + column.unit + "]");
      });
    }
  }
  append(problems, c.take());
}

void check_recording(const ReadRecording& read, const Node& root, const std::string& cell_file,
                     std::vector<Problem>& problems) {
  check_values(read.recording.cell, root, cell_file, problems);
  check_parts(read.recording, root, cell_file, problems);
  for (std::size_t i = 0; i < read.recording.experiments.size(); ++i)
    if (read.usable[i]) {
      const Experiment& e = read.recording.experiments[i];
      check_data(e, read.recording.cell, (read.recording.folder / e.file).string(), read.lines[i], problems);
    }
}

/// File by file from the top, as a person mends them.
void sort_by_place(std::vector<Problem>& problems) {
  std::stable_sort(problems.begin(), problems.end(), [](const Problem& a, const Problem& b) {
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

/// Cells and recordings below a folder.
std::vector<fs::path> search(const fs::path& folder) {
  std::vector<fs::path> found;
  std::set<fs::path> cells_of_recordings;
  for (const auto& entry : fs::recursive_directory_iterator(folder, fs::directory_options::skip_permission_denied)) {
    const fs::path& file = entry.path();
    if (!entry.is_regular_file() || (file.extension() != ".yaml" && file.extension() != ".yml")) continue;
    if (file.filename() == "recording.yaml") {
      found.push_back(file);
      cells_of_recordings.insert((file.parent_path() / value_of(file, "cell", {"cell.yaml"})).lexically_normal());
    } else if (value_of(file, "format", {"kr5-cell/1"}) == "kr5-cell/1") {
      found.push_back(file);
    }
  }
  std::erase_if(found, [&](const fs::path& file) { return cells_of_recordings.contains(file.lexically_normal()); });
  std::sort(found.begin(), found.end());
  return found;
}

void check_cell_file(const fs::path& file, std::vector<Problem>& problems) {
  std::optional<Node> root = read_document(file, problems);
  if (!root) return;
  std::vector<Problem> form;
  const Cell cell = read_cell(*root, file.string(), form);
  if (form.empty()) check_values(cell, *root, file.string(), problems);
  append(problems, std::move(form));
}

void check_recording_file(const fs::path& file, std::vector<Problem>& problems) {
  const ReadRecording read = read_recording(file.parent_path(), problems);
  if (read.cell_usable)
    check_recording(read, *read.recording.cell.source, (read.recording.folder / read.recording.cell_file).string(),
                    problems);
}

}  // namespace

std::vector<fs::path> find_documents(const fs::path& path) {
  if (!fs::exists(path)) throw IoError(path.string() + ": no such file or folder");
  return fs::is_directory(path) ? search(path) : std::vector<fs::path>{path};
}

std::vector<Problem> check(const fs::path& path) {
  std::vector<Problem> problems;
  const std::vector<fs::path> documents = find_documents(path);
  if (documents.empty())
    problems.push_back({path.string(), 0, "", "no cell and no recording",
                        "a file with format: kr5-cell/1, or a folder with a recording.yaml"});
  for (const fs::path& file : documents) {
    if (file.filename() == "recording.yaml")
      check_recording_file(file, problems);
    else
      check_cell_file(file, problems);
  }
  sort_by_place(problems);
  return problems;
}

std::vector<Problem> check(const Cell& cell) {
  std::vector<Problem> problems;
  const Node root = cell_node(cell);
  Complaints c(cell.name, root);
  check_form(cell, c);
  append(problems, c.take());
  if (problems.empty()) check_values(cell, root, cell.name, problems);
  sort_by_place(problems);
  return problems;
}

std::vector<Problem> check(const Recording& recording) {
  std::vector<Problem> problems;
  const Node root = cell_node(recording.cell);
  const std::string cell_file = (recording.folder / recording.cell_file).string();
  Complaints form(cell_file, root);
  check_form(recording.cell, form);
  append(problems, form.take());
  if (!problems.empty()) return problems;
  ReadRecording read{recording, true, {}, {}};
  for (const Experiment& e : recording.experiments) {
    const std::string file = (recording.folder / e.file).string();
    read.lines.emplace_back();
    read.usable.push_back(e.data.values.rows() > 0 && check_columns(e, recording.cell.robot.joints(), file, problems));
  }
  check_recording(read, root, cell_file, problems);
  sort_by_place(problems);
  return problems;
}

}  // namespace kr5::cell
