// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye_diagnosis/cause_messages.hpp"

#include <cmath>
#include <cstdio>
#include <numbers>

namespace kr5::calibration::evidence {
namespace {

/// With so many digits, large ones in full: 170, not 1.7e+02.
std::string number(double value, int digits = 3) {
  char text[32];
  const double unit = std::pow(10.0, std::floor(std::log10(std::abs(value))) + 1 - digits);
  if (unit > 1.0)
    std::snprintf(text, sizeof text, "%.0f", unit * std::round(value / unit));
  else
    std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}
std::string mm(double metres, int digits = 3) {
  constexpr double least = 1e-6;  // less is of no use to anybody [m]
  return metres < least ? "less than 0.001 mm" : number(1e3 * metres, digits) + " mm";
}
std::string degrees(double radians) { return number(radians * 180 / std::numbers::pi) + " deg"; }

std::string list(const Case& c, const std::vector<int>& views) {
  std::string out;
  for (std::size_t k = 0; k < views.size() && k < 8; ++k) {
    const std::string& name = c.recording.views[static_cast<std::size_t>(views[k])].name;
    out += (k ? ", " : "") + (name.empty() ? "view " + std::to_string(views[k] + 1) : name);
  }
  return out + (views.size() > 8 ? ", ..." : "");
}

std::string format_text(const PoseFormat& f) {
  return std::string(name_of(f.meaning)) + ", " + std::string(name_of(f.rotation)) + ", " +
         std::string(name_of(f.position)) + ", " + std::string(name_of(f.angle));
}

void say(NamedCause& n, std::string text, std::string remedy) {
  n.text = std::move(text);
  n.remedy = std::move(remedy);
}

void describe_format(const Case& c, const SetupHypothesis& h, NamedCause& n) {
  const std::string convention = "Set the convention of the poses to: " + format_text(h.format) + ".";
  switch (n.cause) {
    case HandEyeCause::PosesInverted:
      return say(n,
                 c.pairs ? "The robot poses or the camera's poses are the inverse of what is stated, or the mount is "
                           "wrong; the data cannot show which."
                         : "The robot poses are the inverse of what the convention states, or the mount is wrong (eye "
                           "in hand and eye to hand exchanged).",
                 convention + " Or change the mount.");
    case HandEyeCause::QuaternionOrder:
      return say(n, "The components of the quaternions are in a different order.", convention);
    case HandEyeCause::DegreesForRadians:
      return say(n,
                 std::string("The angles are ") + (h.format.angle == AngleUnit::Degree ? "degrees" : "radians") +
                     ", but are read as " + (h.format.angle == AngleUnit::Degree ? "radians." : "degrees."),
                 convention);
    case HandEyeCause::MillimetresForMetres:
      return say(n,
                 "The positions are in " + std::string(name_of(h.format.position)) + ", but are read as " +
                     std::string(name_of(c.recording.format.position)) + ".",
                 convention);
    default:
      return say(n, "The orientations are given in a different representation.", convention);
  }
}

void describe_camera(const Case& c, const SetupHypothesis& h, NamedCause& n) {
  const double focal = 100 * (h.camera.fx / c.recording.camera.fx - 1);
  n.value = focal, n.unit = "% of the focal length";
  say(n,
      "The camera's parameters do not fit these images: a focal length " + number(std::abs(focal)) + " % " +
          (focal > 0 ? "longer" : "shorter") + " (fx " + number(h.camera.fx, 5) + " instead of " +
          number(c.recording.camera.fx, 5) + " px)" + (h.freedom > 4 ? " and a different lens distortion" : "") +
          " explains them better.",
      "Calibrate the camera again at this focus, zoom and resolution, or omit the camera file: the camera is then "
      "calibrated from these images.");
}

void describe_outliers(const Case& c, const SetupHypothesis& h, NamedCause& n) {
  const std::string what = c.pairs ? "pair" : "view",
                    others = std::to_string(c.recording.views.size() - h.views.size()) + " " + what + "s";
  if (h.views.size() == 1)
    return say(n, list(c, h.views) + " contradicts the other " + others + ".",
               c.pairs ? "Check this pair of poses; leave it out or record it again."
                       : "Check this image and its pose; leave it out or record it again.");
  say(n,
      std::to_string(h.views.size()) + " " + what + "s contradict the other " + others + ": " + list(c, h.views) + ".",
      c.pairs ? "Check these pairs of poses; leave them out or record them again."
              : "Check these images and poses; leave them out or record them again.");
}

void describe_setup(const Case& c, const SetupHypothesis& h, NamedCause& n) {
  switch (n.cause) {
    case HandEyeCause::TargetSizeWrong:
      n.unit = c.pairs ? "times the stated distance" : "times the stated size";
      if (c.pairs)
        return say(n, "The target is " + number(h.value, 4) + " times as far from the camera as its poses state.",
                   "Check the size of the target and the focal length in the software that found it.");
      return say(n, "The target is " + number(h.value, 4) + " times as large as stated.",
                 "Measure the printed target over its whole length and correct its size.");
    case HandEyeCause::MillimetresForMetres:
      n.unit = c.pairs ? "times the stated distance" : "times the stated size";
      if (c.pairs)
        return say(n,
                   "The positions of the camera's poses are off by a factor of " + number(h.value, 4) +
                       ": millimetres for metres.",
                   "State the camera's poses in metres.");
      return say(n, "The target's size is off by a factor of " + number(h.value, 4) + ": millimetres for metres.",
                 "State the size of the target in metres.");
    case HandEyeCause::ShiftedByOne:
      n.unit = "views";
      return say(n,
                 (c.pairs ? "Every pose of the camera is paired with the robot pose of the "
                          : "Every image is paired with the pose of the ") +
                     std::string(std::abs(h.value) > 1 ? "second " : "") + (h.value > 0 ? "next" : "previous") +
                     " one.",
                 c.pairs ? "Remove the surplus pose at the start or end of one of the two lists."
                         : "Remove the surplus image or pose at the start or end, so that each image has its own "
                           "pose.");
    case HandEyeCause::OutOfOrder:
      n.unit = "views";
      return say(n,
                 number(h.value) + (c.pairs ? " poses" : " images") +
                     " are paired with the wrong pose: " + list(c, h.views) + ".",
                 "Check how files are sorted (1, 10, 11, 2?) and pair " +
                     std::string(c.pairs ? "poses" : "images and poses") + " by number.");
    case HandEyeCause::TargetMoved:
      n.unit = "m";
      return say(n,
                 "The target (or the camera) was moved by " + mm(h.value) + " / " +
                     degrees(pose_difference(h.fit.Y, h.fit.Y_after).tail<3>().norm()) + " before " + list(c, h.views) +
                     ".",
                 "Use only the views before or after the motion, or fasten the target and record again.");
    case HandEyeCause::ClockOffset:
      n.unit = c.recording.times.empty() ? "views" : "s";
      return say(n,
                 "The arm was moving: the pose that belongs to an image is that of " + number(std::abs(h.value)) + " " +
                     n.unit + (h.value > 0 ? " later." : " earlier."),
                 "Let the arm stand still for each image, or correct the clocks by this time.");
    default:
      n.unit = "views";
      return describe_outliers(c, h, n);
  }
}

}  // namespace

void describe(const Case& c, const SetupHypothesis& h, NamedCause& n) {
  if (n.cause == HandEyeCause::CameraModelWrong)
    describe_camera(c, h, n);
  else if (n.cause == HandEyeCause::MirroredTarget)
    say(n, "The poses of the target are mirrored: the image is, or the target was printed or described left-handed.",
        "Switch off mirroring in the camera driver, or correct the order of the target's corners, and record again.");
  else if (h.freedom == 0 && n.cause != HandEyeCause::ShiftedByOne && n.cause != HandEyeCause::OutOfOrder)
    describe_format(c, h, n);
  else
    describe_setup(c, h, n);
  const ReadingFit& a = c.sound.fit;
  n.evidence = "With this corrected, robot and camera agree to " + mm(h.fit.sigma_position) + " and " +
               degrees(h.fit.sigma_rotation) + " per axis instead of " + mm(a.sigma_position) + " and " +
               degrees(a.sigma_rotation) + "; in fits to the poses of the target alone, the position error on " +
               "held-out views falls from " + mm(n.held_out_before) + " to " + mm(n.held_out_after) +
               " (RMS). The log likelihood rises by " + number(0.5 * (c.sound.score - h.score)) + ".";
}

void describe_rotation(const HandEyeDiagnosis& d, const HandEyeDiagnosisOptions& options, NamedCause& n) {
  const bool none = n.cause == HandEyeCause::TooLittleRotation;
  say(n, none ? "The wrist turned too little between the views." : "The wrist turned about one axis only.",
      "Record views with the wrist turned by 20 to 40 deg about at least two axes, to both sides.");
  n.evidence = "The wrist turned by " + degrees(d.rotation_major) + " (RMS) about one axis and by " +
               degrees(d.rotation_minor) + " about the second; below " + degrees(options.min_rotation) +
               " the views do not determine the position of the camera.";
}

std::string verdict_text(const HandEyeResult& result, const HandEyeDiagnosisOptions& options,
                         const HandEyeDiagnosis& d) {
  std::string text;
  if (!result.fit.usable())
    text = "No usable calibration: " + result.fit.message + ".";
  else
    text = "At " + number(d.working_distance, 2) + " m the expected error is " + mm(d.tool_error, 2) +
           " RMS (95 %: below " + mm(d.tool_error_95, 2) + "; your tolerance: " + mm(options.tolerance) + ").";
  if (d.causes.empty()) {
    if (d.verdict == CalibrationVerdict::Good) return text + " No fault was found in the recording.";
    return text + (result.fit.usable() ? " No single fault of the recording explains this: check rows, columns and "
                                         "size of the target, the camera file and the mount."
                                       : "");
  }
  const NamedCause& cause = d.causes.front();
  text += " " + cause.text;
  if (cause.consequence > 0) text += " Correcting this moves the result by " + mm(cause.consequence, 2) + ".";
  return text;
}

}  // namespace kr5::calibration::evidence
