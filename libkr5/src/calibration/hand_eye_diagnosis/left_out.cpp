// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye_diagnosis/left_out.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/hand_eye/model.hpp"

namespace kr5::calibration::evidence {
namespace {

/// Squared error of a point at the distance of the target, averaged over directions.
double squared_error(const Vector6& r, double lever) {
  return r.head<3>().squaredNorm() + 2.0 / 3.0 * lever * lever * r.tail<3>().squaredNorm();
}

/// The reading without every pair whose place is `fold` modulo `folds`.
Reading without(const Reading& reading, int fold, int folds) {
  Reading kept = reading;
  kept.robot.clear(), kept.sighting.clear(), kept.drift.clear(), kept.inflation.clear(), kept.split = 0;
  for (int i = 0; i < reading.size(); ++i) {
    if (i % folds == fold) continue;
    const auto k = static_cast<std::size_t>(i);
    kept.robot.push_back(reading.robot[k]);
    kept.sighting.push_back(reading.sighting[k]);
    if (!reading.drift.empty()) kept.drift.push_back(reading.drift[k]);
    if (!reading.inflation.empty()) kept.inflation.push_back(reading.inflation[k]);
    if (i < reading.split) ++kept.split;
  }
  return kept;
}

/// Squared error [m^2] of pair i as `f`, made without it, predicts it.
double squared_error(const Reading& reading, const Sightings& sightings, int i, const ReadingFit& f) {
  const auto k = static_cast<std::size_t>(i);
  const Pose T = reading.drift.empty() ? reading.robot[k] : reading.robot[k] * to_pose(f.lag * reading.drift[k]);
  ReadingFit there = f;
  if (reading.split > 0 && i >= reading.split) there.Y = f.Y_after;
  return squared_point_error(T, sightings.views[static_cast<std::size_t>(reading.sighting[k])], there, reading.mount);
}

}  // namespace

double squared_point_error(const Pose& T_base_flange, const Sighting& sighting, const ReadingFit& f, Mount mount) {
  double least = 1e300;
  for (const auto& s : sighting.solutions) {
    Pose C = s.T_camera_target;
    C.translation() *= f.scale;
    least = std::min(
        least, squared_error(hand_eye::robot_residual(mount, {f.X, f.Y}, T_base_flange, C), C.translation().norm()));
  }
  return least;
}

double held_out_rms(const Reading& reading, const Sightings& sightings, int folds) {
  folds = std::min(folds, reading.size());
  double sum = 0;
  int count = 0;
  for (int fold = 0; fold < folds; ++fold) {
    const ReadingFit f = fit_reading(without(reading, fold, folds), sightings);
    if (!f.usable) continue;
    for (int i = fold; i < reading.size(); i += folds) {
      if (!reading.inflation.empty() && reading.inflation[static_cast<std::size_t>(i)] != 1.0) continue;
      sum += squared_error(reading, sightings, i, f);
      ++count;
    }
  }
  return count ? std::sqrt(sum / count) : 0.0;
}

}  // namespace kr5::calibration::evidence
