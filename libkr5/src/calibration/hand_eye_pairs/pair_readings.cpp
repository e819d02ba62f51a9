// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/pair_readings.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include "calibration/hand_eye_diagnosis/reading_fit.hpp"
#include "calibration/hand_eye_pairs/check_pairs.hpp"

namespace kr5::calibration {
namespace {

constexpr double false_reading = 0.001;  // probability that chance makes a wrong reading the best
constexpr double clearly_worse = 2.0;    // ratio of the disagreements, for data that no reading fits are no evidence

std::string number(const char* format, double value) {
  char text[40];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string meaning_text(const PairReading& reading) {
  return std::string(reading.robot_inverted ? "T_flange_base" : "T_base_flange") + " and " +
         (reading.camera_inverted ? "T_target_camera" : "T_camera_target");
}

std::string agreement_text(const PairReading& reading) {
  return "(" + number("%.3g", 1e3 * reading.sigma_position) + " mm, " +
         number("%.3g", reading.sigma_rotation * 180 / std::numbers::pi) + " deg)";
}

/// A reading and the one with both lists inverted, in which the two unknown poses change places.
std::array<PairReading, 2> fitted(std::span<const PosePair> pairs, Mount mount, PairReading reading) {
  evidence::Reading r;
  r.mount = mount;
  evidence::Sightings sightings;
  for (const PosePair& pair : read_pairs(pairs, reading)) {
    r.sighting.push_back(r.size());
    r.robot.push_back(pair.T_base_flange);
    sightings.views.push_back({{{.T_camera_target = pair.T_camera_target}}});
  }
  const evidence::ReadingFit fit = evidence::fit_reading(r, sightings);
  reading.score = fit.usable ? fit.score : std::numeric_limits<double>::max();
  reading.sigma_position = fit.sigma_position;
  reading.sigma_rotation = fit.sigma_rotation;
  const bool in_hand = mount == Mount::EyeInHand;
  reading.flange_distance = (in_hand ? fit.X : fit.Y).translation().norm();
  reading.base_distance = (in_hand ? fit.Y : fit.X).translation().norm();
  PairReading both = reading;
  both.robot_inverted = !reading.robot_inverted, both.camera_inverted = !reading.camera_inverted;
  std::swap(both.flange_distance, both.base_distance);
  return {reading, both};
}

}  // namespace

std::vector<PosePair> read_pairs(std::span<const PosePair> pairs, const PairReading& reading) {
  std::vector<PosePair> out(pairs.begin(), pairs.end());
  for (PosePair& pair : out) {
    if (reading.robot_inverted) pair.T_base_flange = pair.T_base_flange.inverse();
    if (reading.camera_inverted) pair.T_camera_target = pair.T_camera_target.inverse();
  }
  return out;
}

PairReadings compare_pair_readings(std::span<const PosePair> pairs, Mount mount) {
  check_pairs(pairs);
  const auto alike = fitted(pairs, mount, {});
  auto opposed = fitted(pairs, mount, {.robot_inverted = true});
  if (opposed[1].flange_distance < opposed[0].flange_distance) std::swap(opposed[0], opposed[1]);
  const bool one_inverted = opposed[0].score < alike[0].score;
  const auto &best = one_inverted ? opposed : alike, &other = one_inverted ? alike : opposed;
  PairReadings out;
  out.readings = {best[0], best[1], other[0], other[1]};
  const double numbers = 6.0 * static_cast<double>(pairs.size());
  const double margin = std::max(-2 * std::log(false_reading), 2 * numbers * std::log(clearly_worse));
  out.certain = other[0].score - best[0].score > margin;
  const std::string carried = mount == Mount::EyeInHand ? "camera" : "target";
  if (!out.certain)
    out.text = "The data do not show whether one of the two lists of poses is inverted: they agree as " +
               meaning_text(best[0]) + " " + agreement_text(best[0]) + " and as " + meaning_text(other[0]) + " " +
               agreement_text(other[0]) + ".";
  else
    out.text = std::string(one_inverted ? "One of the two lists of poses is inverted: they agree as "
                                        : "The poses agree as ") +
               meaning_text(best[0]) + " " + agreement_text(best[0]) + ", with the " + carried + " " +
               number("%.2f", best[0].flange_distance) + " m from the flange; as " + meaning_text(best[1]) +
               " they agree as well, with the " + carried + " " + number("%.2f", best[1].flange_distance) +
               " m from the flange; otherwise only to " + agreement_text(other[0]) + ".";
  return out;
}

}  // namespace kr5::calibration
