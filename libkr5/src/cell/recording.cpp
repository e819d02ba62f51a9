// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/recording.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <system_error>

#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/io/fields.hpp>

#include "cell/cell_document.hpp"
#include "cell/check/columns.hpp"
#include "cell/check/data.hpp"
#include "cell/check/diagnostic_collector.hpp"
#include "cell/recording_document.hpp"

namespace kr5::cell {
namespace {

using io::Diagnostic;
using io::Node;

constexpr const char* recording_format = "kr5-recording/1";

/// An experiment as recording.yaml lists it.
struct IndexEntry {
  std::string name;
  Kind kind = Kind::Motion;
  std::string file;
  Split split = Split::Fit;
  std::optional<JointReference> joint_reference;
  std::optional<double> lead_in;  ///< [s]
  std::optional<Eigen::VectorXd> speed_noise;

  Experiment experiment() const {
    return {name, kind,
            file, split,
            {},   joint_reference.value_or(JointReference::Commanded),
            {},   speed_noise.value_or(Eigen::VectorXd())};
  }

  static constexpr auto required = Experiment::required;
  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the experiment.");
    visit("kind", self.kind, "Kind.");
    visit("file", self.file, "CSV file.");
    visit("split", self.split, "Use of the data.");
    visit("joint_reference", self.joint_reference, "Values in qc; absent: commanded.");
    visit("lead_in", self.lead_in,
          "Time at the beginning that is simulated and not compared, because the motion does not begin at rest [s].");
    visit("speed_noise", self.speed_noise,
          "Standard deviation of the speeds that measured positions give, a joint each; absent: exact [rad/s or m/s].");
  }
};

/// recording.yaml itself.
struct RecordingFile {
  std::string format;
  std::string cell;
  std::vector<IndexEntry> experiments;
  static constexpr std::array<std::string_view, 3> required = {"format", "cell", "experiments"};
  static void each_field(auto& self, auto&& visit) {
    visit("format", self.format, "Format of the file.");
    visit("cell", self.cell, "File of the cell.");
    visit("experiments", self.experiments, "What was recorded.");
  }
};

/// Of the rows that are simulated and not compared [s].
double lead_in_duration(const Experiment& e) {
  return e.lead_in.values.rows() == 0 ? 0.0 : e.data.column("t")[0] - e.lead_in.column("t")[0];
}

bool stays_inside(const std::string& file) {
  const std::filesystem::path path(file);
  return !file.empty() && path.is_relative() && std::find(path.begin(), path.end(), "..") == path.end();
}

void check_index(const RecordingFile& index, const Node& root, const std::string& file,
                 std::vector<Diagnostic>& diagnostics) {
  DiagnosticCollector c(file, root);
  c.expect(index.format == recording_format, "format", recording_format);
  c.expect(!index.experiments.empty(), "experiments", "at least one experiment");
  std::set<std::string> names, files;
  for (std::size_t i = 0; i < index.experiments.size(); ++i) {
    const IndexEntry& e = index.experiments[i];
    const std::string field = item("experiments", static_cast<Eigen::Index>(i));
    c.expect(names.insert(e.name).second, field + ".name", "every name once", "'" + e.name + "' a second time");
    c.expect(files.insert(std::filesystem::path(e.file).lexically_normal().string()).second, field + ".file",
             "every file once; rows used to fit must not be used to check", "'" + e.file + "' a second time");
    c.expect(stays_inside(e.file), field + ".file", "a file in the folder of the recording");
    c.expect(e.lead_in.value_or(0.0) >= 0, field + ".lead_in", "a time, not negative [s]");
    const Eigen::VectorXd noise = e.speed_noise.value_or(Eigen::VectorXd());
    c.expect(noise.allFinite() && (noise.array() >= 0).all(), field + ".speed_noise",
             "a standard deviation a joint, not negative [rad/s or m/s]");
  }
  for (Diagnostic& p : c.take()) diagnostics.push_back(std::move(p));
}

/// Text of a file, or nothing and a problem.
std::optional<std::string> read_file(const std::filesystem::path& file, std::vector<Diagnostic>& diagnostics) {
  try {
    return io::read_text(file);
  } catch (const IoError&) {
    std::error_code error;
    const bool there = std::filesystem::status(file, error).type() != std::filesystem::file_type::not_found;
    diagnostics.push_back({file.string(), 0, "", there ? "no file that can be read" : "no such file",
                           "a file of a cell or recording; is the name right?"});
    return std::nullopt;
  }
}

void read_cell_of(ReadRecording& out, std::vector<Diagnostic>& diagnostics) {
  const auto file = out.recording.folder / out.recording.cell_file;
  const auto root = read_document(file, diagnostics);
  if (!root) return;
  const std::size_t before = diagnostics.size();
  out.recording.cell = read_cell(*root, file.string(), diagnostics);
  out.cell_usable = diagnostics.size() == before;
}

/// Puts the first rows aside.
void take_lead_in(Experiment& e, double duration, const std::string& file, std::vector<Diagnostic>& diagnostics) {
  if (duration <= 0) return;
  const int t = e.data.find("t");
  const double length = t < 0 ? 0.0 : e.data.values(e.data.values.rows() - 1, t) - e.data.values(0, t);
  if (!(duration <= length)) {
    diagnostics.push_back({file, 0, "lead_in", io::Node::make_scalar(duration).scalar + " s for '" + e.name + "'",
                           "a time within the " + io::Node::make_scalar(length).scalar + " s of its file"});
    return;
  }
  e = split_lead_in(e, duration);
}

void read_experiments(ReadRecording& out, const std::vector<double>& lead_in, std::vector<Diagnostic>& diagnostics) {
  for (std::size_t i = 0; i < out.recording.experiments.size(); ++i) {
    Experiment& e = out.recording.experiments[i];
    const auto file = out.recording.folder / e.file;
    out.lines.emplace_back();
    out.usable.push_back(false);
    const auto text = read_file(file, diagnostics);
    if (!text) continue;
    io::ParsedCsv parsed = io::try_parse_csv(*text, file.string());
    diagnostics.insert(diagnostics.end(), parsed.diagnostics.begin(), parsed.diagnostics.end());
    e.data = std::move(parsed.table);
    out.lines.back() = std::move(parsed.lines);
    if (out.cell_usable && e.data.values.rows() > 0)
      out.usable.back() = check_columns(e, out.recording.cell.robot.joints(), file.string(), diagnostics);
    if (out.usable.back()) take_lead_in(e, lead_in[i], file.string(), diagnostics);
  }
}

InitialSpeed speed_of_parabola(const Eigen::VectorXd& t, const Eigen::VectorXd& q) {
  const double length = t[t.size() - 1] - t[0];
  if (!(length > 0)) return {};
  const Eigen::VectorXd at = (t.array() - t[0]) / length;
  Eigen::MatrixXd A(t.size(), 3);
  A << Eigen::VectorXd::Ones(t.size()), at, at.cwiseAbs2();
  const Eigen::Matrix3d normal = A.transpose() * A;
  const Eigen::Vector3d x = normal.ldlt().solve(A.transpose() * q);
  // From rest, the way grows faster than a parabola, whose slope at the first row then points back: no speed.
  const bool onward = x[1] * (q[q.size() - 1] - q[0]) > 0;
  return {onward ? x[1] / length : 0.0, std::sqrt(normal.inverse()(1, 1)) / length};
}

}  // namespace

