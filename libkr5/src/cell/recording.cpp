// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/recording.hpp>

#include <algorithm>
#include <set>
#include <system_error>

#include <kr5/core/error.hpp>
#include <kr5/io/fields.hpp>

#include "cell/check_cell.hpp"
#include "cell/read_recording.hpp"

namespace kr5::cell {
namespace {

using io::Node;
using io::Problem;

constexpr const char* recording_format = "kr5-recording/1";

/// recording.yaml itself.
struct Index {
  std::string format;
  std::string cell;
  std::vector<Experiment> experiments;
  static constexpr std::array<std::string_view, 3> required = {"format", "cell", "experiments"};
  static void each_field(auto& self, auto&& visit) {
    visit("format", self.format, "Format of the file.");
    visit("cell", self.cell, "File of the cell.");
    visit("experiments", self.experiments, "What was recorded.");
  }
};

bool stays_inside(const std::string& file) {
  const std::filesystem::path path(file);
  return !file.empty() && path.is_relative() && std::find(path.begin(), path.end(), "..") == path.end();
}

void check_index(const Index& index, const Node& root, const std::string& file, std::vector<Problem>& problems) {
  Complaints c(file, root);
  c.expect(index.format == recording_format, "format", recording_format);
  c.expect(!index.experiments.empty(), "experiments", "at least one experiment");
  std::set<std::string> names, files;
  for (std::size_t i = 0; i < index.experiments.size(); ++i) {
    const Experiment& e = index.experiments[i];
    const std::string field = item("experiments", static_cast<Eigen::Index>(i));
    c.expect(names.insert(e.name).second, field + ".name", "every name once", "'" + e.name + "' a second time");
    c.expect(files.insert(e.file).second, field + ".file", "every file once: rows that are used to fit may not judge",
             "'" + e.file + "' a second time");
    c.expect(stays_inside(e.file), field + ".file", "a file in the folder of the recording");
  }
  for (Problem& p : c.take()) problems.push_back(std::move(p));
}

/// Text of a file, or nothing and a problem.
std::optional<std::string> read_file(const std::filesystem::path& file, std::vector<Problem>& problems) {
  try {
    return io::read_text(file);
  } catch (const IoError&) {
    problems.push_back({file.string(), 0, "",
                        std::filesystem::exists(file) ? "no file that can be read" : "no such file",
                        "a file of a cell or recording; is the name right?"});
    return std::nullopt;
  }
}

void read_cell_of(ReadRecording& out, std::vector<Problem>& problems) {
  const auto file = out.recording.folder / out.recording.cell_file;
  const auto root = read_document(file, problems);
  if (!root) return;
  const std::size_t before = problems.size();
  out.recording.cell = read_cell(*root, file.string(), problems);
  out.cell_usable = problems.size() == before;
}

void read_experiments(ReadRecording& out, std::vector<Problem>& problems) {
  for (Experiment& e : out.recording.experiments) {
    const auto file = out.recording.folder / e.file;
    out.lines.emplace_back();
    out.usable.push_back(false);
    const auto text = read_file(file, problems);
    if (!text) continue;
    io::ParsedCsv parsed = io::examine_csv(*text, file.string());
    problems.insert(problems.end(), parsed.problems.begin(), parsed.problems.end());
    e.data = std::move(parsed.table);
    out.lines.back() = std::move(parsed.lines);
    if (out.cell_usable && e.data.values.rows() > 0)
      out.usable.back() = check_columns(e, out.recording.cell.robot.joints(), file.string(), problems);
  }
}

}  // namespace

const Experiment& Recording::experiment(const std::string& name) const {
  std::string all;
  for (const Experiment& e : experiments) {
    if (e.name == name) return e;
    all += (all.empty() ? "" : ", ") + e.name;
  }
  throw InvalidArgument("no experiment '" + name + "'; there are " + all);
}

std::optional<Node> read_document(const std::filesystem::path& file, std::vector<Problem>& problems) {
  const auto text = read_file(file, problems);
  if (!text) return std::nullopt;
  try {
    return io::parse_yaml(*text, file.string());
  } catch (const IoError& e) {
    // The text starts with the file, which a problem names itself.
    problems.push_back(
        {file.string(), 0, "", std::string(e.what()).substr(file.string().size() + 1), "a YAML document"});
    return std::nullopt;
  }
}

ReadRecording read_recording(const std::filesystem::path& folder, std::vector<Problem>& problems) {
  ReadRecording out;
  out.recording.folder = folder;
  const auto file = folder / "recording.yaml";
  const auto root = read_document(file, problems);
  if (!root) return out;
  Index index;
  io::Reader reader(file.string());
  reader.read(*root, "", index);
  problems.insert(problems.end(), reader.problems().begin(), reader.problems().end());
  if (!reader.problems().empty()) return out;
  const std::size_t before = problems.size();
  check_index(index, *root, file.string(), problems);
  if (problems.size() > before) return out;
  out.recording.cell_file = index.cell;
  out.recording.experiments = std::move(index.experiments);
  read_cell_of(out, problems);
  read_experiments(out, problems);
  return out;
}

Recording load_recording(const std::filesystem::path& folder) {
  std::vector<Problem> problems;
  ReadRecording read = read_recording(folder, problems);
  io::throw_problems(problems);
  return std::move(read.recording);
}

void save_recording(const Recording& recording, const std::filesystem::path& folder) {
  std::set<std::string> files = {"recording.yaml"};
  require(stays_inside(recording.cell_file) && files.insert(recording.cell_file).second,
          "cell_file: found '" + recording.cell_file + "', expected a file in the folder of the recording");
  for (const Experiment& e : recording.experiments)
    require(stays_inside(e.file) && files.insert(e.file).second,
            "experiment '" + e.name + "': the file '" + e.file + "' lies outside the folder, or is another's");
  for (const std::string& file : files) {
    std::error_code error;
    std::filesystem::create_directories((folder / file).parent_path(), error);
    if (error) throw IoError((folder / file).string() + ": cannot be written: " + error.message());
  }
  const Index index{recording_format, recording.cell_file, recording.experiments};
  save_cell(recording.cell, folder / recording.cell_file);
  for (const Experiment& e : recording.experiments) io::save_csv(e.data, folder / e.file);
  io::write_text(folder / "recording.yaml", io::to_yaml(io::to_node(index)));
}

}  // namespace kr5::cell
