#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>

#include <kr5/robot/loopback.hpp>
#include <kr5/rsi/emulated_controller.hpp>

namespace kr5::test {

inline constexpr double deg = M_PI / 180;

/// An arm of six joints.
inline robot::SensorModel six_joints() {
  robot::SensorModel out;
  out.arm.joints = {{.b = 0.4, .a = 0.18, .alpha = M_PI_2}, {.a = 0.6},        {.a = 0.12, .alpha = M_PI_2},
                    {.b = 0.62, .alpha = -M_PI_2},          {.alpha = M_PI_2}, {.b = 0.115}};
  out.T_flange_tool.translation().z() = 0.1;
  return out;
}

inline robot::JointVector bent_joints() {
  robot::JointVector out(6);
  out << 10 * deg, 20 * deg, -30 * deg, 40 * deg, 50 * deg, 60 * deg;
  return out;
}

/// A robot that is in each reading where the last command said.
inline robot::LoopbackRobot prompt_robot(double cycle = 0.004, const robot::SensorModel& model = six_joints()) {
  robot::LoopbackRobot out({.cycle = cycle, .delay = cycle}, model);
  if (!model.arm.joints.empty()) out.place(bent_joints());
  return out;
}

/// An answer of a computer, written from the description of the interface, not with our codec: one element of six
/// values and the output bits.
inline std::string plain_sen(const std::string& ipoc, const std::array<double, 6>& values,
                             const std::string& element = "AKorr", const std::string& outputs = "<DiO>1</DiO>") {
  const bool tool = element == "RKorr";
  std::string out = "<Sen Type=\"ImFree\"><" + element;
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::array<char, 64> text;
    const std::string name = tool ? std::string(1, "XYZABC"[i]) : "A" + std::to_string(i + 1);
    std::snprintf(text.data(), text.size(), " %s=\"%.6f\"", name.c_str(), values[i]);
    out += text.data();
  }
  return out + " />" + outputs + "<IPOC>" + ipoc + "</IPOC></Sen>";
}

}  // namespace kr5::test
