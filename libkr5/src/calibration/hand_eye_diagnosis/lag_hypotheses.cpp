// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye_diagnosis/lag_hypotheses.hpp"

#include <algorithm>
#include <cmath>

/// @file
/// The clock hypothesis: the pose reported with an image is that of the moving arm somewhat before or after.

namespace kr5::calibration::evidence {
namespace {

/// A smooth path through the recorded poses: cubic polynomials through the four poses nearest in time.
class Path {
 public:
  Path(const std::vector<Pose>& poses, std::vector<double> times) : poses_(poses), times_(std::move(times)) {}

  Pose at(double t, int near) const {
    const int n = static_cast<int>(poses_.size());
    const int first = std::clamp(t < time(near) ? near - 2 : near - 1, 0, n - 4);
    Vector6 d = Vector6::Zero();
    for (int j = first; j < first + 4; ++j) {
      double weight = 1;
      for (int k = first; k < first + 4; ++k)
        if (k != j) weight *= (t - time(k)) / (time(j) - time(k));
      d += weight * pose_difference(pose(near), pose(j));
    }
    return pose(near) * to_pose(d);
  }
  double time(int i) const { return times_[static_cast<std::size_t>(i)]; }

 private:
  const Pose& pose(int i) const { return poses_[static_cast<std::size_t>(i)]; }
  const std::vector<Pose>& poses_;
  std::vector<double> times_;
};

std::vector<double> times_of(const HandEyeRecording& recording) {
  std::vector<double> t = recording.times;
  if (t.empty())
    for (std::size_t i = 0; i < recording.views.size(); ++i) t.push_back(static_cast<double>(i));
  return t;
}

/// Typical time from one view to the next.
double step_of(const std::vector<double>& t) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < t.size(); ++i) steps.push_back(t[i] - t[i - 1]);
  std::nth_element(steps.begin(), steps.begin() + steps.size() / 2, steps.end());
  return steps[steps.size() / 2];
}

}  // namespace

std::vector<SetupHypothesis> delayed_readings(const Case& c) {
  const std::vector<double> times = times_of(c.recording);
  if (times.size() < 5 || !std::is_sorted(times.begin(), times.end(), std::less_equal<>())) return {};
  const double step = step_of(times);
  const Path path(c.poses, times);
  std::vector<SetupHypothesis> out;
  for (int k = -9; k <= 9; ++k) {
    const double lag = 0.1 * k * step, tiny = 1e-4 * step;
    SetupHypothesis h;
    h.reading = c.sound.reading;
    for (int i = 0; i < h.reading.size(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      const int view = c.sightings.index[at];
      const Pose before = path.at(path.time(view) + lag, view), after = path.at(path.time(view) + lag + tiny, view);
      h.reading.robot[at] = before;
      h.reading.drift.push_back(pose_difference(before, after) / tiny);
    }
    h.fit = fit_reading(h.reading, c.sightings);
    // Beyond the neighbouring start the path is no longer straight.
    if (!h.fit.usable || std::abs(h.fit.lag) > 0.15 * step) continue;
    h.score = h.fit.score;
    h.freedom = 1;
    h.choices = std::log(2.0);
    h.causes = {HandEyeCause::ClockOffset};
    h.value = lag + h.fit.lag;
    out.push_back(std::move(h));
  }
  return out;
}

}  // namespace kr5::calibration::evidence
