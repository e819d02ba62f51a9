#include <numbers>

#include <catch2/catch.hpp>

#include <kr5/calibration/pose_columns.hpp>

namespace pose_columns_test {

using namespace kr5;
using namespace kr5::calibration;
using enum RotationForm;

namespace {

Eigen::MatrixXd two_rows(const PoseFormat& format) {
  Vector6 near, far;
  near << 0.5, 0.1, 0.3, 2.9, -0.4, 0.7;
  far << 0.7, -0.2, 0.4, -2.6, 0.3, -1.2;
  Eigen::MatrixXd rows(2, row_length(format.rotation));
  rows << to_row(from_xyzrpy(near), format).transpose(), to_row(from_xyzrpy(far), format).transpose();
  return rows;
}

}  // namespace

TEST_CASE("columns of poses are found by their names in any order and case") {
  const std::vector<std::string> columns{"t", "QW", "qx", "qy", "qz", "Z", "y", "x"};
  CHECK(find_rotation_form(columns) == QuaternionXyzw);
  CHECK(find_pose_columns(columns, QuaternionXyzw) == std::vector<int>{7, 6, 5, 2, 3, 4, 1});
  CHECK(find_pose_columns(columns, QuaternionWxyz) == std::vector<int>{7, 6, 5, 1, 2, 3, 4});
  CHECK(find_pose_columns(columns, KukaAbc) == std::vector<int>{7, 6, 5, -1, -1, -1});
  CHECK(find_rotation_form({"x", "y", "z", "rx", "ry", "rz"}) == RotationVector);
  CHECK(find_rotation_form({"x", "y", "z", "roll", "pitch", "yaw"}) == Rpy);
  CHECK(find_rotation_form({"X", "Y", "Z", "A", "B", "C"}) == KukaAbc);
  CHECK_FALSE(find_rotation_form({"x", "y", "z", "qx", "qy", "qz"}));
}

TEST_CASE("a prefix tells two poses of a row apart") {
  const std::vector<std::string> columns{"robot_x", "robot_y", "robot_z", "robot_a", "robot_b", "robot_c", "camera_x"};
  CHECK(find_rotation_form(columns, "robot_") == KukaAbc);
  CHECK_FALSE(find_rotation_form(columns, "camera_"));
  CHECK_FALSE(find_rotation_form(columns));
  CHECK(find_pose_columns(columns, KukaAbc, "robot_") == std::vector<int>{0, 1, 2, 3, 4, 5});
}

TEST_CASE("rows without names have the form of their length, where one alone has it") {
  CHECK(rotation_form_of_length(7) == QuaternionXyzw);
  CHECK(rotation_form_of_length(12) == Matrix);
  CHECK(rotation_form_of_length(16) == Matrix);
  CHECK_FALSE(rotation_form_of_length(6));
  CHECK_FALSE(rotation_form_of_length(4));
}

TEST_CASE("units are found that the numbers do not contradict, and stated ones are kept") {
  for (const RotationForm form : {RotationVector, Rpy, KukaAbc, QuaternionXyzw})
    for (const LengthUnit length : {LengthUnit::Metre, LengthUnit::Millimetre})
      for (const AngleUnit angle : {AngleUnit::Radian, AngleUnit::Degree}) {
        if (form == QuaternionXyzw && angle == AngleUnit::Degree) continue;
        const Eigen::MatrixXd rows = two_rows({length, form, angle});
        const auto found = find_pose_units(rows, form);
        CAPTURE(name_of(form), name_of(length), name_of(angle));
        REQUIRE(found);
        CHECK(found->position == length);
        if (form != QuaternionXyzw) CHECK(found->angle == angle);
      }
  const Eigen::MatrixXd millimetres = two_rows({LengthUnit::Millimetre, Rpy, AngleUnit::Degree});
  CHECK_FALSE(find_pose_units(millimetres, Rpy, LengthUnit::Metre));
  CHECK_FALSE(find_pose_units(millimetres, Rpy, {}, AngleUnit::Radian));
  CHECK(find_pose_units(millimetres, Rpy, {}, AngleUnit::Degree)->position == LengthUnit::Millimetre);
}

}  // namespace pose_columns_test
