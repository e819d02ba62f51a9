// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye_diagnosis/hypotheses.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Dense>

#include <kr5/core/error.hpp>

namespace kr5::calibration::evidence {
namespace {

double metres(LengthUnit unit) {
  return unit == LengthUnit::Metre ? 1.0 : unit == LengthUnit::Centimetre ? 0.01 : 0.001;
}

std::vector<HandEyeCause> differences(const PoseFormat& a, const PoseFormat& b) {
  using enum HandEyeCause;
  std::vector<HandEyeCause> out;
  if (a.position != b.position) out.push_back(MillimetresForMetres);
  if (a.angle != b.angle) out.push_back(DegreesForRadians);
  if (a.rotation != b.rotation) {
    const bool quaternion = b.rotation == RotationForm::QuaternionXyzw || b.rotation == RotationForm::QuaternionWxyz;
    out.push_back(quaternion ? QuaternionOrder : WrongRotationForm);
  }
  if (a.meaning != b.meaning) out.push_back(PosesInverted);
  return out;
}

/// Every way of reading rows of this length.
std::vector<PoseFormat> formats(const Eigen::MatrixXd& rows, const PoseFormat& believed) {
  std::vector<PoseFormat> out;
  for (const auto& [rotation, r] : enum_names(RotationForm{}))
    for (const LengthUnit unit : {LengthUnit::Metre, LengthUnit::Millimetre})
      for (const AngleUnit angle : {AngleUnit::Radian, AngleUnit::Degree})
        for (const PoseMeaning meaning : {PoseMeaning::BaseFlange, PoseMeaning::FlangeBase}) {
          const bool angles = row_length(rotation) == 6;
          if (row_length(rotation) != std::min<Eigen::Index>(rows.cols(), 12)) continue;
          if (!angles && angle != believed.angle) continue;
          if (const PoseFormat f{unit, rotation, angle, meaning}; !(f == believed)) out.push_back(f);
        }
  return out;
}

/// Costs of an impossible reading, in units of -2 log probability: one in a million.
constexpr double implausible = 27.6;

}  // namespace

Sightings given_sightings(const std::vector<Pose>& T_camera_target) {
  Sightings out;
  out.noise_varies = true;
  const auto add = [&](const Pose& T) { out.views.push_back({{{.T_camera_target = T}}}); };
  for (std::size_t i = 0; i < T_camera_target.size(); ++i) out.index.push_back(static_cast<int>(i));
  for (const Pose& T : T_camera_target) add(T);
  // An image that is mirrored, or a target that is: whichever plane mirrors, another differs by a pose of camera and
  // target, which are unknown anyway.
  const Eigen::Vector3d mirror(-1, 1, 1);
  for (const Pose& T : T_camera_target) {
    Pose mirrored = Pose::Identity();
    mirrored.linear() = mirror.asDiagonal() * T.linear() * mirror.asDiagonal();
    mirrored.translation() = mirror.asDiagonal() * T.translation();
    add(mirrored);
  }
  return out;
}

Reading as_recorded(const Case& c, const std::vector<Pose>& poses) {
  Reading r;
  r.mount = c.recording.mount;
  for (std::size_t k = 0; k < c.sightings.index.size(); ++k) {
    r.robot.push_back(poses[static_cast<std::size_t>(c.sightings.index[k])]);
    r.sighting.push_back(static_cast<int>(k));
  }
  return r;
}

std::vector<SetupHypothesis> other_formats(const Case& c) {
  std::vector<SetupHypothesis> out;
  for (const PoseFormat& format : formats(c.recording.rows, c.recording.format)) {
    SetupHypothesis h;
    try {
      h.reading = as_recorded(c, to_poses(c.recording.rows, format));
    } catch (const InvalidArgument&) {
      continue;  // the numbers cannot be read like this
    }
    h.fit = fit_reading(h.reading, c.sightings);
    if (!h.fit.usable) continue;
    h.causes = differences(c.recording.format, format);
    h.format = format;
    // The likelihood is that of the numbers as written: rescaling positions rescales their density.
    const double rescale = std::log(metres(format.position) / metres(c.recording.format.position));
    h.score = h.fit.score - 6.0 * rescale * h.reading.size() +
              (format_objections(c.recording.rows, format).empty() ? 0.0 : implausible);
    h.choices = std::log(10.0) * static_cast<double>(h.causes.size());
    out.push_back(std::move(h));
  }
  return out;
}

std::vector<SetupHypothesis> mirrored_target(const Case& c) {
  SetupHypothesis h;
  h.reading = c.sound.reading;
  for (int& k : h.reading.sighting) k += static_cast<int>(c.sightings.index.size());
  h.fit = fit_reading(h.reading, c.sightings);
  if (!h.fit.usable) return {};
  h.score = h.fit.score;
  h.choices = std::log(10.0);
  h.causes = {HandEyeCause::MirroredTarget};
  return {h};
}

std::vector<SetupHypothesis> other_size(const Case& c) {
  SetupHypothesis h;
  h.reading = c.sound.reading;
  h.reading.free_scale = true;
  h.fit = fit_reading(h.reading, c.sightings);
  if (!h.fit.usable) return {};
  h.score = h.fit.score;
  h.freedom = 1;
  h.value = h.fit.scale;
  const double thousand = std::abs(std::abs(std::log10(h.value)) - 3.0);
  h.causes = {thousand < 0.1 ? HandEyeCause::MillimetresForMetres : HandEyeCause::TargetSizeWrong};
  return {h};
}

std::vector<SetupHypothesis> shifted_readings(const Case& c) {
  std::vector<SetupHypothesis> out;
  const int n = static_cast<int>(c.poses.size());
  for (const int by : {-2, -1, 1, 2}) {
    SetupHypothesis h;
    h.reading.mount = c.recording.mount;
    for (std::size_t k = 0; k < c.sightings.index.size(); ++k) {
      const int pose = c.sightings.index[k] + by;
      if (pose < 0 || pose >= n) continue;
      h.reading.robot.push_back(c.poses[static_cast<std::size_t>(pose)]);
      h.reading.sighting.push_back(static_cast<int>(k));
    }
    if (h.reading.size() < 4) continue;
    h.fit = fit_reading(h.reading, c.sightings);
    if (!h.fit.usable) continue;
    // A view that lost its pose counts like the average of the others.
    h.score = h.fit.score * c.sound.reading.size() / h.reading.size();
    h.causes = {HandEyeCause::ShiftedByOne};
    h.choices = std::log(4.0);
    h.value = by;
    out.push_back(std::move(h));
  }
  return out;
}

std::vector<SetupHypothesis> moved_target(const Case& c) {
  std::vector<SetupHypothesis> out;
  const int n = c.sound.reading.size();
  for (int split = 2; split <= n - 2; ++split) {
    SetupHypothesis h;
    h.reading = c.sound.reading;
    h.reading.split = split;
    h.fit = fit_reading(h.reading, c.sightings);
    if (!h.fit.usable) continue;
    h.score = h.fit.score;
    h.freedom = 6;
    h.choices = std::log(static_cast<double>(n));
    h.causes = {HandEyeCause::TargetMoved};
    h.value = pose_difference(h.fit.Y, h.fit.Y_after).head<3>().norm();
    h.views = {c.sightings.index[static_cast<std::size_t>(split)]};
    out.push_back(std::move(h));
  }
  return out;
}

std::vector<SetupHypothesis> outlier_readings(const Case& c) {
  std::vector<SetupHypothesis> out;
  const int n = c.sound.reading.size();
  SetupHypothesis h = c.sound;
  h.causes = {HandEyeCause::OutlierViews};
  h.reading.inflation.assign(static_cast<std::size_t>(n), 1.0);
  for (int count = 1; count <= n / 3 && n - count >= 5; ++count) {
    const auto worst = std::max_element(h.fit.chi_squared.begin(), h.fit.chi_squared.end());
    const auto k = static_cast<std::size_t>(worst - h.fit.chi_squared.begin());
    if (h.reading.inflation[k] > 1.0) break;  // a spoiled view is still the worst: more would not help
    h.reading.inflation[k] = 1e4;
    // Two rounds: the factor of a view follows from a fit that it no longer spoils.
    for (int round = 0; round < 3; ++round) {
      h.fit = fit_reading(h.reading, c.sightings);
      if (!h.fit.usable) return out;
      for (std::size_t i = 0; i < h.reading.inflation.size(); ++i)
        if (double& f = h.reading.inflation[i]; f > 1.0) f = std::max(f * h.fit.chi_squared[i] / 6.0, 1.0 + 1e-9);
    }
    h.score = h.fit.score;
    h.freedom = count;
    h.choices = std::lgamma(n + 1.0) - std::lgamma(count + 1.0) - std::lgamma(n - count + 1.0);
    h.views.push_back(c.sightings.index[k]);
    h.value = count;
    out.push_back(h);
  }
  return out;
}

}  // namespace kr5::calibration::evidence
