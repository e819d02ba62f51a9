// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/parallel_planes.hpp>

#include <array>
#include <cmath>
#include <iomanip>
#include <numbers>
#include <sstream>

#include <Eigen/Dense>
#include <kr5/core/error.hpp>

#include "calibration/kinematics/shifted_axis.hpp"

namespace kr5::calibration {
namespace {

using Eigen::Vector3d;
using kinematics::AxisLine;

constexpr double most_out_of_parallel = 2 * std::numbers::pi / 180;  // [rad]
constexpr int axis_count = 6, axis_parameters = 4;

/// In the order of ParallelPlaneAxes.
enum AxisPlace { First, Second, Third, Fifth, Sixth, SixthUpright };
using Lines = std::array<AxisLine, axis_count>;

std::string with_digits(double value, int digits) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(digits) << value;
  return text.str();
}

/// Direction that axes have in common, in the sense of the first.
template <class... More>
Vector3d common_direction(const AxisLine& first, const More&... more) {
  Vector3d sum = first.direction;
  ((sum += more.direction.dot(first.direction) < 0 ? Vector3d(-more.direction) : more.direction), ...);
  return sum.normalized();
}

Vector3d across(const Vector3d& direction, const Vector3d& v) { return v - direction.dot(v) * direction; }

/// c_23, c_35, c_16 and c_16_upright of lines that are parallel where they should be.
Eigen::Vector4d plane_distances(const Lines& line) {
  const Vector3d elbow = common_direction(line[Second], line[Third], line[Fifth]),
                 upright = common_direction(line[First], line[Sixth], line[SixthUpright]);
  const Vector3d upper_arm = across(elbow, line[Third].point - line[Second].point),
                 forearm = across(elbow, line[Fifth].point - line[Third].point),
                 out = across(upright, line[Sixth].point - line[First].point);
  // From axis 1 towards axis 2, which the forearm may point away from.
  const double side = out.dot(line[Second].point - line[First].point) < 0 ? -1.0 : 1.0;
  const Vector3d forward = side * out.normalized();
  const double lean = forward.dot(upper_arm);
  return {upper_arm.norm(), forearm.norm(), forward.dot(out) - lean,
          forward.dot(line[SixthUpright].point - line[First].point) - lean};
}

/// Angle between two axes that should be parallel, and its standard deviation [rad].
struct Tilt {
  double angle = 0.0, sigma = 0.0;

  /// By how much a distance of the axes differs so far along them, where the angle is more than noise [m].
  double shift(double along) const { return angle > 3 * sigma ? angle * along : 0.0; }
};

Tilt tilt_of(const JointAxisResult& a, const JointAxisResult& b) {
  return {std::atan2(a.axis.direction.cross(b.axis.direction).norm(), std::abs(a.axis.direction.dot(b.axis.direction))),
          std::sqrt((a.covariance + b.covariance).bottomRightCorner<2, 2>().trace())};
}

/// How far apart along their common direction two axes were measured [m].
double apart_along(const JointAxisResult& a, const JointAxisResult& b) {
  return std::abs(common_direction(a.axis, b.axis).dot(b.axis.point - a.axis.point));
}

/// Variances that axes which are not quite parallel add to their distances [m^2].
Eigen::Vector4d tilt_variances(const ParallelPlaneAxes& axes) {
  return Eigen::Vector4d(tilt_of(axes.axis2, axes.axis3).shift(apart_along(axes.axis2, axes.axis3)),
                         tilt_of(axes.axis3, axes.axis5).shift(apart_along(axes.axis3, axes.axis5)),
                         tilt_of(axes.axis1, axes.axis6).shift(axes.wrist_distance),
                         tilt_of(axes.axis1, axes.axis6_upright).shift(axes.wrist_distance))
      .cwiseAbs2();
}

/// Why two axes are not parallel; empty when they are, within their uncertainty.
std::string parallel_objection(const JointAxisResult& a, const JointAxisResult& b, const std::string& names,
                               const std::string& remedy) {
  const Tilt tilt = tilt_of(a, b);
  if (tilt.angle < most_out_of_parallel + 3 * tilt.sigma) return {};
  return "the axes " + names + " are " + with_digits(tilt.angle * 180 / std::numbers::pi, 1) +
         " deg from parallel: " + remedy + "; ";
}

std::string joined_objection(std::string text) {
  if (!text.empty()) text.erase(text.size() - 2);
  return text;
}

/// Derivatives of a1, a2, a3 and b4 by the distances at the chosen solution.
Eigen::Matrix4d length_derivatives(double s, double difference, double root, double sign) {
  Eigen::RowVector4d by_root;
  by_root << 0.0, 2 * s / root, -difference / root, difference / root;
  Eigen::Matrix4d J;
  J.row(0) = 0.5 * (Eigen::RowVector4d(0, 0, 1, 1) - sign * by_root);
  J.row(1) << 1, 0, 0, 0;
  J.row(2) = J.row(0) - Eigen::RowVector4d(0, 0, 0, 1);
  J.row(3) = Eigen::RowVector4d(0, 0, 1, 0) - J.row(0);
  return J;
}

}  // namespace

