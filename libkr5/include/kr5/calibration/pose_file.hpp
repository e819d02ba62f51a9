// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include <Eigen/Core>

#include <kr5/calibration/pose_format.hpp>

namespace kr5::calibration {

/// Rows of numbers in a pose file: YAML or JSON (flat or nested keys such as x y z qx qy qz qw, ViSP's rows/cols/data,
/// or lists), CSV with a header, or plain text. Named values are put into the order of `rotation`.
struct PoseFile {
  Eigen::MatrixXd rows;
  std::vector<int> lines;     ///< Where each row stands.
  std::vector<double> times;  ///< From a column `t`, `time` or `stamp` [s]; else empty.
};
/// @throws IoError with file, line, field and remedy: no such columns, rows of wrong length, NaN.
PoseFile load_poses(const std::filesystem::path& file, RotationForm rotation);

}  // namespace kr5::calibration
