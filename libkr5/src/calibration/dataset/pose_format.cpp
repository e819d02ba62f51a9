// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/pose_format.hpp>

#include <cmath>
#include <numbers>

#include <kr5/core/error.hpp>

namespace kr5::calibration {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double form_tolerance = 0.02;  // controllers print as few as two digits

double metres(LengthUnit unit) {
  return unit == LengthUnit::Metre ? 1.0 : unit == LengthUnit::Centimetre ? 0.01 : 0.001;
}

double radians(AngleUnit unit) { return unit == AngleUnit::Radian ? 1.0 : pi / 180.0; }

bool has_angles(RotationForm form) {
  return form == RotationForm::RotationVector || form == RotationForm::Rpy || form == RotationForm::KukaAbc;
}

bool fits_length(Eigen::Index length, RotationForm form) {
  return length == row_length(form) || (form == RotationForm::Matrix && length == 16);
}

std::string in_row(Eigen::Index row) { return "pose " + std::to_string(row + 1) + ": "; }

Eigen::Matrix3d quaternion(const Eigen::Vector4d& xyzw, Eigen::Index row) {
  const Eigen::Quaterniond q(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
  require(std::abs(q.norm() - 1.0) < form_tolerance, in_row(row) + "found a quaternion of length " +
                                                         std::to_string(q.norm()) +
                                                         ", expected 1; are these angles or a rotation vector?");
  return q.normalized().toRotationMatrix();
}

Pose from_matrix(const Eigen::VectorXd& v, Eigen::Index row) {
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> m(v.data());
  const Eigen::Matrix3d R = m.leftCols<3>();
  require(R.determinant() > 0, in_row(row) +
                                   "found a reflection (determinant below 0), expected a rotation; is the matrix "
                                   "left-handed, or is the sign of a column missing?");
  require(is_rotation(R, form_tolerance), in_row(row) +
                                              "found a matrix that is not a rotation (columns not orthogonal or not of "
                                              "length 1), expected a rotation matrix, written row by row");
  require(v.size() == 12 || (v.tail<4>() - Eigen::Vector4d(0, 0, 0, 1)).norm() < 1e-6,
          in_row(row) + "found a last row other than 0 0 0 1; write the matrix row by row");
  Pose T = Pose::Identity();
  T.linear() = nearest_rotation(R);
  T.translation() = m.col(3);
  return T;
}

Pose from_row(const Eigen::VectorXd& v, const PoseFormat& format, Eigen::Index row) {
  Pose T = Pose::Identity();
  if (format.rotation == RotationForm::Matrix) {
    T = from_matrix(v, row);
  } else {
    T.translation() = v.head<3>();
    const double unit = radians(format.angle);
    switch (format.rotation) {
      case RotationForm::QuaternionXyzw:
        T.linear() = quaternion(v.tail<4>(), row);
        break;
      case RotationForm::QuaternionWxyz:
        T.linear() = quaternion({v[4], v[5], v[6], v[3]}, row);
        break;
      case RotationForm::RotationVector:
        T.linear() = exp_rotation(unit * v.tail<3>());
        break;
      case RotationForm::Rpy:
        T.linear() = from_xyzrpy((Vector6() << 0, 0, 0, unit * v.tail<3>()).finished()).linear();
        break;
      default:  // A turns about z, C about x
        T.linear() = from_xyzrpy((Vector6() << 0, 0, 0, unit * v.tail<3>().reverse()).finished()).linear();
    }
  }
  T.translation() *= metres(format.position);
  return format.meaning == PoseMeaning::BaseFlange ? T : T.inverse();
}

Eigen::VectorXd rotation_numbers(const Eigen::Matrix3d& R, const PoseFormat& format) {
  const Eigen::Quaterniond q(R);
  Pose T = Pose::Identity();
  T.linear() = R;
  const Eigen::Vector3d rpy = to_xyzrpy(T).tail<3>();
  switch (format.rotation) {
    case RotationForm::QuaternionXyzw:
      return q.coeffs();
    case RotationForm::QuaternionWxyz:
      return Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
    case RotationForm::RotationVector:
      return log_rotation(R) / radians(format.angle);
    case RotationForm::Rpy:
      return rpy / radians(format.angle);
    default:
      return rpy.reverse() / radians(format.angle);
  }
}

/// Positions as stated, whatever the row holds.
Eigen::MatrixX3d positions(const Eigen::MatrixXd& rows, RotationForm form) {
  if (form != RotationForm::Matrix) return rows.leftCols(3);
  Eigen::MatrixX3d p(rows.rows(), 3);
  p << rows.col(3), rows.col(7), rows.col(11);
  return p;
}

void check_angles(const Eigen::MatrixXd& rows, const PoseFormat& format, std::vector<std::string>& out) {
  const Eigen::MatrixXd angles = radians(format.angle) * rows.rightCols(3);
  const double largest = angles.cwiseAbs().maxCoeff();
  const char* unit = format.angle == AngleUnit::Radian ? " rad" : " deg";
  const std::string value = std::to_string(rows.rightCols(3).cwiseAbs().maxCoeff()) + unit;
  if (largest > 2.02 * pi) out.push_back("an angle of " + value + " is more than a full turn; is it in degrees?");
  if (format.angle == AngleUnit::Degree && rows.rightCols(3).cwiseAbs().maxCoeff() < 1.01 * pi)
    out.push_back("no angle is larger than " + value + "; are the angles in radians?");
  if (format.rotation == RotationForm::RotationVector && angles.rowwise().norm().maxCoeff() > 2.02 * pi)
    out.push_back("a rotation vector is longer than a full turn; are these roll, pitch and yaw?");
  if (format.rotation != RotationForm::RotationVector && angles.col(1).cwiseAbs().maxCoeff() > 1.01 * pi / 2)
    out.push_back(
        "the middle angle exceeds a quarter turn, which controllers do not print; is this a rotation vector?");
}

}  // namespace

int row_length(RotationForm rotation) {
  switch (rotation) {
    case RotationForm::QuaternionXyzw:
    case RotationForm::QuaternionWxyz:
      return 7;
    case RotationForm::Matrix:
      return 12;
    default:
      return 6;
  }
}

std::vector<Pose> to_poses(const Eigen::MatrixXd& rows, const PoseFormat& format) {
  const std::string form(name_of(format.rotation));
  require(fits_length(rows.cols(), format.rotation),
          "found " + std::to_string(rows.cols()) + " numbers per pose, expected " +
              std::to_string(row_length(format.rotation)) + (format.rotation == RotationForm::Matrix ? " or 16" : "") +
              " for position and " + form + "; set 'rotation' of the convention");
  std::vector<Pose> poses;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    require(rows.row(i).allFinite(), in_row(i) + "found NaN or infinity, expected numbers; remove this view");
    poses.push_back(from_row(rows.row(i), format, i));
  }
  return poses;
}

