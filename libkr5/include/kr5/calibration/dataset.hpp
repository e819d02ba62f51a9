// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <kr5/calibration/hand_eye.hpp>
#include <kr5/calibration/pose_format.hpp>

/// @file
/// `dataset.yaml`: which images and robot poses belong together, and how they are meant.
/// @code{.yaml}
/// format: kr5-dataset/1
/// images: images/*.png            # a pattern, or a list of files
/// poses: poses/*.yaml             # one file an image (pattern or list), or one file of rows: poses.csv
/// pairing: number                 # number in the file name, or order (files sorted as people do: 2 before 10)
/// convention: {position: m, rotation: quaternion_xyzw, angle: rad, meaning: T_base_flange}
/// mount: eye_in_hand
/// target: chessboard:6x9:0.0236   # short form, or a map of its fields
/// camera: camera.yaml             # or its values; left away: calibrated from the same images
/// @endcode

namespace kr5::calibration {

/// How files are brought together.
enum class Pairing { Number, Order };

constexpr auto enum_names(Pairing) { return names<Pairing>({{Pairing::Number, "number"}, {Pairing::Order, "order"}}); }

/// A data set with its poses read; images, target and camera are for others to read.
struct Dataset {
  std::vector<std::string> images;        ///< Files, each beside its pose.
  Eigen::MatrixXd rows;                   ///< Robot poses as written, one a row.
  std::vector<std::string> pose_sources;  ///< File (and line) of each pose.
  PoseFormat convention;
  Pairing pairing = Pairing::Number;
  Mount mount = Mount::EyeInHand;
  std::string target;         ///< Short form, or JSON of its fields; empty when absent.
  std::string camera;         ///< File, or JSON of its values; empty when absent.
  std::vector<double> times;  ///< [s]
  std::optional<Pose> T_flange_tool;

  /// Poses T_base_flange, the tool offset taken off.
  std::vector<Pose> poses() const;

  static void each_field(auto& self, auto&& visit) {
    visit("images", self.images, "Image files, one per pose.");
    visit("rows", self.rows, "Robot poses as written, one a row, in the order of the convention.");
    visit("pose_sources", self.pose_sources, "File (and line) of each pose.");
    visit("convention", self.convention, "Convention of the rows.");
    visit("pairing", self.pairing, "Pairing of images and poses: number | order.");
    visit("mount", self.mount, "Mount of the camera.");
    visit("target", self.target, "Short form of the target, or JSON of its fields; empty when absent.");
    visit("camera", self.camera, "Camera file, or JSON of its values; empty when absent.");
    visit("times", self.times, "Time stamps of the views [s]; empty when absent.");
    visit("T_flange_tool", self.T_flange_tool, "Pose of the tool on the flange, when the poses are those of a tool.");
  }
};

/// Reads the description `file`, and the poses it names below `folder` (empty: where the file lies).
/// @throws IoError with file, line, field and remedy: unknown or mistyped keys, no image or pose matches, counts that
///         differ, a pose without image or the other way round, rows of wrong length, NaN.
Dataset load_dataset(const std::filesystem::path& file, const std::filesystem::path& folder = {});

/// The same where no image is looked at, such as touches of one point: only `poses` and `convention` are wanted.
/// @throws IoError as above.
Dataset load_pose_set(const std::filesystem::path& file, const std::filesystem::path& folder = {});

/// Files below `folder` that match `pattern` (* and ? in the file name), sorted as people do: 2 before 10.
std::vector<std::filesystem::path> matching_files(const std::filesystem::path& folder, const std::string& pattern);

/// Last number in the name of a file, without its ending; -1 when there is none.
long long number_in_name(const std::filesystem::path& file);

}  // namespace kr5::calibration