Experiment with_lead_in(const Experiment& experiment) {
  Experiment out = experiment;
  if (experiment.lead_in.values.rows() == 0) return out;
  out.lead_in = {};
  const Eigen::Index rows = experiment.lead_in.values.rows();
  out.data.values.resize(rows + experiment.data.values.rows(), experiment.data.values.cols());
  for (std::size_t k = 0; k < experiment.data.columns.size(); ++k)
    out.data.values.col(static_cast<Eigen::Index>(k)).head(rows) =
        experiment.lead_in.column(experiment.data.columns[k]);
  out.data.values.bottomRows(experiment.data.values.rows()) = experiment.data.values;
  return out;
}

Experiment split_lead_in(const Experiment& experiment, double duration) {
  Experiment out = with_lead_in(experiment);
  if (duration == 0) return out;
  const Eigen::VectorXd t = out.data.column("t");
  Eigen::Index first = 0;
  while (first < t.size() && t[first] - t[0] < duration) ++first;
  require(first < t.size(), "experiment '" + experiment.name + "': no row is left after its lead-in");
  out.lead_in = {out.data.columns, out.data.values.topRows(first)};
  out.data.values = Eigen::MatrixXd(out.data.values.bottomRows(t.size() - first));
  return out;
}

InitialSpeed initial_speed(const Eigen::VectorXd& t, const Eigen::VectorXd& q) {
  require(t.size() == q.size(), "initial_speed: t and q must have the same number of rows");
  constexpr double part = 0.1, sure = 2.5e-3;  // [s]; standard deviation [rad/s or m/s]
  constexpr Eigen::Index fewest = 4, usual = 8;
  if (t.size() < fewest) return {};
  const double noise = kr5::reading_noise(q);
  // As few rows as the noise allows: a servo soon follows a command that jumps, from rest.
  InitialSpeed out = speed_of_parabola(t.head(fewest), q.head(fewest));
  for (Eigen::Index rows = fewest + 1; rows <= t.size() && out.noise_gain * noise > sure; ++rows) {
    if (rows > usual && t[rows - 1] - t[0] > part) break;
    out = speed_of_parabola(t.head(rows), q.head(rows));
  }
  return out;
}

