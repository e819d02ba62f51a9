#pragma once

#include <cmath>
#include <functional>
#include <sstream>
#include <string>

#include <kr5/cell/cell.hpp>

/// @file
/// Cells with arms of any number of joints.

namespace kr5::test {

/// An arm by the types of its joints, r for revolute and p for prismatic: a SCARA-like one when it holds a slide, else
/// one whose axes cross at right angles in turn.
struct ArmCase {
  std::string joints;

  int size() const { return static_cast<int>(joints.size()); }
  bool slides(int i) const { return joints[static_cast<std::size_t>(i)] == 'p'; }
  bool planar() const { return joints.find('p') != std::string::npos; }
};

inline std::string list(int n, const std::function<double(int)>& value) {
  std::ostringstream out;
  out << "[";
  for (int i = 0; i < n; ++i) out << (i ? ", " : "") << value(i);
  out << "]";
  return out.str();
}

/// Lighter towards the tip, as arms are.
inline cell::Cell arm_cell(const ArmCase& arm) {
  const int n = arm.size();
  const double length = 1.6 / n;
  std::ostringstream out;
  out << "format: kr5-cell/1\nname: arm of " << n << " joints\nrobot:\n  T_B_0: [0, 0, 0.8, 0, 0, 0]\n  dh:\n";
  for (int i = 0; i < n; ++i) {
    const double twist = arm.planar() ? (i == 1 ? M_PI : 0.0) : (i % 2 ? M_PI_2 : -M_PI_2);
    out << "  - {type: " << (arm.slides(i) ? "prismatic" : "revolute")
        << ", theta_offset: 0, a: " << (arm.slides(i) ? 0.0 : (arm.planar() || i % 2 ? length : 0.02))
        << ", b: " << (i % 2 ? 0.03 : 0.5 * length) << ", alpha: " << twist << "}\n";
  }
  out << "  links:\n";
  for (int i = 0; i < n; ++i) {
    const double m = 12.0 * std::exp(-2.0 * i / n), l = length;
    out << "  - {mass: " << m << ", com: [" << -0.4 * l << ", 0.01, 0.02], inertia: [" << 0.02 * m << ", " << 0.03 * m
        << ", " << 0.025 * m << ", 0, 0, 0]}\n";
  }
  out << "drives:\n  structure:\n";
  for (int i = 0; i < n; ++i)
    out << "  - "
        << list(n, [&](int k) { return k == i ? (arm.slides(i) ? 600.0 : 100.0) : (k == i - 1 ? -1.0 : 0.0); }) << "\n";
  const auto falling = [&](double first) { return list(n, [=](int i) { return first * std::exp(-1.5 * i / n); }); };
  out << "  rotor_inertia: " << falling(4e-4) << "\n  torque_constant: " << falling(0.6)
      << "\n  friction: {coulomb: " << falling(20.0) << ", viscous: " << falling(25.0) << "}\n"
      << "servo: {cycle: 0.008, joint: {natural_frequency: 40, damping_ratio: 0.9, delay: 0.008}, tool: "
         "{natural_frequency: 5, damping_ratio: 0.8, delay: 0.016}}\n"
      << "tool: {T_F_E: [0, 0, 0.15, 0, 0, 0], T_F_S: [0, 0, 0.03, 0, 0, 0], mass: 1.2, com: [0.01, 0, 0.06], "
         "inertia: [0.004, 0.004, 0.002, 0, 0, 0]}\n"
      << "camera: {width: 1280, height: 1024, fx: 1400, fy: 1400, cx: 640, cy: 512, T_F_C: [0.05, 0, 0, 0, 0, 0]}\n"
      << "board: {rows: 2, cols: 3, marker: 0.03, gap: 0.01, T_B_W: [0.3, 0.1, 0, 0, 0, 0]}\n"
      << "laser: {T_F_L: [0, 0.05, 0, 0, 0, 0], target: {sphere: [0.5, 0, 0], radius: 0.05, plane: -0.1}}\n"
      << "contact: {stiffness: 20000, damping: 50, friction: 0.2}\n"
      << "noise: {current: 0.03, position: 2e-5, pose_position: 5e-5, pose_rotation: 8e-5, pixel: 0.1, force: 0.15, "
         "torque: 0.008, depth: 2e-5, laser: 4e-5}\n";
  return cell::parse_cell(out.str(), "arm of " + arm.joints);
}

inline double joint_value(const ArmCase& arm, int joint, double t) {
  const double reach = arm.slides(joint) ? 0.04 : 0.25, rate = 2.0 + 0.3 * joint;
  return 0.1 * (joint % 3) + reach * (1.0 - std::cos(rate * t));
}

}  // namespace kr5::test
