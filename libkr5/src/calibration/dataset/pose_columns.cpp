// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/pose_columns.hpp>

#include <algorithm>
#include <cctype>

namespace kr5::calibration {
namespace {

std::string small_letters(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

int find_column(const std::vector<std::string>& columns, const std::string& prefix,
                const std::vector<std::string>& spellings) {
  for (const std::string& spelling : spellings)
    for (std::size_t c = 0; c < columns.size(); ++c)
      if (small_letters(columns[c]) == small_letters(prefix) + spelling) return static_cast<int>(c);
  return -1;
}

/// What a unit may be: the stated one, or the usual one before the other.
template <class Unit>
std::vector<Unit> choices(std::optional<Unit> stated, Unit usual, Unit other) {
  if (stated) return {*stated};
  return {usual, other};
}

}  // namespace

std::vector<std::vector<std::string>> pose_column_names(RotationForm rotation) {
  using enum RotationForm;
  if (rotation == Matrix) return {};
  std::vector<std::vector<std::string>> out = {{"x", "tx", "px"}, {"y", "ty", "py"}, {"z", "tz", "pz"}};
  const auto add = [&](std::initializer_list<std::vector<std::string>> more) { out.insert(out.end(), more); };
  if (rotation == QuaternionXyzw) add({{"qx"}, {"qy"}, {"qz"}, {"qw"}});
  if (rotation == QuaternionWxyz) add({{"qw"}, {"qx"}, {"qy"}, {"qz"}});
  if (rotation == RotationVector) add({{"rx", "tux"}, {"ry", "tuy"}, {"rz", "tuz"}});
  if (rotation == Rpy) add({{"roll", "rx"}, {"pitch", "ry"}, {"yaw", "rz"}});
  if (rotation == KukaAbc) add({{"a"}, {"b"}, {"c"}});
  return out;
}

std::vector<int> find_pose_columns(const std::vector<std::string>& columns, RotationForm rotation,
                                   const std::string& prefix) {
  std::vector<int> out;
  for (const auto& spellings : pose_column_names(rotation)) out.push_back(find_column(columns, prefix, spellings));
  return out;
}

std::optional<RotationForm> find_rotation_form(const std::vector<std::string>& columns, const std::string& prefix) {
  using enum RotationForm;
  for (const RotationForm form : {QuaternionXyzw, RotationVector, Rpy, KukaAbc}) {
    const std::vector<int> found = find_pose_columns(columns, form, prefix);
    if (std::all_of(found.begin() + 3, found.end(), [](int c) { return c >= 0; })) return form;
  }
  return {};
}

std::optional<RotationForm> rotation_form_of_length(int numbers) {
  if (numbers == row_length(RotationForm::QuaternionXyzw)) return RotationForm::QuaternionXyzw;
  if (numbers == row_length(RotationForm::Matrix) || numbers == 16) return RotationForm::Matrix;
  return {};
}

PoseFormat usual_format(RotationForm rotation) {
  if (rotation == RotationForm::KukaAbc) return {LengthUnit::Millimetre, rotation, AngleUnit::Degree};
  return {LengthUnit::Metre, rotation, AngleUnit::Radian};
}

std::optional<PoseFormat> find_pose_units(const Eigen::MatrixXd& rows, RotationForm rotation,
                                          std::optional<LengthUnit> position, std::optional<AngleUnit> angle) {
  const PoseFormat usual = usual_format(rotation);
  const bool metres = usual.position == LengthUnit::Metre, radians = usual.angle == AngleUnit::Radian;
  for (const LengthUnit p : choices(position, usual.position, metres ? LengthUnit::Millimetre : LengthUnit::Metre))
    for (const AngleUnit a : choices(angle, usual.angle, radians ? AngleUnit::Degree : AngleUnit::Radian)) {
      const PoseFormat format{p, rotation, a};
      if (format_objections(rows, format).empty()) return format;
    }
  return {};
}

}  // namespace kr5::calibration
