// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/timed_hand_eye.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <kr5/core/error.hpp>

#include "calibration/hand_eye/closed_form.hpp"
#include "calibration/timed_hand_eye/refinement.hpp"

namespace kr5::calibration {
namespace {

using timed::Trajectory;

template <class... Values>
std::string text(const char* format, Values... values) {
  char buffer[512];
  std::snprintf(buffer, sizeof buffer, format, values...);
  return buffer;
}

/// The stream as it would be had the quaternion been written in the other order: read as (x y z w), meant (w x y z),
/// or the other way round.
PoseStream reordered(PoseStream stream, bool scalar_first) {
  for (Pose& T : stream.poses) {
    const Eigen::Quaterniond q(T.linear());
    T.linear() =
        (scalar_first ? Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()) : Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()))
            .toRotationMatrix();
  }
  return stream;
}

PoseStream inverted(PoseStream stream) {
  for (Pose& T : stream.poses) T = T.inverse();
  return stream;
}

struct StreamHypothesis {
  const char* cause;
  PoseStream hand, camera;
  const char* words;
};

/// What else the streams might have meant. The speed of turning, and with it the offset, is the same for all.
std::vector<StreamHypothesis> hypotheses(const PoseStream& hand, const PoseStream& camera) {
  const char* order_hand = "the hand's quaternions are in the other order: w first instead of last, or the reverse";
  const char* order_camera = "the camera's quaternions are in the other order: w first instead of last, or the reverse";
  const char* order_both =
      "the quaternions of both streams are in the other order: w first instead of last, or the reverse";
  return {
      {"quaternion_order_hand", reordered(hand, true), camera, order_hand},
      {"quaternion_order_hand", reordered(hand, false), camera, order_hand},
      {"quaternion_order_camera", hand, reordered(camera, true), order_camera},
      {"quaternion_order_camera", hand, reordered(camera, false), order_camera},
      {"quaternion_order_both", reordered(hand, true), reordered(camera, true), order_both},
      {"quaternion_order_both", reordered(hand, false), reordered(camera, false), order_both},
      {"inverted", inverted(hand), camera,
       "one stream's poses are inverted (base in hand instead of hand in base, or world in camera instead of camera "
       "in world); which one cannot be determined, because inverting either makes them agree"}};
}

void degenerate(TimedHandEyeResult& result, const char* cause, const std::string& message) {
  result.cause = cause;
  result.fit.status = FitStatus::Degenerate;
  result.fit.message = message;
}

/// Do the clocks overlap at all, given that they may differ by `max_offset`?
bool overlapping(const Trajectory& hand, const Trajectory& camera, const TimedHandEyeOptions& options,
                 TimedHandEyeResult& result) {
  const double reach = options.max_offset;
  const double overlap = std::min(hand.end() + reach, camera.end()) - std::max(hand.begin() - reach, camera.begin());
  const auto times =
      text("hand %.3f to %.3f s, camera %.3f to %.3f s", hand.begin(), hand.end(), camera.begin(), camera.end());
  if (overlap <= 0)
    return degenerate(
               result, "no_overlap",
               "the streams do not overlap: " + times +
                   text("; are both of the same recording and in seconds? if the clocks differ by more than %.1f s, "
                        "raise max_offset",
                        reach)),
           false;
  const double shortest = std::min({overlap, hand.end() - hand.begin(), camera.end() - camera.begin()});
  if (shortest < options.min_duration)
    return degenerate(
               result, "too_short",
               text("the streams overlap for only %.1f s, expected at least %.1f s: ", shortest, options.min_duration) +
                   times),
           false;
  return true;
}

/// Is there turning enough, and about two axes?
bool excited(const PoseStream& hand, const PoseStream& camera, const TimedHandEyeOptions& options,
             TimedHandEyeResult& result) {
  const Eigen::Vector3d spread = principal_turns(hand.poses).cwiseMin(principal_turns(camera.poses));
  constexpr double degrees = 57.29577951308232;
  if (spread[0] < options.min_rotation)
    return degenerate(result, "no_motion",
                      text("the hand hardly turns (RMS %.1f deg, needed %.1f deg): offset and hand-eye pose cannot be "
                           "determined; "
                           "record again, turning the wrist by 30 deg or more about two axes",
                           spread[0] * degrees, options.min_rotation * degrees)),
           false;
  if (spread[1] < options.min_rotation)
    return degenerate(
               result, "one_axis",
               text("the hand turns about one axis only (RMS %.1f deg about a second one, needed %.1f deg): the "
                    "camera's position along that axis cannot be determined; record again, turning about two axes",
                    spread[1] * degrees, options.min_rotation * degrees)),
           false;
  return true;
}

/// RMS distance of the positions of a stream from their mean [m].
double travel(const PoseStream& stream) { return position_spread(stream.poses).second; }