Eigen::VectorXd to_row(const Pose& T_base_flange, const PoseFormat& format) {
  Pose T = format.meaning == PoseMeaning::BaseFlange ? T_base_flange : T_base_flange.inverse();
  T.translation() /= metres(format.position);
  if (format.rotation == RotationForm::Matrix) {
    Eigen::VectorXd row(16);
    Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(row.data()) = T.matrix();
    return row;
  }
  Eigen::VectorXd row(row_length(format.rotation));
  row << T.translation(), rotation_numbers(T.linear(), format);
  return row;
}

std::vector<std::string> format_objections(const Eigen::MatrixXd& rows, const PoseFormat& format) {
  std::vector<std::string> out;
  try {
    to_poses(rows, format);
  } catch (const InvalidArgument& e) {
    return {e.what()};
  }
  if (rows.rows() == 0) return out;
  // No arm on a stand reaches 20 m, and none is calibrated inside a thimble.
  const Eigen::MatrixX3d p = metres(format.position) * positions(rows, format.rotation);
  const double farthest = p.rowwise().norm().maxCoeff();
  if (farthest > 20.0) out.push_back("a position " + std::to_string(farthest) + " m away; is it in millimetres?");
  if (farthest < 0.02)
    out.push_back("no position is farther away than " + std::to_string(1e3 * farthest) +
                  " mm; are the positions in metres?");
  if (has_angles(format.rotation)) check_angles(rows, format, out);
  return out;
}

std::vector<PoseFormat> plausible_formats(const Eigen::MatrixXd& rows) {
  std::vector<PoseFormat> out;
  for (const PoseMeaning meaning : {PoseMeaning::BaseFlange, PoseMeaning::FlangeBase})
    for (const auto& [rotation, name] : enum_names(RotationForm{}))
      for (const LengthUnit position : {LengthUnit::Metre, LengthUnit::Millimetre})
        for (const AngleUnit angle : {AngleUnit::Radian, AngleUnit::Degree}) {
          if (angle == AngleUnit::Degree && !has_angles(rotation)) continue;
          const PoseFormat format{position, rotation, angle, meaning};
          if (format_objections(rows, format).empty()) out.push_back(format);
        }
  return out;
}

}  // namespace kr5::calibration