const Experiment& Recording::experiment(const std::string& name) const {
  std::string all;
  for (const Experiment& e : experiments) {
    if (e.name == name) return e;
    all += (all.empty() ? "" : ", ") + e.name;
  }
  throw InvalidArgument("no experiment '" + name + "'; there are " + all);
}

std::optional<Node> read_document(const std::filesystem::path& file, std::vector<Diagnostic>& diagnostics) {
  const auto text = read_file(file, diagnostics);
  if (!text) return std::nullopt;
  try {
    return io::parse_yaml(*text, file.string());
  } catch (const IoError& e) {
    // The text starts with the file, which a problem names itself.
    diagnostics.push_back(
        {file.string(), 0, "", std::string(e.what()).substr(file.string().size() + 1), "a YAML document"});
    return std::nullopt;
  }
}

ReadRecording read_recording(const std::filesystem::path& folder, std::vector<Diagnostic>& diagnostics) {
  ReadRecording out;
  out.recording.folder = folder;
  const auto file = folder / "recording.yaml";
  const auto root = read_document(file, diagnostics);
  if (!root) return out;
  RecordingFile index;
  io::Reader reader(file.string());
  reader.read(*root, "", index);
  diagnostics.insert(diagnostics.end(), reader.diagnostics().begin(), reader.diagnostics().end());
  if (!reader.diagnostics().empty()) return out;
  const std::size_t before = diagnostics.size();
  check_index(index, *root, file.string(), diagnostics);
  if (diagnostics.size() > before) return out;
  out.recording.cell_file = index.cell;
  std::vector<double> lead_in;
  for (const IndexEntry& entry : index.experiments) {
    out.recording.experiments.push_back(entry.experiment());
    lead_in.push_back(entry.lead_in.value_or(0.0));
  }
  read_cell_of(out, diagnostics);
  read_experiments(out, lead_in, diagnostics);
  return out;
}

Recording load_recording(const std::filesystem::path& folder) {
  std::error_code error;  // of links that lead nowhere, which are told below
  if (std::filesystem::is_regular_file(folder, error))
    throw IoError(folder.string() +
                  ": is a file, expected the folder of a recording; kr5 gap diagnose takes logs with --model, and its "
                  "--write-recording makes a recording of them");
  std::vector<Diagnostic> diagnostics;
  ReadRecording read = read_recording(folder, diagnostics);
  if (read.cell_usable)
    check_recording(read, *read.recording.cell.source, (folder / read.recording.cell_file).string(), diagnostics);
  io::throw_diagnostics(diagnostics);
  return std::move(read.recording);
}

void save_recording(const Recording& recording, const std::filesystem::path& folder) {
  std::set<std::string> files = {"recording.yaml"};
  require(stays_inside(recording.cell_file) && files.insert(recording.cell_file).second,
          "cell_file: found '" + recording.cell_file + "', expected a file in the folder of the recording");
  for (const Experiment& e : recording.experiments)
    require(stays_inside(e.file) && files.insert(e.file).second,
            "experiment '" + e.name + "': the file '" + e.file +
                "' lies outside the folder, or belongs to another experiment");
  for (const std::string& file : files) {
    std::error_code error;
    std::filesystem::create_directories((folder / file).parent_path(), error);
    if (error) throw IoError((folder / file).string() + ": cannot be written: " + error.message());
  }
  RecordingFile index{recording_format, recording.cell_file, {}};
  save_cell(recording.cell, folder / recording.cell_file);
  for (const Experiment& e : recording.experiments) {
    IndexEntry& entry = index.experiments.emplace_back(IndexEntry{e.name, e.kind, e.file, e.split, {}, {}, {}});
    if (e.joint_reference != JointReference::Commanded) entry.joint_reference = e.joint_reference;
    if (e.lead_in.values.rows() > 0) entry.lead_in = lead_in_duration(e);
    if (e.speed_noise.size() > 0) entry.speed_noise = e.speed_noise;
    io::save_csv(with_lead_in(e).data, folder / e.file);
  }
  Node root = io::to_node(index);
  for (Node& entry : root["experiments"].items)
    std::erase_if(entry.entries, [](const auto& field) { return field.second.kind == Node::Kind::Null; });
  io::write_text(folder / "recording.yaml", io::to_yaml(root));
}

}  // namespace kr5::cell