void ParallelPlaneOptions::validate() const {
  require(!a1 || std::isfinite(*a1), "a1 must be finite [m]");
  require(min_separation >= 0 && std::isfinite(min_separation), "min_separation must not be negative [-]");
}

ParallelPlaneDistances parallel_plane_distances(const ParallelPlaneAxes& axes) {
  const std::array<const JointAxisResult*, axis_count> all = {&axes.axis1, &axes.axis2, &axes.axis3,
                                                              &axes.axis5, &axes.axis6, &axes.axis6_upright};
  static constexpr std::array<const char*, axis_count> names = {"axis1", "axis2", "axis3",
                                                                "axis5", "axis6", "axis6_upright"};
  Lines lines;
  for (int i = 0; i < axis_count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    require(all[k]->fit.usable(), std::string(names[k]) + ": was not identified (" + all[k]->fit.message + ")");
    lines[k] = all[k]->axis;
  }
  require(axes.wrist_distance >= 0 && axes.wrist_distance < 10, "wrist_distance must lie between 0 and 10 m");
  const Eigen::Vector4d c = plane_distances(lines);
  ParallelPlaneDistances out{.c_23 = c[0], .c_35 = c[1], .c_16 = c[2], .c_16_upright = c[3], .objection = {}};
  for (int i = 0; i < axis_count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    constexpr double step = 1e-6;
    Eigen::Matrix4d J;
    for (int p = 0; p < axis_parameters; ++p) {
      Lines low = lines, high = lines;
      low[k] = shifted_axis(*all[k], -step * Eigen::Vector4d::Unit(p));
      high[k] = shifted_axis(*all[k], step * Eigen::Vector4d::Unit(p));
      J.col(p) = (plane_distances(high) - plane_distances(low)) / (2 * step);
    }
    out.covariance += J * all[k]->covariance * J.transpose();
  }
  out.covariance.diagonal() += tilt_variances(axes);
  const std::string wrist = "joints 4 and 5 must stand such that axis 6 is parallel to axis 1";
  out.objection = joined_objection(
      parallel_objection(axes.axis2, axes.axis3, "2 and 3", "the length constraints are not for this arm") +
      parallel_objection(axes.axis3, axes.axis5, "3 and 5", "joint 4 must stand where they are parallel") +
      parallel_objection(axes.axis1, axes.axis6, "1 and 6", wrist) +
      parallel_objection(axes.axis1, axes.axis6_upright, "1 and 6 with the forearm upright", wrist));
  return out;
}

