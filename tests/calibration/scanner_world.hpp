#pragma once

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <kr5/calibration/scanner.hpp>
#include <kr5/calibration/scanner_points.hpp>
#include <kr5/cell/cell.hpp>
#include <kr5/core/random.hpp>

/// @file
/// A scanner on an arm before a tip, spheres and a plane, written without what the library has of scanners.

namespace kr5::test {

using namespace calibration;

/// T_L of Hayat et al. 2022, after eq. 2.8, as printed (four digits) [-, mm].
inline Eigen::Matrix4d printed_scanner_pose() {
  Eigen::Matrix4d T;
  T << -0.8232, -0.5674, -0.0202, 114.024, -0.5665, 0.8233, -0.0370, 45.605, 0.0377, -0.0190, -0.9991, 340.280, 0, 0, 0,
      1;
  return T;
}

inline Pose book_scanner_pose() {
  Pose T = Pose::Identity();
  T.linear() = nearest_rotation(printed_scanner_pose().topLeftCorner<3, 3>());
  T.translation() = 1e-3 * printed_scanner_pose().topRightCorner<3, 1>();
  return T;
}

struct ScannerWorldOptions {
  unsigned seed = 1;
  int tips = 30, spheres = 0, planes = 0;  // profiles
  double robot = 0.0;                      // error of the flange's position per axis [m]
  double noise = 0.0;                      // of a range [m]
  double tilt = 0.3;                       // of the poses [rad]
  double arm_length = 0.0, arm_angle = 0.0;
  bool known_tip = false, same_place = false;  // of every profile
  double radius = 0.02;
};

/// True poses, and views whose features were found in synthesised profiles.
struct ScannerWorld {
  Pose T_flange_scanner = book_scanner_pose();
  kinematics::DhChain nominal, arm;
  Eigen::Vector3d tip{0.72, 0.05, 0.12}, sphere{0.68, -0.04, 0.14}, plane_point{0.7, 0.0, 0.1};
  Eigen::Vector3d normal = Eigen::Vector3d(0.05, -0.08, 1.0).normalized();
  std::vector<ScanTarget> targets;
  std::vector<ScannerView> views;
  std::vector<LineProfile> profiles;
  std::vector<Pose> true_flange;
};

/// Ranges from rays along Z of the scanner: a cone with its tip up on a plane z = height of the base, or a sphere on
/// it, or the world's plane alone.
inline LineProfile synthesise_profile(const ScannerWorld& w, const Pose& T_base_scanner, ScanTargetKind kind,
                                      double radius, double noise, Random& random, int points = 161) {
  LineProfile out;
  out.x = Eigen::VectorXd::LinSpaced(points, -0.05, 0.05);
  out.z = Eigen::VectorXd::Constant(points, std::numeric_limits<double>::quiet_NaN());
  const Eigen::Vector3d along = T_base_scanner.linear().col(2);
  for (int k = 0; k < points; ++k) {
    const Eigen::Vector3d origin = T_base_scanner * Eigen::Vector3d(out.x[k], 0, 0);
    double range = w.normal.dot(w.plane_point - origin) / w.normal.dot(along);
    if (kind == ScanTargetKind::Sphere) {
      const Eigen::Vector3d off = origin - w.sphere;
      const double b = off.dot(along), c = off.squaredNorm() - radius * radius;
      if (b * b > c) range = std::min(range, -b - std::sqrt(b * b - c));
    } else if (kind == ScanTargetKind::Tip) {
      // A cone of 0.5 rad half angle about the normal: (p - tip) . normal = -cot(0.5) |across|
      const double slope = std::pow(1 / std::tan(0.5), 2);
      const Eigen::Vector3d off = origin - w.tip;
      const double oh = off.dot(w.normal), ah = along.dot(w.normal);
      const double a = ah * ah - slope * (1 - ah * ah), b = oh * ah - slope * (off.dot(along) - oh * ah),
                   c = oh * oh - slope * (off.squaredNorm() - oh * oh);
      const double inside = b * b - a * c;
      if (inside > 0)
        for (const double s : {(-b - std::sqrt(inside)) / a, (-b + std::sqrt(inside)) / a})
          if (s > 0 && oh + s * ah < 0) range = std::min(range, s);
    }
    if (range > 0.12 && range < 0.28) out.z[k] = range + random.normal(noise);
  }
  return out;
}

/// A flange pose whose profile passes at `at` [x, y, z of the scanner] through a point of the base, looking down.
inline Pose flange_over(const ScannerWorld& w, const Eigen::Vector3d& point, const Eigen::Vector3d& at, double tilt,
                        Random& random) {
  Pose T = Pose::Identity();
  const Eigen::Matrix3d down = Eigen::Vector3d(1, -1, -1).asDiagonal();
  T.linear() = exp_rotation(Eigen::Vector3d(0, 0, random.uniform(-2, 2) * std::min(1.0, 5 * tilt))) * down *
               exp_rotation(Eigen::Vector3d(random.uniform(-tilt, tilt), random.uniform(-tilt, tilt), 0));
  T.translation() = point - T.linear() * at;
  return T * w.T_flange_scanner.inverse();
}

inline ScannerWorld make_scanner_world(const ScannerWorldOptions& o) {
  Random random(o.seed);
  ScannerWorld w;
  const int count[] = {o.tips, o.spheres, o.planes};
  const char* const names[] = {"pin", "ball", "table"};
  for (int kind = 0; kind < 3; ++kind) {
    if (!count[kind]) continue;
    ScanTarget& target = w.targets.emplace_back();
    target.name = names[kind], target.kind = static_cast<ScanTargetKind>(kind);
    if (target.kind == ScanTargetKind::Sphere) target.radius = o.radius;
    if (target.kind == ScanTargetKind::Tip && o.known_tip) target.position = w.tip;
    for (int i = 0; i < count[kind]; ++i) {
      const Eigen::Vector3d& point = kind == 0 ? w.tip : kind == 1 ? w.sphere : w.plane_point;
      const double beside = kind == 1   ? random.uniform(-0.5, 0.5) * o.radius
                            : kind == 2 ? random.uniform(-.03, .03)
                                        : 0;
      Eigen::Vector3d at(random.uniform(-0.02, 0.02), beside, random.uniform(0.17, 0.21));
      if (o.same_place) at = Eigen::Vector3d(0.0, 0.0, 0.19);
      const Pose T = flange_over(w, point, at, o.tilt, random);
      const LineProfile profile = synthesise_profile(w, T * w.T_flange_scanner, target.kind, o.radius, o.noise, random);
      const ProfileFeature feature = find_profile_feature(profile, target.kind, {.radius = target.radius});
      if (!feature.fit.usable()) continue;
      ScannerView& view = w.views.emplace_back();
      view.name = target.name + std::to_string(i), view.target = target.name;
      view.feature = feature;
      view.T_base_flange = T;
      view.T_base_flange.translation() += random.normal_vector(3, o.robot);
      w.profiles.push_back(profile);
      w.true_flange.push_back(T);
    }
  }
  return w;
}

/// Position and orientation of a result relative to the truth [m, rad].
inline Vector6 scanner_error(const ScannerWorld& w, const ScannerResult& r) {
  return pose_difference(w.T_flange_scanner, r.T_flange_scanner);
}

}  // namespace kr5::test
