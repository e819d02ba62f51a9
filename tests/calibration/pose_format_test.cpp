#include <numbers>

#include <catch2/catch.hpp>

#include <kr5/calibration/pose_format.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

namespace pose_format_test {

using namespace kr5;
using namespace kr5::calibration;

namespace {

Eigen::MatrixXd rows_of(const std::vector<Pose>& poses, const PoseFormat& format) {
  Eigen::MatrixXd rows;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::VectorXd row = to_row(poses[i], format);
    rows.conservativeResize(static_cast<Eigen::Index>(i) + 1, row.size());
    rows.row(static_cast<Eigen::Index>(i)) = row;
  }
  return rows;
}

std::vector<Pose> some_poses(Random& random, int count = 12) {
  std::vector<Pose> poses;
  for (int i = 0; i < count; ++i) {
    Vector6 d;
    d << Eigen::Vector3d(random.normal_vector(3, 0.5)), 2.5 * random.uniform() * random.direction();
    poses.push_back(to_pose(d));
  }
  return poses;
}

std::string error_of(const Eigen::MatrixXd& rows, const PoseFormat& format) {
  try {
    to_poses(rows, format);
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}

}  // namespace

TEST_CASE("every convention reads back what it writes") {
  Random random(5);
  const std::vector<Pose> poses = some_poses(random);
  for (const auto& [rotation, r] : enum_names(RotationForm{}))
    for (const auto& [unit, u] : enum_names(LengthUnit{}))
      for (const auto& [angle, a] : enum_names(AngleUnit{}))
        for (const auto& [meaning, m] : enum_names(PoseMeaning{})) {
          const PoseFormat format{unit, rotation, angle, meaning};
          const std::vector<Pose> back = to_poses(rows_of(poses, format), format);
          CAPTURE(r, u, a, m);
          for (std::size_t i = 0; i < poses.size(); ++i) CHECK(pose_difference(poses[i], back[i]).norm() < 1e-9);
        }
}

TEST_CASE("conventions mean what they say") {
  const double half = std::numbers::sqrt2 / 2;
  const Eigen::Matrix3d about_z = exp_rotation({0, 0, std::numbers::pi / 2});
  const auto rotation = [](std::initializer_list<double> numbers, PoseFormat format) -> Eigen::Matrix3d {
    const std::vector<double> v(numbers);
    return to_poses(Eigen::Map<const Eigen::RowVectorXd>(v.data(), static_cast<Eigen::Index>(v.size())), format)[0]
        .linear();
  };
  using enum RotationForm;
  CHECK((rotation({0, 0, 0, 0, 0, half, half}, {.rotation = QuaternionXyzw}) - about_z).norm() < 1e-12);
  CHECK((rotation({0, 0, 0, half, 0, 0, half}, {.rotation = QuaternionWxyz}) - about_z).norm() < 1e-12);
  CHECK((rotation({0, 0, 0, 0, 0, 90}, {.rotation = Rpy, .angle = AngleUnit::Degree}) - about_z).norm() < 1e-12);
  CHECK((rotation({0, 0, 0, 90, 0, 0}, {.rotation = KukaAbc, .angle = AngleUnit::Degree}) - about_z).norm() < 1e-12);
  CHECK((rotation({0, 0, 0, 90, 0, 0},
                  {.rotation = KukaAbc, .angle = AngleUnit::Degree, .meaning = PoseMeaning::FlangeBase}) -
         about_z.transpose())
            .norm() < 1e-12);
}

TEST_CASE("numbers that are no pose are refused by row and with a remedy") {
  Random random(6);
  PoseFormat format;
  Eigen::MatrixXd rows = rows_of(some_poses(random), format);
  rows.row(2).tail(4) *= 1.1;
  CHECK_THAT(error_of(rows, format), Catch::Contains("pose 3") && Catch::Contains("expected 1"));
  rows(1, 0) = std::nan("");
  CHECK_THAT(error_of(rows, format), Catch::Contains("pose 2") && Catch::Contains("NaN"));
  CHECK_THAT(error_of(rows.leftCols(6), format), Catch::Contains("6 numbers") && Catch::Contains("expected 7"));
  format.rotation = RotationForm::Matrix;
  rows = rows_of(some_poses(random), format);
  rows.col(2) *= -1, rows.col(6) *= -1, rows.col(10) *= -1;
  CHECK_THAT(error_of(rows, format), Catch::Contains("reflection"));
  rows.col(2) *= -1, rows.col(6) *= -1, rows.col(10) *= -1;
  rows.col(0) *= 2;
  CHECK_THAT(error_of(rows, format), Catch::Contains("not a rotation"));
}

TEST_CASE("the numbers allow the convention they were written in, and rule out wrong units and angles") {
  Random random(7);
  const std::vector<Pose> poses = some_poses(random, 20);
  for (const auto& [rotation, name] : enum_names(RotationForm{})) {
    const PoseFormat format{LengthUnit::Millimetre, rotation,
                            rotation == RotationForm::RotationVector ? AngleUnit::Radian : AngleUnit::Degree,
                            PoseMeaning::FlangeBase};
    const Eigen::MatrixXd rows = rows_of(poses, format);
    const std::vector<PoseFormat> found = plausible_formats(rows);
    CAPTURE(name);
    bool has_truth = false;
    for (const PoseFormat& f : found) {
      CHECK(f.position == LengthUnit::Millimetre);
      if (rows.cols() == 6) CHECK(f.angle == format.angle);
      has_truth |= f.rotation == rotation && f.meaning == format.meaning;
    }
    CHECK(has_truth);
  }
  const Eigen::MatrixXd metres = rows_of(poses, {});
  CHECK_FALSE(format_objections(metres, {.position = LengthUnit::Millimetre}).empty());
}

}  // namespace pose_format_test