ParallelPlaneLengths lengths_from_parallel_planes(const ParallelPlaneDistances& distances,
                                                  const ParallelPlaneOptions& options) {
  options.validate();
  const double p = distances.c_16, q = distances.c_16_upright, s = distances.c_35;
  require(std::isfinite(p) && std::isfinite(q) && distances.covariance.allFinite(), "distances must be finite [m]");
  require(distances.c_23 > 0 && s > 0 && std::isfinite(s) && std::isfinite(distances.c_23),
          "c_23 and c_35 must be positive and finite [m]");
  ParallelPlaneLengths out;
  out.a2 = distances.c_23;
  if (!distances.objection.empty()) {
    out.fit.message = distances.objection;
    return out;
  }
  // 2 a1^2 - 2 (p + q) a1 + p^2 + q^2 - s^2 = 0; half the difference of its solutions is root / 2.
  const double difference = p - q, squared = 2 * s * s - difference * difference;
  const Eigen::RowVector4d by_squared(0.0, 4 * s, -2 * difference, 2 * difference);
  const double sigma_squared = std::sqrt(by_squared * distances.covariance * by_squared.transpose());
  if (squared < -3 * sigma_squared) {
    out.fit.message = "no arm has these distances: c_35 = " + with_digits(1e3 * s, 2) +
                      " mm is shorter than (c_16 - c_16_upright) / sqrt(2) = " +
                      with_digits(1e3 * difference / std::numbers::sqrt2, 2) +
                      " mm; did the forearm stand across axis 1 and then along it?";
    return out;
  }
  const double root = std::sqrt(std::max(squared, 0.0));
  const double low = (p + q - root) / 2, high = (p + q + root) / 2;
  // b4 and -a3 are (p - q +- root) / 2: the forearm is the longer one in the first solution when p > q.
  const bool take_low = options.a1 ? std::abs(low - *options.a1) <= std::abs(high - *options.a1) : difference > 0;
  out.a1 = take_low ? low : high, out.a1_other = take_low ? high : low;
  const double side = p < out.a1 ? -1.0 : 1.0;  // of the forearm, seen from axis 1
  out.a3 = out.a1 - q, out.b4 = side * (p - out.a1);
  // Near the double solution a1 depends on the square root of what is measured: that has no derivative there.
  Eigen::Matrix4d J = length_derivatives(s, difference, std::max(root, 1e-12), take_low ? 1.0 : -1.0);
  J.row(3) *= side;
  out.covariance = J * distances.covariance * J.transpose();
  const double sigma = std::sqrt(out.covariance(0, 0));
  out.separation = root / std::max(sigma, 1e-15);
  if (root < 1e-9 || out.separation < options.min_separation) {
    out.fit.message = "the two solutions a1 = " + with_digits(1e3 * low, 2) + " and " + with_digits(1e3 * high, 2) +
                      " mm are " + with_digits(out.separation, 1) +
                      " standard deviations apart: the offset of the elbow and the forearm are too alike to be told "
                      "apart by these distances";
    return out;
  }
  out.fit.status = FitStatus::Converged;
  out.fit.message = "a1 = " + with_digits(1e3 * out.a1, 2) + " mm; the other solution is " +
                    with_digits(1e3 * out.a1_other, 2) + " mm";
  return out;
}

std::string parallel_plane_objection(const kinematics::DhChain& arm, double tolerance) {
  require(tolerance > 0, "tolerance must be positive [m]");
  if (arm.joints.size() != 6) return "the arm has " + std::to_string(arm.joints.size()) + " joints, not six";
  std::string out;
  for (std::size_t i = 0; i < 5; ++i) {
    const kinematics::DhJoint& joint = arm.joints[i];
    const std::string names = std::to_string(i + 1) + " and " + std::to_string(i + 2);
    if (joint.type != kinematics::JointType::Revolute) out += "joint " + std::to_string(i + 1) + " does not turn; ";
    const bool parallel = std::abs(std::sin(joint.alpha)) < tolerance,
               square = std::abs(std::cos(joint.alpha)) < tolerance;
    if (i == 1 && !parallel) out += "the axes 2 and 3 are not parallel; ";
    if (i != 1 && !square) out += "the axes " + names + " are not at right angles; ";
  }
  const kinematics::DhJoint &wrist = arm.joints[3], &hand = arm.joints[4];
  if (std::hypot(wrist.a, std::hypot(hand.a, hand.b)) > tolerance)
    out += "the axes of the wrist do not meet in one point; ";
  // Along axes 2 and 3 the offsets add or cancel, as the axes point the same way or opposite ways.
  const double lateral = arm.joints[1].b + std::cos(arm.joints[1].alpha) * arm.joints[2].b;
  if (std::abs(lateral) > tolerance)
    out += "the forearm lies " + with_digits(1e3 * std::abs(lateral), 1) + " mm beside axis 1; ";
  return joined_objection(out);
}

}  // namespace kr5::calibration
