// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// How a robot writes its poses as rows of numbers, and which ways of reading them the numbers allow.

namespace kr5::calibration {

enum class LengthUnit { Metre, Centimetre, Millimetre };

constexpr auto enum_names(LengthUnit) {
  return names<LengthUnit>({{LengthUnit::Metre, "m"}, {LengthUnit::Centimetre, "cm"}, {LengthUnit::Millimetre, "mm"}});
}

enum class AngleUnit { Radian, Degree };

constexpr auto enum_names(AngleUnit) {
  return names<AngleUnit>({{AngleUnit::Radian, "rad"}, {AngleUnit::Degree, "deg"}});
}

/// What follows the position x y z in a row.
enum class RotationForm {
  QuaternionXyzw,  ///< qx qy qz qw
  QuaternionWxyz,  ///< qw qx qy qz
  RotationVector,  ///< Axis times angle.
  Rpy,             ///< roll pitch yaw, R = Rz(yaw) Ry(pitch) Rx(roll).
  KukaAbc,         ///< A B C, R = Rz(A) Ry(B) Rx(C).
  Matrix,          ///< The row holds a 3x4 or 4x4 matrix, row by row; position is its last column.
};

constexpr auto enum_names(RotationForm) {
  return names<RotationForm>({{RotationForm::QuaternionXyzw, "quaternion_xyzw"},
                              {RotationForm::QuaternionWxyz, "quaternion_wxyz"},
                              {RotationForm::RotationVector, "rotation_vector"},
                              {RotationForm::Rpy, "rpy"},
                              {RotationForm::KukaAbc, "kuka_abc"},
                              {RotationForm::Matrix, "matrix"}});
}

enum class PoseMeaning {
  BaseFlange,  ///< T_base_flange: takes flange coordinates to base coordinates.
  FlangeBase,  ///< Its inverse.
};

constexpr auto enum_names(PoseMeaning) {
  return names<PoseMeaning>({{PoseMeaning::BaseFlange, "T_base_flange"}, {PoseMeaning::FlangeBase, "T_flange_base"}});
}

/// The convention of pose rows.
struct PoseFormat {
  LengthUnit position = LengthUnit::Metre;
  RotationForm rotation = RotationForm::QuaternionXyzw;
  AngleUnit angle = AngleUnit::Radian;
  PoseMeaning meaning = PoseMeaning::BaseFlange;

  bool operator==(const PoseFormat&) const = default;

  static void each_field(auto& self, auto&& visit) {
    visit("position", self.position, "Unit of the positions: m | cm | mm.");
    visit("rotation", self.rotation,
          "Form of the rotation: quaternion_xyzw | quaternion_wxyz | rotation_vector | rpy | kuka_abc | matrix (3x4 or "
          "4x4, row by row).");
    visit("angle", self.angle, "Unit of angles: rad | deg; of no effect for quaternions and matrices.");
    visit("meaning", self.meaning,
          "Meaning: T_base_flange (pose of the flange in the base) | T_flange_base (its inverse).");
  }
};

/// Numbers in a row of this form; a matrix row has 12 or 16.
int row_length(RotationForm rotation);

/// Poses T_base_flange from rows of numbers (n x 6, 7, 12 or 16). Quaternions and matrices are made exact.
/// @throws InvalidArgument naming the row (from 1) for a wrong row length, NaN, a quaternion more than 2 % off unit
///         length, a matrix that is no proper rotation to 2 %.
std::vector<Pose> to_poses(const Eigen::MatrixXd& rows, const PoseFormat& format);

/// The row that `to_poses` reads back as T_base_flange; matrices as 4x4.
Eigen::VectorXd to_row(const Pose& T_base_flange, const PoseFormat& format);

/// What speaks against reading the rows like this, in words; empty when nothing does. Only the numbers themselves are
/// looked at: the order of a quaternion and an inversion show only beside the images.
std::vector<std::string> format_objections(const Eigen::MatrixXd& rows, const PoseFormat& format);

/// Every convention that the poses do not contradict, T_base_flange before T_flange_base, usual ones first.
std::vector<PoseFormat> plausible_formats(const Eigen::MatrixXd& rows);

}  // namespace kr5::calibration
