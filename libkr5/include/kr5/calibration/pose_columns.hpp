// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/calibration/pose_format.hpp>

/// @file
/// Which columns of a table hold poses, by their names; and in which units.

namespace kr5::calibration {

/// Names of the numbers of a row of this form in their order, each with its spellings in small letters, such as
/// {x, tx, px}. A matrix has none: it is told by its 12 or 16 numbers.
std::vector<std::vector<std::string>> pose_column_names(RotationForm rotation);

/// Positions of the columns that make the rows of this form, -1 where there is none. Letters may be small or large;
/// `prefix` stands before each name, as in `robot_x`.
std::vector<int> find_pose_columns(const std::vector<std::string>& columns, RotationForm rotation,
                                   const std::string& prefix = "");

/// The form whose rotation the columns name; empty where they name none.
std::optional<RotationForm> find_rotation_form(const std::vector<std::string>& columns, const std::string& prefix = "");

/// The form that rows of so many numbers have; empty where several have: six numbers may be any angles.
std::optional<RotationForm> rotation_form_of_length(int numbers);

/// Units in which controllers print this form: millimetres and degrees of KukaAbc, else metres and radians.
PoseFormat usual_format(RotationForm rotation);

/// The format with the units that the rows do not contradict (`format_objections`), the usual ones first. A stated
/// unit is kept. Empty where every choice is contradicted.
std::optional<PoseFormat> find_pose_units(const Eigen::MatrixXd& rows, RotationForm rotation,
                                          std::optional<LengthUnit> position = {}, std::optional<AngleUnit> angle = {});

}  // namespace kr5::calibration