/// A start that fits, or the cause why none does. A reordered quaternion is an inversion up to constant turns, so that
/// only the positions tell these two apart.
bool find_start(const Trajectory& hand, const PoseStream& camera, const TimedHandEyeOptions& options,
                timed::Start& start, TimedHandEyeResult& result) {
  constexpr double most_turn = 0.1, most_shift = 0.25;  // noise stays far below [rad], [of the travel]
  const auto fits = [&](const timed::Start& s) { return s.turn < most_turn && s.shift < most_shift * travel(camera); };
  const double offset = result.alignment.offset;
  start = timed::closed_form_at(hand, camera, offset);
  if (fits(start)) return true;
  timed::Start best = start;
  const char* cause = "no_correlation";
  std::string words =
      "no hand-eye transform makes the streams agree: are both of the same recording, is the world of "
      "the camera fixed, are positions in metres?";
  for (const StreamHypothesis& h : hypotheses(hand.stream(), camera)) {
    const timed::Start other = timed::closed_form_at(Trajectory(h.hand, options.max_gap), h.camera, offset);
    if (other.turn < most_turn && other.shift < most_shift * travel(h.camera) &&
        (best.turn >= most_turn || other.shift < best.shift))
      best = other, cause = h.cause, words = h.words;
  }
  degenerate(result, cause,
             words + text(" (median disagreement as given: %.1f deg and %.0f mm)", start.turn * 57.2957795,
                          start.shift * 1e3));
  return false;
}

}  // namespace

void TimedHandEyeOptions::validate() const {
  require(max_offset > 0 && max_offset <= 60, "max_offset must lie between 0 and 60 [s]");
  require(max_gap > 0, "max_gap must be positive [s]");
  require(window > 0 && window < 2, "window must lie between 0 and 2 [s]");
  require(min_duration > 2 * window, "min_duration must be longer than two windows [s]");
  require(min_rotation > 0 && min_rotation < 1, "min_rotation must lie between 0 and 1 [rad]");
  require(min_correlation > 0 && min_correlation < 1, "min_correlation must lie between 0 and 1 [-]");
  require(tail >= 2, "tail must be at least 2");
  require(max_iterations >= 1, "max_iterations must be at least 1");
}

TimedHandEyeResult calibrate_timed_hand_eye(const PoseStream& hand_stream, const PoseStream& camera_stream,
                                            const TimedHandEyeOptions& options) {
  options.validate();
  const Trajectory hand(timed::tidy(hand_stream, "hand"), options.max_gap);
  // Only the alignment interpolates the camera, whose detections come and go.
  const Trajectory camera(timed::tidy(camera_stream, "camera"), std::max(options.max_gap, options.window));
  TimedHandEyeResult result;
  if (!overlapping(hand, camera, options, result)) return result;
  if (!excited(hand.stream(), camera.stream(), options, result)) return result;
  result.alignment = timed::align(hand, camera, options);
  if (result.alignment.correlation < options.min_correlation)
    return degenerate(result, "no_correlation",
                      text("the angular speeds do not agree at any offset up to %.1f s (correlation %.2f, needed "
                           "%.2f): are both streams of the same recording?",
                           options.max_offset, result.alignment.correlation, options.min_correlation)),
           result;
  timed::Start start;
  if (!find_start(hand, camera.stream(), options, start, result)) return result;
  timed::refine(hand, camera.stream(), options, start.estimate, result);
  std::tie(result.spread_median, result.spread_rms) =
      position_spread(world_in_base(hand_stream, camera_stream, result, options.max_gap));
  if (result.fit.status == FitStatus::Converged)
    result.fit.message = text("offset %.2f ms from %d camera poses", result.offset * 1e3, result.used);
  return result;
}

std::vector<Pose> world_in_base(const PoseStream& hand_stream, const PoseStream& camera_stream,
                                const TimedHandEyeResult& result, double max_gap) {
  const Trajectory hand(timed::tidy(hand_stream, "hand"), max_gap);
  const PoseStream camera = timed::tidy(camera_stream, "camera");
  std::vector<Pose> out;
  for (std::size_t k = 0; k < camera.t.size(); ++k)
    if (const auto sample = hand.at(camera.t[k] - result.offset))
      out.push_back(sample->T * result.T_hand_camera * camera.poses[k].inverse());
  return out;
}

std::pair<double, double> position_spread(const std::vector<Pose>& poses) {
  const Eigen::Vector3d mean = mean_pose(poses).translation();
  std::vector<double> distance;
  double sum = 0;
  for (const Pose& T : poses) {
    distance.push_back((T.translation() - mean).norm());
    sum += distance.back() * distance.back();
  }
  std::nth_element(distance.begin(), distance.begin() + static_cast<std::ptrdiff_t>(distance.size() / 2),
                   distance.end());
  return {distance[distance.size() / 2], std::sqrt(sum / static_cast<double>(distance.size()))};
}

}  // namespace kr5::calibration
