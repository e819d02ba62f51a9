#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>

#include <kr5/cell/recording.hpp>

namespace kr5::test {

/// A folder that is gone when the test is over.
struct Folder {
  std::filesystem::path path;
  explicit Folder(const std::string& name) : path(std::filesystem::temp_directory_path() / ("kr5_cell_" + name)) {
    std::filesystem::remove_all(path);
    std::filesystem::create_directories(path);
  }
  ~Folder() { std::filesystem::remove_all(path); }
};

/// Value of a column in row `i` of a small recording of the sample cell that nobody could object to.
inline double sample_value(const cell::Cell& cell, const std::string& name, cell::Kind kind, int i) {
  static const Eigen::VectorXd q0 = (Eigen::VectorXd(6) << 0.2, 0.1, -2.6, 0.1, 0.2, 0.3).finished();
  const auto q = [&](int row) {
    const int moved = kind == cell::Kind::Motion ? std::max(0, row - 8) : row;  // a motion begins at rest
    return Eigen::VectorXd(q0 + Eigen::VectorXd::Constant(6, 0.01 * moved));
  };
  if (name == "t") return 0.012 * i;
  if (name == "pose" || name == "view" || name == "line") return i;
  if (name == "marker") return i % 35;
  if (name == "corner") return i % 4;
  if (name == "sphere") return i % 2;
  if (name.starts_with("qc")) return q(i)[name[2] - '1'];
  if (name[0] == 'q' && std::isdigit(static_cast<unsigned char>(name[1]))) return q(i)[name[1] - '1'] + 1e-5;
  if (name[0] == 'q') return 0.5;  // a quaternion
  if (kind == cell::Kind::Poses) {
    const Pose T = cell::T_base_tool(cell, q(i));
    return T.translation()[name[0] - 'x'];
  }
  if (name == "u" || name == "v") return 100.0 + i;
  if (kind == cell::Kind::Scan && name == "z") return 0.18;
  if (name == "speed") return 0.01;
  if (name == "tilt") return 0.13;
  if (name == "alpha") return 0.1 * i;
  if (name == "fc") return 10.0;
  if (name == "run") return 0;
  return 0.001 * i;
}

/// Two files of motion, one of every other kind, 20 rows each.
inline cell::Recording sample_recording() {
  constexpr int rows = 20;
  cell::Recording recording;
  recording.cell = cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml");
  for (const std::string name :
       {"motion-1", "motion-2", "poses-1", "views-1", "scan-1", "step-1", "press-1", "profile-1"}) {
    cell::Experiment e;
    e.name = name;
    e.file = name + ".csv";
    e.split = name.ends_with("2") ? cell::Split::Check : cell::Split::Fit;
    for (const auto& [kind, text] : cell::enum_names(cell::Kind{}))
      if (name.starts_with(text)) e.kind = kind;
    for (const cell::Column& column : cell::columns(e.kind, 6))
      if (column.group != "torques") e.data.columns.push_back(column.name);
    e.data.values.resize(rows, static_cast<Eigen::Index>(e.data.columns.size()));
    for (int i = 0; i < rows; ++i)
      for (std::size_t c = 0; c < e.data.columns.size(); ++c)
        e.data.values(i, static_cast<Eigen::Index>(c)) = sample_value(recording.cell, e.data.columns[c], e.kind, i);
    if (name == "motion-2") e.data.values.col(e.data.find("i1")).array() += 0.5;  // measured anew
    recording.experiments.push_back(std::move(e));
  }
  return recording;
}

}  // namespace kr5::test
