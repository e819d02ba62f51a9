// SPDX-License-Identifier: BSD-3-Clause
// Line scanner on the flange from profiles of a ball.  06_scanner SHARE
#include <cmath>
#include <cstdio>
#include <limits>

#include <kr5/calibration/scanner.hpp>

using namespace kr5;
using namespace kr5::calibration;

int main() {
  const Pose T_flange_scanner = to_pose((Vector6() << 0.11, 0.045, 0.34, 3.0, 0.2, -0.4).finished());
  const Eigen::Vector3d ball(0.7, 0.05, 0.2);  // in the base
  const double radius = 0.02;
  std::vector<ScannerView> views;
  for (int k = 0; k < 20; ++k) {
    // The ball in the scanner, and the arc of its section.
    const Eigen::Vector3d at(0.015 * std::sin(k), 0.008 * std::cos(2.0 * k), 0.19 + 0.015 * std::cos(k));
    const double section = std::sqrt(radius * radius - at.y() * at.y());
    LineProfile profile{Eigen::VectorXd::LinSpaced(201, -0.05, 0.05), Eigen::VectorXd(201)};
    for (int i = 0; i < 201; ++i) {
      const double inside = section * section - std::pow(profile.x[i] - at.x(), 2);
      profile.z[i] = inside > 0 ? at.z() - std::sqrt(inside) : std::numeric_limits<double>::quiet_NaN();
    }
    Pose T_base_scanner = Pose::Identity();
    T_base_scanner.linear() = exp_rotation({0.3 * std::sin(k), 3.0 + 0.3 * std::cos(3.0 * k), 0.5 * k});
    T_base_scanner.translation() = ball - T_base_scanner.linear() * at;
    views.push_back({.name = "",
                     .target = "ball",
                     .T_base_flange = T_base_scanner * T_flange_scanner.inverse(),
                     .q = {},
                     .feature = find_profile_feature(profile, ScanTargetKind::Sphere, {.radius = radius})});
  }
  const std::vector<ScanTarget> targets{
      {.name = "ball", .kind = ScanTargetKind::Sphere, .position = {}, .normal = {}, .radius = radius}};
  const ScannerResult result = calibrate_scanner(views, targets);
  const Vector6 pose = to_vector(result.T_flange_scanner);
  std::printf("position %.3f %.3f %.3f mm\n", 1e3 * pose[0], 1e3 * pose[1], 1e3 * pose[2]);
  std::printf("rotation %.4f %.4f %.4f rad\n", pose[3], pose[4], pose[5]);
  const Eigen::Vector3d found = *result.targets[0].position;
  std::printf("ball %.3f %.3f %.3f mm\n", 1e3 * found.x(), 1e3 * found.y(), 1e3 * found.z());
}
