// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/log_note.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "joint_columns.hpp"

namespace kr5::arm_log {

namespace {

std::string digits(double value, int significant) {
  char out[40];
  std::snprintf(out, sizeof out, "%.*g", significant, value);
  return out;
}

std::string joined(const std::vector<std::string>& parts) {
  std::string out;
  for (const std::string& part : parts) out += (out.empty() ? "" : ", ") + part;
  return out;
}

bool all_same(const std::vector<std::string>& units) {
  return std::all_of(units.begin(), units.end(), [&](const std::string& unit) { return unit == units.front(); });
}

/// Values with their unit once in brackets before them, or behind each where units differ.
std::string with_units(const std::vector<std::string>& values, const std::vector<std::string>& units) {
  if (all_same(units)) return " [" + units.front() + "]: " + joined(values);
  std::vector<std::string> out;
  for (std::size_t k = 0; k < values.size(); ++k) out.push_back(values[k] + " " + units[k]);
  return ": " + joined(out);
}

std::string constants_text(const LogNote& note, const cell::Cell& cell) {
  std::vector<std::string> values, units;
  for (std::size_t k = 0; k < note.values.size(); ++k) {
    values.push_back(digits(note.values[k], 3) + " ± " + digits(note.deviations[k], 1));
    units.push_back(load_unit(cell, static_cast<int>(k)) + "/A");
  }
  return "torque constants from the log, for the masses of the model" + with_units(values, units);
}

std::string joint_noise_text(const LogNote& note, const cell::Cell& cell) {
  std::vector<std::string> values, units;
  for (std::size_t k = 0; k < note.values.size(); ++k) {
    values.push_back(digits(note.values[k], 2));
    units.push_back(note.name == "i" ? "A" : load_unit(cell, static_cast<int>(k)));
  }
  const std::size_t n = note.values.size();
  const std::string columns = n == 1 ? note.name + "1" : note.name + "1 to " + note.name + std::to_string(n);
  return "noise of " + columns + ", from neighbouring rows" + with_units(values, units);
}

std::string colour_text(const LogNote& note, const cell::Cell& cell) {
  std::vector<std::string> values, units, columns, correlations;
  for (std::size_t k = 0; k < note.joints.size(); ++k) {
    columns.push_back(note.name + std::to_string(note.joints[k] + 1));
    values.push_back(digits(note.values[k], 2));
    units.push_back(note.name == "i" ? "A" : load_unit(cell, note.joints[k]));
    correlations.push_back(digits(note.deviations[k], 2));
  }
  return "the noise of " + joined(columns) + " is alike in neighbouring rows (correlation " + joined(correlations) +
         "), so that it is larger than these show" + with_units(values, units);
}

std::string directions_text(const LogNote& note, const cell::Cell& cell) {
  std::vector<std::string> shares;
  for (std::size_t k = 0; k < note.values.size(); ++k)
    if (note.values[k] > 0)
      shares.push_back(joint_name(cell, static_cast<int>(k)) + " in " + digits(100 * note.values[k], 2) + " %");
  return "at rest and about reversals the side of dry friction is not known; the load of a joint is not compared in "
         "these rows (" +
         joined(shares) + ")";
}

std::string unmeasured_text(const LogNote& note, const cell::Cell& cell) {
  std::vector<std::string> names;
  for (const int joint : note.joints) names.push_back(joint_name(cell, joint));
  return "the loads of " + joined(names) +
         " show hardly anything where the model shows a load, so that they are not judged; does the driver measure "
         "them?";
}

}  // namespace

std::string text(const LogNote& note, const cell::Cell& cell) {
  switch (note.kind) {
    case LogNoteKind::NoDrives:
      return "the model states no drives: friction and rotor inertia are taken as 0";
    case LogNoteKind::NoTool:
      return "the model states no tool: nothing is taken to hang on the flange";
    case LogNoteKind::TorqueConstants:
      return constants_text(note, cell);
    case LogNoteKind::TorqueNoise:
      return "noise of the joint torques follows from that of the currents";
    case LogNoteKind::JointNoise:
      return joint_noise_text(note, cell);
    case LogNoteKind::ColouredNoise:
      return colour_text(note, cell);
    case LogNoteKind::ChannelNoise:
      return "noise." + note.name + ", from neighbouring rows: " + digits(note.value, 2);
    case LogNoteKind::UnmeasuredLoads:
      return unmeasured_text(note, cell);
    case LogNoteKind::DelayedLoads:
      return std::string("with masses and friction fitted, the ") + (note.name == "tau" ? "torques" : "currents") +
             " match the motion best if they were logged " + digits(1e3 * std::abs(note.value), 3) + " ms " +
             (note.value > 0 ? "late" : "early");
    case LogNoteKind::SmoothedPositions:
      return "positions were smoothed at " + digits(note.value, 3) +
             " Hz (no delay), since speeds and accelerations follow from them; efforts and currents are as logged";
    case LogNoteKind::EvenClock:
      return "the time stamps came late; the samples were taken at even steps";
    case LogNoteKind::MeasuredForCommand:
      return "the measured joint values replace the commands, so that the recording contains no information about the "
             "servos";
    case LogNoteKind::CutAtRest:
      return "up to " + digits(note.value, 6) + " s to fit, the rest to check: cut where the arm rests";
    case LogNoteKind::Cut:
      return "up to " + digits(note.value, 6) + " s to fit, the rest to check";
    case LogNoteKind::Stretches:
      return "the log is long: " + digits(note.value, 3) + " stretches, spread over it, are compared";
    case LogNoteKind::UnknownDirections:
      return directions_text(note, cell);
    case LogNoteKind::TorqueScale:
      return "no efforts were logged, so that torques have the scale of the masses of the model: stiffness, damping, "
             "friction and rotor inertia are wrong by the same factor as these, and only their ratios are measured; a "
             "motion with a known weight at the flange, stated in the model, tells the factor";
  }
  return {};
}

}  // namespace kr5::arm_log
